// Builds trees from links and joints in any order, with closures for loops.
#pragma once

#include "counterpoint/model/sdf/bodies.h"

namespace counterpoint::sdf_file {

/// Adds the trees of one model and the closures of its loops. `X_WT`: world pose of the model
/// frame. Joints whose parent is farther from the root than their child are reversed. @throws
/// InputError for loops that no closure can close.
void add_trees(Document& document, const Bodies& bodies, const std::string& prefix,
               const Pose& X_WT, SdfModel& model);

}  // namespace counterpoint::sdf_file
