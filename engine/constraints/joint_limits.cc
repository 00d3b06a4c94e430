#include "counterpoint/engine/constraints/joint_limits.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {
namespace {

/// Gap [rad or m] below which a limit has a row, at rest.
constexpr double kMargin = kLimitReach;
/// Gap at the end of the step below which a limit without a row gets one. It is positive, so that
/// rounding cannot make forward and inverse differ: a limit so far off gives no force (its
/// smoothing is 1e-13).
constexpr double kEndMargin = 0.5 * kMargin;

/// Fraction of a speed limit from which on there is a row.
constexpr double kNearSpeed = 0.5;

/// One side of a limited coordinate; sign: direction of increasing gap.
struct Side {
  int v_index = 0;
  double gap = 0.0;  ///< [rad or m]
  double sign = 1.0;
};

/// Calls visit(side) for the sides of limited coordinates that are not idle and whose gaps are
/// below reach(v_index, sign).
template <class Reach, class Visit>
void for_each_side(const std::vector<LimitedCoordinate>& limited, const VectorRef& q,
                   SleepMask idle, Reach reach, Visit visit) {
  for (const LimitedCoordinate& at : limited) {
    const double above = q[at.q_index] - at.lower, below = at.upper - q[at.q_index];
    const bool low = above < reach(at.v_index, 1.0), high = below < reach(at.v_index, -1.0);
    if (!(low | high) || idle(at.body)) continue;  // nearly always
    if (low) visit(Side{at.v_index, above, 1.0});
    if (high) visit(Side{at.v_index, below, -1.0});
  }
}

double near_gap(double v, double h) { return kMargin + 2.0 * h * std::abs(v); }

void add_row(const Side& side, const SimulationOptions& options, const InverseWeights& weights,
             ConstraintSet& out) {
  const double h = options.time_step;
  const double alpha = weights.dof[side.v_index];
  JointConstraint row;
  row.effect = Effect::kLimits;
  row.law = make_limit_law(law_options(options), h, alpha, side.gap);
  row.gap = side.gap;
  row.gap_bias = gap_bias(options.contact, h, side.gap);
  out.add(row, {{side.v_index, side.sign}});
}

}  // namespace

std::vector<LimitedCoordinate> list_limited_coordinates(const Model& model) {
  std::vector<LimitedCoordinate> limited;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const JointInfo& joint = model.joint(i - 1);
    if (!joint.prescribed && (std::isfinite(joint.lower) || std::isfinite(joint.upper)))
      limited.push_back({body.q_index, body.v_index, i, joint.lower, joint.upper});
  }
  return limited;
}

void find_joint_limits(const StepContext& at, const std::vector<LimitedCoordinate>& limited,
                       const InverseWeights& weights, SleepMask idle, ConstraintSet& out) {
  const auto near = [&](int i, double) { return near_gap(at.v[i], at.h()); };
  for_each_side(limited, at.q, idle, near,
                [&](const Side& side) { add_row(side, at.options, weights, out); });
}

bool find_overrun_limits(const StepContext& at, const std::vector<LimitedCoordinate>& limited,
                         const VectorRef& w, const InverseWeights& weights, SleepMask idle,
                         ConstraintSet& out) {
  const double h = at.h();
  bool found = false;
  const auto overrun = [&](int i, double sign) { return kEndMargin - h * sign * w[i]; };
  for_each_side(limited, at.q, idle, overrun, [&](const Side& side) {
    if (side.gap < near_gap(at.v[side.v_index], h)) return;
    // Rows of an earlier call are among the last; rows of limits have a gap bias.
    const auto same = [&](const JointConstraint& row) {
      if (row.effect != Effect::kLimits || std::isnan(row.gap_bias)) return false;
      const RowTerm& term = out.terms(row)[0];
      return term.v_index == side.v_index && term.coefficient == side.sign;
    };
    if (std::any_of(out.joints.rbegin(), out.joints.rend(), same)) return;
    add_row(side, at.options, weights, out);
    found = true;
  });
  return found;
}

std::vector<SpeedLimit> list_speed_limits(const Model& model) {
  std::vector<SpeedLimit> limits;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const double limit = model.joint(i - 1).velocity_limit;
    if (!std::isfinite(limit) || model.joint(i - 1).prescribed) continue;
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
    if (!(std::abs(speed) > kNearSpeed * limit.limit)) continue;
    JointConstraint row;
    row.effect = Effect::kVelocityLimits;
    row.law = make_speed_limit_law(options.contact, weights.dof[limit.v_index], limit.limit);
    out.add(row, {{limit.v_index, speed > 0.0 ? -1.0 : 1.0}});
  }
}

}  // namespace counterpoint
