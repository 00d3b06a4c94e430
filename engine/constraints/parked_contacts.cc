#include "counterpoint/engine/constraints/parked_contacts.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {
namespace {

/// Least end gap E [m], and the largest fraction of its design weight that a contact may give
/// there.
constexpr double kLeastEndGap = 1e-4, kNoWeight = 1e-9;
/// Fraction of resting_reach within which contacts have rows, and factor by which the closing speed
/// may grow within the step: a compromise of few rows and one step in ten solved again.
constexpr double kReachShare = 0.25, kSpeedUp = 2.0;

/// Returns E for the smoothing at the margin: parked contacts lie beyond the margin, or have hard
/// smoothing everywhere.
double end_gap(const ContactOptions& options) {
  const double smoothing = faded_smoothing(options.smoothing, options.margin, {options.margin});
  return std::max(kLeastEndGap, smoothing / kNoWeight);
}

/// Whether a contact approaches the onset of its force faster than `rate` [m/s], for the relative
/// velocity v and the squared relative angular velocity `turning` [(rad/s)^2]. The approach speed
/// is
///
///   sqrt((slip |v_T|)^2 + (spin |w|)^2) - v_N,
///
/// that of the convex law, which also replaces exact friction in softened steps. Squares are
/// compared, since a square root has a long latency.
bool closes_faster(const ParkedContact& contact, const Vector3& v, double turning, double rate) {
  const double normal = contact.candidate.normal.dot(v);
  const double tangential = std::max(v.squaredNorm() - normal * normal, 0.0);
  const double square =
      contact.slip * contact.slip * tangential + contact.spin * contact.spin * turning;
  const double root = rate + normal;
  return root < 0.0 || square > root * root;
}

/// Whether gap - turning > reach + time (closing speed) for every contact of a pair, at any point
/// between the two surfaces: both sides are linear in the gap.
bool exceeds(const FarPair& pair, double reach, double time, const std::vector<Motion>& V,
             const std::vector<Pose>& X_WB) {
  Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();
  const auto add = [&](int body, double sign) {
    if (body == 0) return;
    linear += sign * V[body].at(pair.middle - X_WB[body].translation);
    angular += sign * V[body].angular;
  };
  add(pair.body_a, -1.0);
  add(pair.body_b, 1.0);
  const double spin = angular.norm();
  const double closing =
      pair.slip * (linear.norm() + pair.surface + spin * pair.radius) + pair.spin * spin;
  const double slope = 1.0 - pair.turn_slope - time * pair.slip * spin;
  return slope > 0.0 && pair.gap * slope > reach + pair.turn + time * closing;
}

}  // namespace

double parking_gap(const ContactOptions& options, double h) {
  const bool fades = options.smoothing > kHardSmoothing;
  const double reach = fades ? options.margin : kReachShare * resting_reach(options, h);
  return std::max(2.0 * end_gap(options), reach);
}

ParkedContact by_law(ParkedContact contact, const PairConstraint& pair, double h) {
  contact.gap = h * pair.gap_bias;
  contact.slip = pair.law.rows > 1 ? pair.law.friction[0] : 0.0;
  contact.spin = 0.0;
  for (int i = 3; i < pair.law.rows; ++i)
    contact.spin = std::max(contact.spin, pair.law.friction[i - 1]);
  return contact;
}

bool is_near(const ParkedContact& contact, double parking_gap, double h) {
  if (contact.gap < parking_gap) return true;
  return closes_faster(contact, contact.velocity, 0.0,
                       (contact.gap - parking_gap) / (kSpeedUp * h));
}

bool is_reached(const ParkedContact& contact, const ContactOptions& options, double h,
                const std::vector<Motion>& V, const Kinematics& data) {
  const int a = contact.body_a, b = contact.body_b;
  Vector3 w = Vector3::Zero();
  if (contact.spin > 0.0 && a != 0) w -= V[a].angular;
  if (contact.spin > 0.0 && b != 0) w += V[b].angular;
  const Vector3 v =
      contact.surface + relative_velocity_at(contact.candidate.position, a, b, data, V);
  return closes_faster(contact, v, w.squaredNorm(), (contact.gap - end_gap(options)) / h);
}

double speed_beyond_onset(const PairConstraint& contact, const std::vector<Motion>& V,
                          const Kinematics& data) {
  const contact::Law& law = contact.law;
  if (law.coulomb || law.rows == 1) {
    const Vector3 v =
        relative_velocity_at(contact.position, contact.body_a, contact.body_b, data, V);
    return contact.frame.col(0).dot(v) + law.bias[0];
  }
  const contact::Rows y = relative_velocity(contact, data, V);
  double square = 0.0;
  for (int i = 1; i < law.rows; ++i) {
    const auto k = static_cast<size_t>(i);
    const double z = law.friction[k - 1] * (y[i] + law.bias[k]);
    square += z * z;
  }
  return y[0] + law.bias[0] - std::sqrt(square);
}

bool is_far(const FarPair& pair, double parking_gap, double h, const Kinematics& data) {
  return exceeds(pair, parking_gap, kSpeedUp * h, data.V, data.X_WB);
}

bool stays_far(const FarPair& pair, const ContactOptions& options, double h,
               const std::vector<Motion>& V, const Kinematics& data) {
  return exceeds(pair, end_gap(options), h, V, data.X_WB);
}

}  // namespace counterpoint
