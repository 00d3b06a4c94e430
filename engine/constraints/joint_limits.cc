#include "counterpoint/engine/constraints/joint_limits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

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

/// A limit, with y = sum of coefficient w over its terms the rate at which its gap grows.
struct Side {
  std::array<RowTerm, 3> terms;
  size_t num_terms = 1;
  double gap = 0.0;  ///< [rad or m]

  std::span<const RowTerm> row() const { return {terms.data(), num_terms}; }
  bool is_ball() const { return num_terms == 3; }
};

/// The limit of a ball joint: of the angle of its rotation vector, along whose direction u the rate
/// of the angle is u . w; w stands for u where the joint is not turned.
Side ball_side(const LimitedCoordinate& at, const VectorRef& q, const VectorRef& v) {
  const auto turn = q.segment<4>(at.q_index);
  Vector3 u = quaternion_log(Quaternion(turn[0], turn[1], turn[2], turn[3]));
  const double angle = u.norm();
  if (!(angle > 0.0)) u = v.segment<3>(at.v_index);
  u.stableNormalize();
  Side side;
  for (int k = 0; k < 3; ++k) side.terms[static_cast<size_t>(k)] = {at.v_index + k, -u[k]};
  side.num_terms = 3;
  side.gap = at.upper - angle;
  return side;
}

/// Gap below which a limit has a row at the velocity v (nv) at the start of a step of h [s].
struct NearGap {
  const VectorRef& v;
  double h;
  double of_speed(double speed) const { return kMargin + 2.0 * h * speed; }
  double operator()(int v_index, double) const { return of_speed(std::abs(v[v_index])); }
  double operator()(const Side& ball) const {
    return of_speed(v.segment<3>(ball.terms[0].v_index).norm());
  }
  double of(const Side& side) const {
    return side.is_ball() ? (*this)(side) : (*this)(side.terms[0].v_index, 0.0);
  }
};

/// Gap at the start below which a limit is reached at the velocity w (nv) at the end.
struct OverrunGap {
  const VectorRef& w;
  double h;
  double operator()(int v_index, double sign) const { return kEndMargin - h * sign * w[v_index]; }
  double operator()(const Side& ball) const { return kEndMargin - h * row_velocity(ball.row(), w); }
};

/// Calls visit(side) for the limits that are not idle and whose gaps at the start of the step are
/// below reach(v_index, sign), of balls reach(side).
template <class Reach, class Visit>
void for_each_side(const std::vector<LimitedCoordinate>& limited, const StepContext& at,
                   SleepMask idle, const Reach& reach, Visit visit) {
  for (const LimitedCoordinate& one : limited) {
    if (one.ball) {
      const Side side = ball_side(one, at.q, at.v);
      if (side.gap < reach(side) && !idle(one.body)) visit(side);
      continue;
    }
    const double above = at.q[one.q_index] - one.lower, below = one.upper - at.q[one.q_index];
    const bool low = above < reach(one.v_index, 1.0), high = below < reach(one.v_index, -1.0);
    if (!(low | high) || idle(one.body)) continue;  // nearly always
    if (low) visit(Side{{RowTerm{one.v_index, 1.0}}, 1, above});
    if (high) visit(Side{{RowTerm{one.v_index, -1.0}}, 1, below});
  }
}

void add_row(const Side& side, const SimulationOptions& options, const InverseWeights& weights,
             ConstraintSet& out) {
  const double h = options.time_step;
  double alpha = 0.0;
  for (const RowTerm& term : side.row())
    alpha += term.coefficient * term.coefficient * weights.dof[term.v_index];
  JointConstraint row;
  row.effect = Effect::kLimits;
  row.law = make_limit_law(law_options(options), h, alpha, side.gap);
  row.gap = side.gap;
  row.gap_bias = gap_bias(options.contact, h, side.gap);
  out.add(row, side.row());
}

}  // namespace

std::vector<LimitedCoordinate> list_limited_coordinates(const Model& model) {
  std::vector<LimitedCoordinate> limited;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const JointInfo& joint = model.joint(i - 1);
    const bool ball = body.joint_type == JointType::kSpherical;
    if (!joint.prescribed && (std::isfinite(joint.lower) || std::isfinite(joint.upper)))
      limited.push_back({body.q_index, body.v_index, i, joint.lower, joint.upper, ball});
  }
  return limited;
}

void find_joint_limits(const StepContext& at, const std::vector<LimitedCoordinate>& limited,
                       const InverseWeights& weights, SleepMask idle, ConstraintSet& out) {
  for_each_side(limited, at, idle, NearGap{at.v, at.h()},
                [&](const Side& side) { add_row(side, at.options, weights, out); });
}

bool find_overrun_limits(const StepContext& at, const std::vector<LimitedCoordinate>& limited,
                         const VectorRef& w, const InverseWeights& weights, SleepMask idle,
                         ConstraintSet& out) {
  const NearGap near{at.v, at.h()};
  bool found = false;
  for_each_side(limited, at, idle, OverrunGap{w, at.h()}, [&](const Side& side) {
    if (side.gap < near.of(side)) return;
    // Rows of an earlier call are among the last; rows of limits have a gap bias.
    const auto same = [&](const JointConstraint& row) {
      if (row.effect != Effect::kLimits || std::isnan(row.gap_bias)) return false;
      const RowTerm& term = out.terms(row)[0];
      return term.v_index == side.terms[0].v_index &&
             (side.is_ball() || term.coefficient == side.terms[0].coefficient);
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
