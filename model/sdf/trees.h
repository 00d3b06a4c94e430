// Links and joints in any order as trees, and closures where they form loops.
#pragma once

#include "counterpoint/model/sdf/bodies.h"

namespace counterpoint::sdf_file {

/// Adds the trees of one model, and the closures of its loops. `X_WT`: where its frame lies. A
/// joint whose parent hangs on its child is turned round. @throws InputError for loops that no
/// closure can close.
void add_trees(Document& document, const Bodies& bodies, const std::string& prefix,
               const Pose& X_WT, SdfModel& model);

}  // namespace counterpoint::sdf_file
