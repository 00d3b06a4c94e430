#include "counterpoint/engine/derivatives/slip_response.h"

#include <algorithm>

#include "counterpoint/contact/sensitivity.h"
#include "counterpoint/engine/derivatives/sweep.h"
#include "counterpoint/model/rotation.h"

namespace counterpoint {

void SlipResponse::begin() {
  for (const Entry& entry : entries_) entry_of_[entry.body] = -1;
  entries_.clear();
}

void SlipResponse::add(const Model& model, int body, int source, const Vector3& place,
                       const Vector3& force, const Vector3& torque, const Data& data) {
  const Tree& tree = model.trees()[model.body(body).tree];
  Vector6 wrench;
  wrench << torque + (place - TreeSweep::reference(tree, data)).cross(force), force;
  int& at = entry_of_[body];
  if (at < 0 || entries_[at].source != source) {
    at = static_cast<int>(entries_.size());
    entries_.push_back({body, source, Vector6::Zero()});
  }
  entries_[at].by_speed -= wrench;
}

void SlipResponse::add(const Model& model, const PairConstraint& pair, const PairBodies& bodies,
                       double h, const Data& data) {
  if (pair.fastest < 0 || !(pair.law.slip_speed > 0.0)) return;
  const int rows = pair.law.rows;
  const Vector3 v = pair.frame.transpose() * (bodies.next_b.linear - bodies.next_a.linear);
  const Vector3 w = pair.frame.transpose() * (bodies.next_b.angular - bodies.next_a.angular);
  contact::Rows y(rows);
  for (int i = 0; i < rows; ++i)
    y[i] = (i < 3 ? v[i] : w[i - 3]) + pair.law.bias[static_cast<size_t>(i)];
  const contact::Rows f = contact::slip_speed_derivative(pair.law, y) / h;
  Vector3 force = Vector3::Zero(), torque = Vector3::Zero();
  for (int i = 0; i < rows; ++i) (i < 3 ? force : torque) += f[i] * pair.frame.col(i % 3);
  if (pair.body_b != 0) add(model, pair.body_b, pair.fastest, pair.position, force, torque, data);
  if (pair.body_a != 0) add(model, pair.body_a, pair.fastest, pair.position, -force, -torque, data);
}

SpeedSlope speed_slope(const PairConstraint& pair, const PairBodies& bodies,
                       const ContactMotion& motion) {
  using Row = SpeedSlope::Row;
  const Motion start = bodies.start_b - bodies.start_a;
  const Vector3 n = pair.frame.col(0);
  const Vector3 sliding = start.linear - n.dot(start.linear) * n;
  const double speed = sliding.norm();
  if (!(speed > 0.0)) return {Row::Zero(), Row::Zero(), Row::Zero()};  // one side of a kink
  const Eigen::RowVector3d along = sliding.transpose() / speed;
  const auto by_place = [&](const PlaceMotion& place) -> Row {
    return along *
           (skew(start.angular) * place.point + skew(start.linear) * (skew(n) * place.normal));
  };
  SpeedSlope out{by_place(motion), Row::Zero(), Row::Zero()};
  out.v_b.tail<3>() = along;
  out.v_a.tail<3>() = -along;
  if (motion.by_v) {
    out.v_b += by_place(motion.v_b);
    out.v_a += by_place(motion.v_a);
  }
  out.q -= out.v_b * motion_cross(bodies.start_b);
  return out;
}

}  // namespace counterpoint
