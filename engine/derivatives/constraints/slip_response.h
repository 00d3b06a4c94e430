// How friction changes with the slip speed that its island's motion allows (friction_slip.h).
//
//   v_slip = (h / slip_time) |u|,   u the sliding velocity of the island's fastest contact
//
// so that all friction of an island depends on how two bodies moved at the start of the step.
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
  /// The friction of a contact of a step of h [s], of which `share` counts; V_next: the bodies'
  /// velocities at its end.
  void add(const Model& model, const PairConstraint& pair, const std::vector<Motion>& V_next,
           double h, const Kinematics& data, double share = 1.0);

  /// What wrenches on bodies change by, -dW / d|u|, as the bodies of contact `source` move: those
  /// of `from` on, up to the next source's.
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
  std::vector<int> force_of_;  ///< by body: its last one, or -1
};

/// How a contact slides at the start of the step.
struct Sliding {
  Motion start;                         ///< of B against A at the place
  Vector3 direction = Vector3::Zero();  ///< in W; zero where it does not slide
  Sliding(const PairConstraint& pair, const PairBodies& bodies);
  /// What |u| changes by as the place moves and the normal turns.
  template <class Place, class Turn>
  auto by_place(const Place& place, const Turn& turn) const {
    return (direction.transpose() * (skew(start.angular) * place + skew(start.linear) * turn))
        .eval();
  }
};

/// |u|, how fast a contact slides at the start of the step, by the motion of its two bodies: rows
/// over (angular, linear) at its place.
struct SpeedSlope {
  using Row = Eigen::Matrix<double, 1, 6>;
  Row q;         ///< by B's displacement; by A's: the opposite
  Row v_a, v_b;  ///< by the velocities
};
SpeedSlope speed_slope(const PairConstraint& pair, const PairBodies& bodies,
                       const ContactMotion& motion);

}  // namespace counterpoint
