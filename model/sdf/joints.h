// One <joint> of an SDF file.
#pragma once

#include <sdf/Joint.hh>

#include "counterpoint/model/sdf/document.h"

namespace counterpoint::sdf_file {

/// Reads JointNode::motions. @throws InputError for types that are not supported.
std::vector<JointSpec> read_motions(Document& document, const sdf::Joint& joint,
                                    const std::string& name);

}  // namespace counterpoint::sdf_file
