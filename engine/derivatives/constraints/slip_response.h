// Derivatives of friction by the slip speed that the motion of its island allows (friction_slip.h).
//
//   v_slip = (h / slip_time) |u|,   u the sliding velocity of the island's fastest contact
//
// All friction of an island depends on how the two bodies of that contact moved at the start.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/engine/derivatives/constraints/pair_response.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {

class SlipResponse {
 public:
  explicit SlipResponse(const Model& model) : force_of_(model.num_bodies(), -1) {
    forces_.reserve(force_of_.size());
  }

  void begin();
  /// Adds the friction of a contact in a step of h [s], of which `share` counts. V_next: velocities
  /// of the bodies at the end of the step.
  void add(const Model& model, const PairConstraint& pair, const std::vector<Motion>& V_next,
           double h, const Kinematics& data, double share = 1.0);

  /// Wrench derivatives -dW / d|u|, |u| the sliding speed of contact `contact`: the entries from
  /// `from` up to the next source's.
  struct Source {
    int contact;
    size_t from;
  };
  const std::vector<Source>& sources() const { return sources_; }
  std::span<const ForceBySpeed> forces(size_t source) const {
    const size_t from = sources_[source].from;
    const size_t end = source + 1 < sources_.size() ? sources_[source + 1].from : forces_.size();
    return std::span(forces_).subspan(from, end - from);
  }

 private:
  void add(const Model& model, int body, int source, const Vector3& place, const Force& by_speed,
           const Kinematics& data);

  std::vector<Source> sources_;
  std::vector<ForceBySpeed> forces_;
  std::vector<int> force_of_;  ///< per body: its last entry in forces_, or -1
};

/// Sliding of a contact at the start of the step.
struct Sliding {
  Motion start;                         ///< velocity of B relative to A at the place
  Vector3 direction = Vector3::Zero();  ///< unit vector in W; zero if the contact does not slide
  Sliding(const PairConstraint& pair, const PairBodies& bodies);
  /// Returns the change of |u| as the place moves and the frame rotates.
  template <class Place, class Turn>
  auto by_place(const Place& place, const Turn& turn) const {
    return (direction.transpose() * (skew(start.angular) * place + skew(start.linear) * turn))
        .eval();
  }
};

/// Derivatives of |u|, the sliding speed of a contact at the start of the step, by the motion of
/// its two bodies: rows over (angular, linear) at its place.
struct SpeedSlope {
  using Row = Eigen::Matrix<double, 1, 6>;
  Row q;         ///< displacement of B; that of A gives the opposite
  Row v_a, v_b;  ///< velocities of A and B
};
SpeedSlope speed_slope(const PairConstraint& pair, const PairBodies& bodies,
                       const ContactMotion& motion);

}  // namespace counterpoint
