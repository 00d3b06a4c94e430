#include "counterpoint/engine/constraints/parked_contacts.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {
namespace {

/// The least end gap E [m], and the share of its weight that a contact gives there at most.
constexpr double kLeastEndGap = 1e-4, kNoWeight = 1e-9;
/// The share of what rests may reach (contact_law.h) within which contacts have rows, and how much
/// faster than now a contact may close: few enough rows, and a step in ten solved again.
constexpr double kReachShare = 0.25, kSpeedUp = 2.0;

/// Of laws as smooth as they are at the margin: contacts that are parked lie beyond it, or their
/// smoothing is hard everywhere.
double end_gap(const ContactOptions& options) {
  const double smoothing = faded_smoothing(options.smoothing, options.margin, options.margin);
  return std::max(kLeastEndGap, smoothing / kNoWeight);
}

/// How fast a contact comes closer to giving force [m/s]: as in the convex law, which is that of
/// exact friction too where it is softened. Of y so many rows are known.
double closing_speed(const PairConstraint& contact, const double* y, int rows) {
  double square = 0.0;
  for (int i = 1; i < std::min(contact.law.rows, rows); ++i) {
    const double z = contact.law.friction[i - 1] * y[i];
    square += z * z;
  }
  return std::sqrt(square) - y[0];
}

/// Whether gap - turning > reach + time (closing speed) of every contact of a pair, whatever its
/// place, which is between the two surfaces: both sides are linear in the gap.
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
  const double closing = pair.slip * (linear.norm() + spin * pair.radius) + pair.spin * spin;
  const double slope = 1.0 - pair.turn_slope - time * pair.slip * spin;
  return slope > 0.0 && pair.gap * slope > reach + pair.turn + time * closing;
}

/// Before the closures, which come behind the contacts.
void give_rows(const ParkedContact& parked, ConstraintSet& out) {
  out.pairs.insert(out.pairs.begin() + static_cast<std::ptrdiff_t>(out.contacts.size()),
                   parked.pair);
  out.contacts.push_back(parked.candidate);
}

}  // namespace

double parking_gap(const ContactOptions& options, double h) {
  const bool fades = options.smoothing > kHardSmoothing;
  const double reach = fades ? options.margin : kReachShare * resting_reach(options, h);
  return std::max(2.0 * end_gap(options), reach);
}

bool is_near(const PairConstraint& contact, const Vector3& v, double parking_gap, double h) {
  const double gap = h * contact.gap_bias;
  return gap < parking_gap ||
         gap < parking_gap + kSpeedUp * h * std::max(0.0, closing_speed(contact, v.data(), 3));
}

bool find_overrun_contacts(const ContactOptions& options, double h, const Data& data,
                           const std::vector<Motion>& V, ConstraintSet& out) {
  const double end = end_gap(options) / h;
  auto kept = out.parked.begin();
  for (ParkedContact& parked : out.parked) {
    const contact::Rows y = relative_velocity(parked.pair, data, V);
    const int rows = static_cast<int>(y.size());
    if (parked.pair.gap_bias - closing_speed(parked.pair, y.data(), rows) < end) {
      give_rows(parked, out);
    } else {
      if (&*kept != &parked) *kept = parked;
      ++kept;
    }
  }
  const bool found = kept != out.parked.end();
  out.parked.erase(kept, out.parked.end());
  return found;
}

bool is_far(const FarPair& pair, double parking_gap, double h, const Data& data) {
  return exceeds(pair, parking_gap, kSpeedUp * h, data.V, data.X_WB);
}

bool stays_far(const FarPair& pair, const ContactOptions& options, double h,
               const std::vector<Motion>& V, const Data& data) {
  return exceeds(pair, end_gap(options), h, V, data.X_WB);
}

void give_all_rows(ConstraintSet& out) {
  for (const ParkedContact& parked : out.parked) give_rows(parked, out);
  out.parked.clear();
}

}  // namespace counterpoint
