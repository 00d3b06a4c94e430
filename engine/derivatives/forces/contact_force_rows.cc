#include "counterpoint/engine/derivatives/forces/contact_force_rows.h"

#include "counterpoint/model/spatial.h"

namespace counterpoint {

void ContactForceRows::begin(const ContactForceDerivatives& wanted) {
  bodies_ = wanted.bodies;
  changes_.clear();
}

void ContactForceRows::add(const ForceByMotion& change) {
  // Contacts of the same two bodies follow one another.
  for (size_t i = changes_.size(); i-- > 0 && i + 4 >= changes_.size();) {
    ForceByMotion& last = changes_[i];
    if (last.row != change.row || last.by != change.by) continue;
    last.q += change.q;
    last.next += change.next;
    last.v += change.v;
    return;
  }
  changes_.push_back(change);
}

void ContactForceRows::add_pair(const Model& model, const PairConstraint& pair,
                                const PairBodies& bodies, const PairResponse& response, double h,
                                const Kinematics& data) {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    const int sign = (bodies_[i] == pair.body_b ? 1 : 0) - (bodies_[i] == pair.body_a ? 1 : 0);
    if (sign == 0) continue;
    const auto add_by = [&](int by, const BodyResponse& of, double scale) {
      if (by == 0) return;
      const Tree& tree = model.trees()[model.body(by).tree];
      const Matrix3 arm = skew(pair.position - TreeSweep::reference(tree, data));
      ForceByMotion change{3 * static_cast<int>(i), by, scale * of.q.bottomRows<3>(),
                           scale * of.next.bottomRows<3>(), scale * of.v.bottomRows<3>()};
      for (ForceByMotion::Rows* K : {&change.q, &change.next, &change.v})
        K->leftCols<3>() -= K->rightCols<3>() * arm;
      add(change);
    };
    add_by(pair.body_b, response.of_a_by_b(bodies.next_b, bodies.start_b), -sign / h);
    add_by(pair.body_a, response.of_b_by_a(bodies.next_b, bodies.start_b), sign / h);
  }
}

void ContactForceRows::add_by_speed(std::span<const ForceBySpeed> forces, const SpeedByMotion& a,
                                    const SpeedByMotion& b) {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    for (const ForceBySpeed& f : forces) {
      // The force on the world is minus the sum of those on all bodies.
      const double sign = bodies_[i] == 0 ? 1.0 : f.body == bodies_[i] ? -1.0 : 0.0;
      for (const SpeedByMotion& motion : {a, b})
        if (sign != 0.0 && motion.body != 0)
          add({3 * static_cast<int>(i), motion.body,
               sign * f.force.tail<3>() * motion.q.transpose(), ForceByMotion::Rows::Zero(),
               sign * f.force.tail<3>() * motion.v.transpose()});
    }
  }
}

void ContactForceRows::write(const Model& model, const SweepInput& in, TreeSweep& sweep,
                             ContactForceDerivatives& out) const {
  for (MatrixX* m : {&out.dq, &out.dv, &out.dv_next})
    m->setZero(3 * static_cast<Eigen::Index>(bodies_.size()), model.nv());
  if (changes_.empty()) return;
  for (const Tree& tree : model.trees()) sweep.find_response_columns(model, tree, in);
  for (const ForceByMotion& change : changes_)
    sweep.add_force_rows(model, change, {out.dq, out.dv, out.dv_next});
}

}  // namespace counterpoint
