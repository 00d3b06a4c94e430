#include "counterpoint/engine/constraints/velocity_limits.h"

#include <cmath>

#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {

/// Fraction of the limit from which on there is a row.
constexpr double kNear = 0.5;

std::vector<SpeedLimit> list_speed_limits(const Model& model) {
  std::vector<SpeedLimit> limits;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const double limit = model.joint(i - 1).velocity_limit;
    if (!std::isfinite(limit)) continue;
    for (int k = 0; k < joint_nv(body.joint_type); ++k)
      limits.push_back({body.v_index + k, i, limit});
  }
  return limits;
}

void find_velocity_limits(const SimulationOptions& options, const std::vector<SpeedLimit>& limits,
                          const VectorRef& v, const InverseWeights& weights, SleepMask idle,
                          ConstraintSet& out) {
  for (const SpeedLimit& limit : limits) {
    if (idle(limit.body)) continue;
    const double speed = v[limit.v_index];
    if (!(std::abs(speed) > kNear * limit.limit)) continue;
    JointConstraint row;
    row.effect = Effect::kVelocityLimits;
    row.law = make_speed_limit_law(options.contact, weights.dof[limit.v_index], limit.limit);
    row.v_index[0] = limit.v_index;
    row.coefficient[0] = speed > 0.0 ? -1.0 : 1.0;
    out.joints.push_back(row);
  }
}

}  // namespace counterpoint
