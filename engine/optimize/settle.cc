#include "counterpoint/engine/optimize/settle.h"

namespace counterpoint::optimization {
namespace {

/// How far a tree may be from where it stands [m].
constexpr double kReach = 0.5;
constexpr int kHalvings = 60;

}  // namespace

VectorX settled(const Model& model, const SimulationOptions& options, const VectorX& q,
                Workspace& workspace) {
  VectorX out = q;
  const VectorX rest = VectorX::Zero(model.nv());
  Inverse inverse;
  for (const Tree& tree : model.trees()) {
    const Body& base = model.body(tree.body_begin);
    if (base.joint_type != JointType::kFloating) continue;
    const Eigen::Index z = base.q_index + 2;
    // Force that is missing along z: it rises with the height.
    const auto missing = [&](double height) {
      out[z] = height;
      step_inverse(model, options, out, rest, rest, workspace, inverse);
      return inverse.applied_force[base.v_index + 2];
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
