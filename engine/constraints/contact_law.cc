#include "counterpoint/engine/constraints/contact_law.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace counterpoint {
namespace {

/// Returns the smoothing k [J] of a law from the smoothing length [m].
double smoothing(double length, double alpha) { return length * kStandardGravity / alpha; }

/// Whether the bounce determines the bias, rather than a faster recovery of an overlap.
bool rules(const Bounce& bounce, const LawOptions& options, double h, double gap) {
  return bounce.happens && (gap > 0.0 || -bounce.speed < law_bias(options, h, gap));
}

/// 1 - gap^2 / reach^2 for a positive gap, 0 beyond the reach, 1 for an overlap.
double left_at(double gap, double reach) {
  const double share = std::max(gap, 0.0) / reach;
  return share < 1.0 ? 1.0 - share * share : 0.0;
}

/// A part of the smoothing length [m] that fades up to a gap [m].
struct FadingPart {
  double length, end;
};

/// The parts of a smoothing length: that of open contacts, the rest of kHardSmoothing, the rest.
std::array<FadingPart, 3> parts_of(double smoothing, const Fading& fading) {
  const double open = std::min(smoothing, fading.open);
  const double hard = std::min(smoothing, kHardSmoothing);
  return {{{open, std::numeric_limits<double>::infinity()},
           {hard - open, kOpenGap},
           {smoothing - hard, fading.reach}}};
}

}  // namespace

double faded_smoothing(double smoothing, double gap, const Fading& fading) {
  if (!(gap > 0.0)) return smoothing;
  double sum = 0.0;
  for (const auto& [length, end] : parts_of(smoothing, fading)) {
    const double left = left_at(gap, end);
    sum += length * left * left;
  }
  return sum;
}

double faded_smoothing_slope(double smoothing, double gap, const Fading& fading) {
  if (!(gap > 0.0)) return 0.0;
  double sum = 0.0;
  for (const auto& [length, end] : parts_of(smoothing, fading))
    sum -= 4.0 * length * left_at(gap, end) * (gap / end) / end;
  return sum;
}

double faded_smoothing_share(double smoothing, double gap, const Fading& fading) {
  if (smoothing <= fading.open) return 1.0;
  const double left = left_at(gap, smoothing <= kHardSmoothing ? kOpenGap : fading.reach);
  return left * left;
}

double resting_reach(const ContactOptions& options, double h) {
  constexpr double kWeight = 1e-6;
  return std::min(options.margin,
                  std::max(options.reach_acceleration * h * h, options.smoothing / kWeight));
}

double gap_bias(const ContactOptions& options, double h, double gap) {
  if (gap > 0.0) return gap / h;
  return std::max(options.stabilization * gap / h, -options.max_recovery_speed);
}

LawOptions law_options(const SimulationOptions& options, bool wedged) {
  LawOptions law{options.contact};
  law.kept_recovery = law.max_recovery_speed;
  if (wedged && !options.push_deep) law.kept_share = 0.0;
  if (options.integrator == Integrator::kImplicitMidpoint) return law;
  law.open_smoothing = kOpenSmoothing;
  // At rest y = b = -r f: if the bias is limited below r f, a heavy load sinks.
  const double yields = law.compliance * options.time_step * kStandardGravity;
  law.kept_recovery = std::min(law.max_recovery_speed,
                               law.kept_share * law.max_recovery_speed + kKeptWeights * yields);
  if (law.kept_recovery < law.max_recovery_speed && !options.push_deep)
    law.full_push = kPushed * law.kept_recovery;
  return law;
}

double pushed_share(const LawOptions& options, double h, double gap) {
  const double all = -options.stabilization * gap / h;
  return all > options.full_push ? options.full_push / all : 1.0;
}

double law_bias(const LawOptions& options, double h, double gap) {
  const double share = pushed_share(options, h, gap);
  if (share < 1.0) return -share * share * options.kept_recovery;
  return std::max(gap_bias(options, h, gap), -options.kept_recovery);
}

double law_bias_slope(const LawOptions& options, double h, double gap) {
  const double share = pushed_share(options, h, gap);
  if (share < 1.0) return 2.0 * share * share * options.kept_recovery / gap;
  const bool capped = gap_bias(options, h, gap) < -options.kept_recovery;
  return capped ? 0.0 : gap_bias_slope(options, h, gap);
}

SoftNormal soft_normal(const Spring& spring, double h, double gap) {
  const double k = spring.stiffness, depth = std::max(-gap, 0.0);
  const double own = spring.damping + k * spring.dissipation * depth;
  const double total = std::hypot(own, h * k);
  const double by_gap = gap < 0.0 ? -own / total * k * spring.dissipation : 0.0;
  SoftNormal out;
  out.regularizer = 1.0 / (h * total);
  out.regularizer_by_gap = -out.regularizer * by_gap / total;
  out.bias = gap > 0.0 ? gap / h : k * gap / total;
  out.bias_by_gap = gap > 0.0 ? 1.0 / h : (k - out.bias * by_gap) / total;
  return out;
}

