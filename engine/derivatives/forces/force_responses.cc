#include "counterpoint/engine/derivatives/forces/force_responses.h"

#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

void scale(BodyResponse& response, double by) {
  response.q *= by;
  response.next *= by;
  response.v *= by;
}

}  // namespace

PairResponse body_force(const Force& force) {
  PairResponse out;
  out.wrench = force;
  out.next.setZero();
  out.v_a.setZero();
  out.v_b.setZero();
  out.still.setZero();
  // The point moves with the body, the force keeps its axes.
  out.still.topRightCorner<3, 3>() = -skew(force.force);
  return out;
}

ForceResponses::ForceResponses(const Model& model)
    : load_(model.num_bodies()), response_(model.num_bodies()), responds_(model.num_bodies(), 0) {}

void ForceResponses::begin() {
  for (size_t i = 0; i < load_.size(); ++i) {
    load_[i] = Force();
    responds_[i] = 0;
  }
  couplings_.clear();
  inner_.clear();
  speed_forces_.clear();
  speeds_.clear();
  by_v_ = false;
}

void ForceResponses::add_force(const Model& model, int body, const Vector3& place,
                               const Force& force, BodyResponse response, const Kinematics& data) {
  const Tree& tree = model.trees()[model.body(body).tree];
  load_[body] += shift(force, place - data.X_WB[body].translation);
  response.move(place - TreeSweep::reference(tree, data));
  if (responds_[body]) {
    response_[body] += response;
  } else {
    response_[body] = response;
    responds_[body] = 1;
  }
}

void ForceResponses::add_body_force(const Model& model, int body, const Vector3& place,
                                    const PairResponse& response, const Motion& V_next,
                                    const Motion& V_start, const Kinematics& data) {
  by_v_ = by_v_ || response.by_v;
  BodyResponse minus = response.of_b(V_next, V_start);
  scale(minus, -1.0);
  add_force(model, body, place, response.wrench, minus, data);
}

void ForceResponses::couple(const Model& model, const PairConstraint& pair, int body, int by,
                            BodyResponse response, const Kinematics& data) {
  const auto arm = [&](int b) -> Vector3 {
    return pair.position - TreeSweep::reference(model.trees()[model.body(b).tree], data);
  };
  const Matrix3 rows = skew(arm(body)), columns = skew(arm(by));
  for (Matrix6* K : {&response.q, &response.next, &response.v}) {
    K->leftCols<3>() -= K->rightCols<3>() * columns;
    K->topRows<3>() += rows * K->bottomRows<3>();
  }
  // Contacts of the same two bodies follow one another.
  for (size_t i = couplings_.size(); i-- > 0 && i + 2 >= couplings_.size();) {
    if (couplings_[i].body != body || couplings_[i].by != by) continue;
    couplings_[i].response += response;
    return;
  }
  couplings_.push_back({body, by, response});
}

/// Adds a pair of bodies of one tree.
void ForceResponses::add_inner(const Model& model, const PairConstraint& pair,
                               const PairBodies& bodies, const PairResponse& response, double h,
                               const Kinematics& data) {
  const Tree& tree = model.trees()[model.body(pair.body_a).tree];
  const Matrix3 arm = skew(pair.position - TreeSweep::reference(tree, data));
  InnerPair inner{pair.body_a,
                  pair.body_b,
                  response.by_v,
                  response.displaced(bodies.next_b, bodies.start_b),
                  carried(response.wrench),
                  response.next,
                  response.v_a,
                  response.v_b};
  for (Matrix6* K : {&inner.displaced, &inner.carried, &inner.next, &inner.v_a, &inner.v_b}) {
    K->leftCols<3>() -= K->rightCols<3>() * arm;
    K->topRows<3>() += arm * K->bottomRows<3>();
    *K *= 1.0 / h;
  }
  if (!inner_.empty() && inner_.back().body_a == inner.body_a &&
      inner_.back().body_b == inner.body_b) {
    inner_.back() += inner;
  } else {
    inner_.push_back(inner);
  }
}

void ForceResponses::add_pair(const Model& model, const PairConstraint& pair,
                              const PairBodies& bodies, const PairResponse& response, double h,
                              const Kinematics& data) {
  by_v_ = by_v_ || response.by_v;
  if (pair.body_a != 0 && pair.body_b != 0 &&
      model.body(pair.body_a).tree == model.body(pair.body_b).tree)
    return add_inner(model, pair, bodies, response, h, data);
  const Motion &next = bodies.next_b, &start = bodies.start_b;
  const auto scaled = [&](BodyResponse r) {
    scale(r, -1.0 / h);
    return r;
  };
  if (pair.body_b != 0)
    add_force(model, pair.body_b, pair.position, response.wrench * (1.0 / h),
              scaled(response.of_b(next, start)), data);
  if (pair.body_a == 0) return;
  add_force(model, pair.body_a, pair.position, response.wrench * (-1.0 / h),
            scaled(response.of_a(next, start)), data);
  if (pair.body_b == 0) return;
  couple(model, pair, pair.body_b, pair.body_a, scaled(response.of_b_by_a(next, start)), data);
  couple(model, pair, pair.body_a, pair.body_b, scaled(response.of_a_by_b(next, start)), data);
}

void ForceResponses::add_by_speed(std::span<const ForceBySpeed> forces, const SpeedByMotion& a,
                                  const SpeedByMotion& b) {
  Speed speed{speed_forces_.size(), speed_forces_.size() + forces.size(), {}, 0};
  speed_forces_.insert(speed_forces_.end(), forces.begin(), forces.end());
  for (const SpeedByMotion& motion : {a, b})
    if (motion.body != 0) speed.motions[speed.count++] = motion;
  speeds_.push_back(speed);
  by_v_ = true;
}

void ForceResponses::put_into(SweepInput& in) const {
  in.load = load_.data();
  in.response = response_.data();
  in.responds = responds_.data();
  in.responds_to_v = by_v_;
}

void ForceResponses::add_couplings(const Model& model, const SweepInput& in, TreeSweep& sweep,
                                   const SweepOutput& out) const {
  if (couplings_.empty() && inner_.empty() && speeds_.empty()) return;
  for (const Tree& tree : model.trees()) sweep.find_response_columns(model, tree, in);
  for (const InnerPair& pair : inner_) sweep.add_inner_pair(model, pair, out);
  for (const Coupling& c : couplings_) sweep.add_coupling(model, c.body, c.by, c.response, out);
  for (const Speed& s : speeds_)
    sweep.add_by_speed(model, std::span(speed_forces_).subspan(s.begin, s.end - s.begin),
                       std::span(s.motions, static_cast<size_t>(s.count)), out);
}

}  // namespace counterpoint
