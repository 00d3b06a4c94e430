// Coordinates by name in problem files. Not for users.
#pragma once

#include "counterpoint/engine/motion_files.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::optimization {

/// Sets coordinates of q (nq) from a map {name: value}: joints, or columns of a trajectory
/// ("pelvis.z"); patterns with '*'. Quaternions are brought to unit length.
void read_pose(const YamlValue& in, const Model& model, VectorX& q);

/// Sets entries of a vector over v (nv) from a map {name or pattern: number}, in the order of the
/// file; or all of it from one number.
void read_by_velocity(const YamlValue& in, const Model& model, VectorX& values);

}  // namespace counterpoint::optimization
