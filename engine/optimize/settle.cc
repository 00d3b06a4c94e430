#include "counterpoint/engine/optimize/settle.h"

#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint::optimization {
namespace {

/// Largest distance from the standing pose [m].
constexpr double kReach = 0.5;
constexpr int kHalvings = 60;

/// A coordinate that moves its tree along z, as indices into q and v; -1: none.
struct Lift {
  Eigen::Index q = -1, v = -1;
};

Lift lift_of(const Model& model, const Tree& tree, const std::vector<char>& motors,
             const VectorX& at) {
  const Body& base = model.body(tree.body_begin);
  if (base.joint_type == JointType::kFloating) return {base.q_index + 2, base.v_index + 2};
  Data data(model);
  compute_poses(model, at, data);
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    const Body& body = model.body(i);
    if (body.joint_type == JointType::kPrismatic &&
        !motors[static_cast<std::size_t>(body.v_index)] &&
        data.axis[static_cast<std::size_t>(body.v_index)].linear.z() > 0.999)
      return {body.q_index, body.v_index};
  }
  return {};
}

}  // namespace

VectorX settled(const Model& model, const SimulationOptions& options,
                const std::vector<char>& motors, const VectorX& q, Workspace& workspace) {
  VectorX out = q;
  const VectorX rest = VectorX::Zero(model.nv());
  Inverse inverse;
  SimulationOptions deep = options;
  deep.push_deep = true;  // else a body below the ground is pushed no more than one above it
  for (const Tree& tree : model.trees()) {
    const Lift lift = lift_of(model, tree, motors, q);
    if (lift.q < 0) continue;
    const Eigen::Index z = lift.q;
    // Missing vertical force [N], which increases with height.
    const auto missing = [&](double height) {
      out[z] = height;
      step_inverse(model, deep, out, rest, rest, workspace, inverse);
      return inverse.applied_force[lift.v];
    };
    double low = q[z] - kReach, high = q[z] + kReach;
    if (!(missing(low) < 0.0 && missing(high) > 0.0)) {
      out[z] = q[z];
      continue;
    }
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (low + high);
      (missing(middle) < 0.0 ? low : high) = middle;
    }
    out[z] = 0.5 * (low + high);
  }
  return out;
}

}  // namespace counterpoint::optimization
