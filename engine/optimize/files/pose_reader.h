// Coordinates by name in problem files. Internal header.
#pragma once

#include "counterpoint/model/model.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::optimization {

/// Sets a value from a positive number under a key, if the map has it.
inline void read_positive(const YamlValue& in, const char* key, double& value) {
  if (in.has(key)) value = in.at(key).positive();
}

/// Sets coordinates of q (nq) from a map {name: value}. Names are joints or columns of a trajectory
/// ("pelvis.z"), or patterns with '*'. Quaternions are normalized.
void read_pose(const YamlValue& in, const Model& model, VectorX& q);

/// Sets entries of a vector over v (nv) from a map {name or pattern: number}, in the order of the
/// file, or all entries from one number.
void read_by_velocity(const YamlValue& in, const Model& model, VectorX& values);

}  // namespace counterpoint::optimization
