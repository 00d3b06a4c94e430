// Effort limits of joints, whether servos or motors drive them. Internal header.
#pragma once

#include <algorithm>

#include "counterpoint/model/model.h"

namespace counterpoint::optimization {

/// Limits each force (nv) [N, N m] to the effort limit of its joint.
inline void clamp_to_effort_limits(const Model& model, VectorX& force) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const double limit = model.joint(i - 1).effort_limit;
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k)
      force[k] = std::clamp(force[k], -limit, limit);
  }
}

}  // namespace counterpoint::optimization
