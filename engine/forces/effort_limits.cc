#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"

namespace counterpoint {

void limit_applied_forces(const Model& model, EffectSet effects, VectorOut tau) {
  size_t servo = 0;  // next servo: they are in the order of joints
  for (int i = 0; i < model.num_joints(); ++i) {
    const bool has_servo = servo < model.servos().size() && model.servos()[servo].joint == i;
    if (has_servo) ++servo;
    const JointInfo& joint = model.joint(i);
    if (!joint.actuated || !std::isfinite(joint.effort_limit)) continue;
    if (has_servo && effects.has(Effect::kServos)) continue;
    const Body& body = model.body(i + 1);
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k)
      tau[k] = std::clamp(tau[k], -joint.effort_limit, joint.effort_limit);
  }
}

}  // namespace counterpoint
