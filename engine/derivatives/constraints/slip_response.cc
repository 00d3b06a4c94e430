#include "counterpoint/engine/derivatives/constraints/slip_response.h"

#include "counterpoint/contact/inverse.h"
#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {

void SlipResponse::begin() {
  for (const ForceBySpeed& f : forces_) force_of_[f.body] = -1;
  forces_.clear();
  sources_.clear();
}

void SlipResponse::add(const Model& model, int body, int source, const Vector3& place,
                       const Force& by_speed, const Kinematics& data) {
  if (body == 0) return;
  const Tree& tree = model.trees()[model.body(body).tree];
  const Force there = shift(by_speed, place - TreeSweep::reference(tree, data));
  if (sources_.empty() || sources_.back().contact != source)
    sources_.push_back({source, forces_.size()});
  int& at = force_of_[body];
  if (at < static_cast<int>(sources_.back().from)) {
    at = static_cast<int>(forces_.size());
    forces_.push_back({body, Vector6::Zero()});
  }
  forces_[at].force.head<3>() -= there.torque;
  forces_[at].force.tail<3>() -= there.force;
}

void SlipResponse::add(const Model& model, const PairConstraint& pair,
                       const std::vector<Motion>& V_next, double h, const Kinematics& data,
                       double share) {
  if (pair.fastest_contact < 0 || !(pair.law.slip_speed > 0.0)) return;
  contact::Rows y = relative_velocity(pair, data, V_next);
  for (int i = 0; i < pair.law.rows; ++i) y[i] += pair.law.bias[static_cast<size_t>(i)];
  const Force force = pair_impulse(pair, contact::slip_speed_derivative(pair.law, y)) * (share / h);
  add(model, pair.body_b, pair.fastest_contact, pair.position, force, data);
  add(model, pair.body_a, pair.fastest_contact, pair.position, force * -1.0, data);
}

Sliding::Sliding(const PairConstraint& pair, const PairBodies& bodies)
    : start(bodies.start_b - bodies.start_a) {
  const Vector3 n = pair.frame.col(0);
  const Vector3 sliding = start.linear - n.dot(start.linear) * n;
  const double speed = sliding.norm();
  if (speed > 0.0) direction = sliding / speed;  // zero at the kink |u| = 0
}

SpeedSlope speed_slope(const PairConstraint& pair, const PairBodies& bodies,
                       const ContactMotion& motion) {
  const Sliding sliding(pair, bodies);
  const Matrix3 turn = skew(Vector3(pair.frame.col(0)));
  const auto by_place = [&](const PlaceMotion& place) -> SpeedSlope::Row {
    return sliding.by_place(place.point, turn * place.normal);
  };
  SpeedSlope out{by_place(motion), SpeedSlope::Row::Zero(), SpeedSlope::Row::Zero()};
  out.v_b.tail<3>() = sliding.direction;
  out.v_a.tail<3>() = -sliding.direction;
  if (motion.by_v) {
    out.v_b += by_place(motion.v_b);
    out.v_a += by_place(motion.v_a);
  }
  out.q -= out.v_b * motion_cross(bodies.start_b);
  return out;
}

}  // namespace counterpoint