bool is_round(const Model& model, const Geometry& a, const Geometry& b) {
  constexpr double kCentered = 1e-9;
  const auto round = [&](const Geometry& g) {
    const Body& body = model.body(g.body);
    if (g.shape.type != ShapeType::kSphere || body.joint_type != JointType::kFloating) return false;
    const Tree& tree = model.trees()[static_cast<size_t>(body.tree)];
    return tree.body_end == tree.body_begin + 1 &&
           (g.X_BG.translation - body.inertia.center).norm() <= kCentered * g.shape.size[0];
  };
  return (a.body == 0 || round(a)) && (b.body == 0 || round(b));
}

namespace {

/// Limits the friction of a bounce to braking. It changes the energy by f_T (u + u+) / 2, with u
/// the sliding velocity before the impact: friction of full strength against u+ reverses a body's
/// own spin (Kane and Levinson 1985) and adds more energy than restitution leaves. f_T is therefore
/// limited to the disc of half the radius about -mu f_N u / (2 |u|): it reaches mu f_N against the
/// sliding direction and 0 along it. For two coefficients this holds of f_i / mu_i and mu_i u_i.
void brake_only(const Bounce& bounce, double approach, contact::Law& law) {
  // Sliding slower than this fraction of the approach speed is round-off and has no direction.
  constexpr double kNothing = 1e-9;
  const double ratio[2] = {1.0, law.friction[1] / law.friction[0]};
  const double slide[2] = {bounce.slide[0], ratio[1] * bounce.slide[1]};
  const double square = slide[0] * slide[0] + slide[1] * slide[1];
  const double share = square / (square + kNothing * kNothing * approach * approach);
  if (!(share > 0.0)) return;
  const double half = 0.5 * share * law.friction[0], speed = std::sqrt(square);
  for (size_t i = 0; i < 2; ++i) {
    law.lean[i] = ratio[i] * half * slide[i] / speed;
    law.friction[i] -= ratio[i] * half;
  }
}

}  // namespace

bool has_friction(const ContactOptions& options, double gap, bool meets) {
  return options.friction_model != FrictionModel::kCoulomb || gap <= options.margin || meets;
}

void set_contact_law(const LawOptions& options, double h, const ContactStart& start,
                     contact::Law& law) {
  const auto& [pair, alpha, gap, area, v, bounce, round] = start;
  const double mu = sliding_friction(pair, v.tail<2>().norm()).value;
  law.regularizer = options.compliance * alpha;
  law.smoothing = smoothing(faded_smoothing(options.smoothing, gap, options.fading()), alpha);
  law.bias[0] = law_bias(options, h, gap);
  const bool bounces = rules(bounce, options, h, gap);
  if (bounces) law.bias[0] = -bounce.speed;
  if (!bounces && gap > 0.0) law.bias[0] = std::max(law.bias[0], bounce.parting);
  if (pair.is_soft()) {
    const SoftNormal soft = soft_normal(pair.spring_of(area), h, gap);
    law.normal = soft.regularizer;
    law.bias[0] = soft.bias;
  }
  if (mu <= 0.0) return;
  // Beyond the margin only speed brought the contact in: where and how the bodies will meet is
  // known only roughly, and exact friction lets fast bodies tunnel. If they meet within the step,
  // judged from (q, w), the convex law keeps them h mu |v_T| apart for this step; if they do not,
  // there is nothing to rub yet, and the convex law would push bodies apart that only pass by.
  // Balls may use exact friction: it turns them, which changes no gap. A bounce leaves at e v,
  // which keeps the bodies apart. The convex law would demand e v of v_N - mu |v_T|, which may be a
  // tiny part of the speed of a link that turns about a nearby joint; its speed would become
  // hundreds of times e v.
  const bool near = gap <= options.margin, meets = gap + h * v[0] <= 0.0;
  if (!has_friction(options, gap, meets)) return;

  law.type = contact::LawType::kFrictionCone;
  law.rows = pair.rolling_friction > 0.0 ? 6 : pair.torsional_friction > 0.0 ? 4 : 3;
  const double across = pair.across_share();
  law.friction = {mu * std::max(across, 1.0), mu * std::min(across, 1.0), pair.torsional_friction,
                  pair.rolling_friction, pair.rolling_friction};
  switch (options.friction_model) {
    case FrictionModel::kConvex:
      break;
    case FrictionModel::kLagged:
      law.bias[0] += law.friction[0] * std::hypot(v[1], law.friction[1] / law.friction[0] * v[2]);
      break;
    case FrictionModel::kCoulomb:
      law.coulomb = near || bounces || (round && meets);
      if (bounces && !round) brake_only(bounce, v[0], law);
      break;
  }
}

double gap_bias_slope(const ContactOptions& options, double h, double gap) {
  if (gap > 0.0) return 1.0 / h;
  const bool capped = options.stabilization * gap / h < -options.max_recovery_speed;
  return capped ? 0.0 : options.stabilization / h;
}

