#include "counterpoint/engine/derivatives/parameters/law_change.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/inverse.h"
#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {
namespace {

/// Derivative of kept_recovery in law_options.
double kept_recovery_change(const LawOptions& law, double h, const LawSource& source) {
  if (!(law.kept_recovery < law.max_recovery_speed)) return source.max_recovery_speed;
  return law.kept_share * source.max_recovery_speed +
         kKeptWeights * h * kStandardGravity * source.compliance;
}

/// Derivative of law_bias with these options at constant gap; kept: that of kept_recovery.
double law_bias_change(const LawOptions& law, double h, double gap, double kept,
                       const LawSource& source) {
  if (gap > 0.0) return 0.0;
  const double recovery = law.stabilization * gap / h, change = source.stabilization * gap / h;
  const double share = pushed_share(law, h, gap);
  // Here the bias is -kept share^2 = -kept^3 (kPushed / recovery)^2.
  if (share < 1.0)
    return share * share * (2.0 * law.kept_recovery * change / recovery - 3.0 * kept);
  return recovery < -law.kept_recovery ? -kept : change;
}

/// Derivatives of regularizer and smoothing of a constraint at a gap.
LawChange strength_change(const ContactOptions& contact, double alpha, double gap,
                          const Fading& fading, const LawSource& source) {
  LawChange out;
  out.regularizer = source.compliance * alpha + contact.compliance * source.alpha;
  const double length = faded_smoothing(contact.smoothing, gap, fading);
  const double share = faded_smoothing_share(contact.smoothing, gap, fading);
  out.smoothing =
      kStandardGravity / alpha * (share * source.smoothing - length * source.alpha / alpha);
  return out;
}

}  // namespace

LawChange contact_law_change(const LawOptions& law, double h, const ContactStart& start,
                             const LawSource& source) {
  const auto& [pair, alpha, gap, area, v, bounce, round] = start;
  LawChange out = strength_change(law, alpha, gap, law.fading(), source);
  if (!pair.is_soft())
    out.bias = law_bias_change(law, h, gap, kept_recovery_change(law, h, source), source);
  if (bounce.happens && (gap > 0.0 || -bounce.speed < law_bias(law, h, gap)))
    out.bias = -bounce.by_restitution * source.material.restitution - bounce.by_fall * source.fall;
  out.slip_speed = source.slip_speed;
  const Material& m = source.material;
  const double speed = std::hypot(v[1], v[2]);
  const SlidingFriction mu = sliding_friction(pair, speed);
  const double by = (1.0 - mu.by_static) * m.friction + mu.by_static * m.static_friction +
                    mu.by_stribeck_speed * m.stribeck_speed;
  if (pair.friction > 0.0 && law.friction_model == FrictionModel::kLagged) out.bias += by * speed;
  out.friction = {by, by, m.torsional_friction, m.rolling_friction, m.rolling_friction};
  return out;
}

LawChange limit_law_change(const SimulationOptions& options, double alpha,
                           const JointConstraint& row, const LawSource& source) {
  const double h = options.time_step;
  const LawOptions law = law_options(options);
  LawChange out = strength_change(options.contact, alpha, row.gap, {kLimitReach}, source);
  out.bias = law_bias_change(law, h, row.gap, kept_recovery_change(law, h, source), source);
  return out;
}

LawChange plain_law_change(const SimulationOptions& options, const contact::Law& law, double alpha,
                           const LawSource& source) {
  LawChange out = strength_change(options.contact, alpha, 0.0, {1.0}, source);
  // Equalities are softer by a constant factor, and have no smoothing.
  out.regularizer *= law.regularizer / (options.contact.compliance * alpha);
  if (law.type == contact::LawType::kEquality) out.smoothing = 0.0;
  return out;
}

contact::Rows impulse_change(const contact::Law& law, const contact::Rows& y,
                             const contact::Rows& dy, const LawChange& change) {
  const contact::Sensitivity by = contact::compute_sensitivity(law, y);
  contact::Rows moved = dy;
  moved[0] += change.bias;
  contact::Rows df = by.velocity.lazyProduct(moved);
  df += change.regularizer * by.regularizer + change.normal * by.normal +
        change.smoothing * by.smoothing + change.bound * by.bound +
        change.slip_speed * by.slip_speed;
  for (int j = 0; j + 1 < law.rows; ++j) df += change.friction[j] * by.friction.col(j);
  return df;
}

}  // namespace counterpoint