LawSlopes contact_law_slopes(const LawOptions& options, double h, const ContactStart& start) {
  const auto& [pair, alpha, gap, area, v, bounce, round] = start;
  LawSlopes slopes;
  slopes.gap = law_bias_slope(options, h, gap);
  slopes.smoothing =
      smoothing(faded_smoothing_slope(options.smoothing, gap, options.fading()), alpha);
  if (rules(bounce, options, h, gap)) {
    slopes.gap = -bounce.by_gap;
    slopes.v[0] = -bounce.by_velocity;
    slopes.fall = -bounce.by_fall;
  }
  if (pair.is_soft()) {
    const SoftNormal soft = soft_normal(pair.spring_of(area), h, gap);
    slopes.gap = soft.bias_by_gap;
    slopes.softness = soft.regularizer_by_gap;
  }
  const double speed = std::hypot(v[1], v[2]);
  if (!(speed > 0.0)) return slopes;
  const SlidingFriction mu = sliding_friction(pair, speed);
  const double across = pair.across_share(), larger = std::max(across, 1.0);
  slopes.friction = larger * mu.by_speed / speed * Vector3(0.0, v[1], v[2]);
  if (options.friction_model != FrictionModel::kLagged) return slopes;
  const double ratio = std::min(across, 1.0) / larger, scaled = std::hypot(v[1], ratio * v[2]);
  slopes.v += larger * mu.value / scaled * Vector3(0.0, v[1], ratio * ratio * v[2]) +
              scaled * slopes.friction;
  return slopes;
}

contact::Law make_limit_law(const LawOptions& options, double h, double alpha, double gap) {
  contact::Law law;
  law.regularizer = options.compliance * alpha;
  law.smoothing = smoothing(faded_smoothing(options.smoothing, gap, {kLimitReach}), alpha);
  law.bias[0] = law_bias(options, h, gap);
  return law;
}

double limit_smoothing_slope(const ContactOptions& options, double alpha, double gap) {
  return smoothing(faded_smoothing_slope(options.smoothing, gap, {kLimitReach}), alpha);
}

contact::Law make_speed_limit_law(const ContactOptions& options, double alpha, double limit) {
  contact::Law law;
  law.regularizer = options.compliance * alpha;
  law.smoothing = smoothing(options.smoothing, alpha);
  law.bias[0] = limit;
  return law;
}

contact::Law make_dry_friction_law(const ContactOptions& options, double h, double alpha,
                                   double force) {
  contact::Law law;
  law.type = contact::LawType::kDryFriction;
  law.regularizer = options.compliance * alpha;
  law.smoothing = smoothing(options.smoothing, alpha);
  law.bound = h * force;
  return law;
}

void set_motor_law(double h, const MotorForce& motor, contact::Law& law) {
  const bool bounded = std::isfinite(motor.least);
  const bool given = !(motor.gain > 0.0);
  law.type = given || bounded ? contact::LawType::kDryFriction : contact::LawType::kSpring;
  if (given) {
    law.regularizer = 1.0;
    law.center = h * std::clamp(motor.force, motor.least, motor.most);
    return;
  }
  set_gain(h, motor.gain, motor.force, law);
  if (!bounded) return;
  law.center = 0.5 * h * (motor.least + motor.most);
  law.bound = 0.5 * h * (motor.most - motor.least);
  law.bias[0] += law.regularizer * law.center;
}

contact::Law make_mimic_law(const ContactOptions& options, double h, double alpha, double error) {
  contact::Law law;
  law.type = contact::LawType::kEquality;
  law.regularizer = kMimicSoftness * options.compliance * alpha;
  law.bias[0] = std::clamp(options.stabilization * error / h, -options.max_recovery_speed,
                           options.max_recovery_speed);
  return law;
}

contact::Law make_closure_law(const ContactOptions& options, double h, double alpha, int rows,
                              const Vector3& error, const Vector3& acceleration) {
  contact::Law law;
  law.type = contact::LawType::kEquality;
  law.rows = rows;
  law.regularizer = kClosureSoftness * options.compliance * alpha;
  Vector3 recovery = options.stabilization / h * error;
  const double speed = recovery.norm();
  if (speed > options.max_recovery_speed) recovery *= options.max_recovery_speed / speed;
  for (int i = 0; i < rows; ++i) law.bias[i] = recovery[i] + 0.5 * h * acceleration[i];
  return law;
}

void set_spring(double h, double c, double share, const Vector3& error, const Vector3& acceleration,
                contact::Law& law) {
  law.regularizer = 1.0 / (h * c);
  for (int i = 0; i < law.rows; ++i)
    law.bias[static_cast<size_t>(i)] = share * (error[i] / h + 0.5 * h * acceleration[i]);
}

void set_rope(double h, double alpha, double share, double gap, double acceleration,
              contact::Law& law) {
  law.type = contact::LawType::kUnilateral;
  law.smoothing = smoothing(kHardSmoothing, alpha);
  if (gap > 0.0) law.bias[0] = gap / h + 0.5 * share * h * acceleration;
}

}  // namespace counterpoint
