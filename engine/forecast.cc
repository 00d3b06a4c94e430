#include "counterpoint/engine/forecast.h"

#include <algorithm>
#include <utility>

#include "counterpoint/engine/aba.h"
#include "counterpoint/engine/assemble.h"
#include "counterpoint/engine/joint_forces.h"
#include "counterpoint/engine/kinematics.h"

namespace counterpoint {
namespace {

/// Calls visit(tree_a, tree_b, tie) for every constraint, as for_each_constraint; tie: a closure
/// or a mimic joint.
template <class Visit>
void for_each_tie(const Model& model, const ConstraintSet& constraints, Visit visit) {
  size_t i = 0;
  const size_t contacts = constraints.contacts.size(), pairs = constraints.pairs.size();
  for_each_constraint(model, constraints, [&](int tree_a, int tree_b) {
    const bool tie = i < pairs
                         ? i >= contacts
                         : constraints.joints[i - pairs].law.type == contact::LawType::kEquality;
    visit(tree_a, tree_b, tie);
    ++i;
  });
}

bool turns(const Tree& tree, const Data& data) {
  for (int i = tree.body_begin; i < tree.body_end; ++i)
    if (!data.V[i].angular.isZero(0.0)) return true;
  return false;
}

}  // namespace

Forecast::Forecast(const Model& model)
    : with_servo_(model.num_trees(), 0),
      covered_(model.num_trees(), 0),
      needed_(model.num_trees(), 0),
      tau_(VectorX::Zero(model.nv())),
      diagonal_(VectorX::Zero(model.nv())),
      acceleration_(VectorX::Zero(model.nv())),
      velocity_(VectorX::Zero(model.nv())),
      tied_(VectorX::Zero(model.nv())) {
  for (const JointServo& servo : model.servos()) with_servo_[model.body(servo.joint + 1).tree] = 1;
}

void Forecast::forget() {
  std::fill(covered_.begin(), covered_.end(), 0);
  tied_.setZero();
}

/// The trees to cover: those asked for that turn, without servos, untouched by what is no tie.
void Forecast::choose(const Model& model, EffectSet effects, Of of,
                      const ConstraintSet& constraints, std::span<const BodyRange> ranges,
                      const Data& data) {
  const bool servos = effects.has(Effect::kServos);
  for (const BodyRange& bodies : ranges) {
    for (int i = bodies.begin; i < bodies.end;) {
      const int t = model.body(i).tree;
      const Tree& tree = model.trees()[t];
      i = tree.body_end;
      const bool asked = of == Of::kTied || tree.body_end - tree.body_begin > 1;
      covered_[t] = asked && !(servos && with_servo_[t]) && turns(tree, data);
    }
  }
  needed_.assign(needed_.size(), 0);
  for_each_tie(model, constraints, [&](int a, int b, bool tie) {
    for (const int t : {a, b}) {
      if (t < 0) continue;
      if (tie) needed_[t] = 1;
      if (!tie) covered_[t] = 0;
    }
  });
  if (of == Of::kLinkages) return;
  for (size_t t = 0; t < covered_.size(); ++t) covered_[t] = covered_[t] && needed_[t];
}

/// Marks what covered trees are tied to, through any number of others, and lists these ties.
void Forecast::gather_ties(const Model& model, const ConstraintSet& constraints) {
  needed_ = covered_;
  for (bool more = true; more;) {
    more = false;
    for_each_tie(model, constraints, [&](int a, int b, bool tie) {
      if (!tie || a < 0 || b < 0 || needed_[a] == needed_[b]) return;
      needed_[a] = needed_[b] = 1;
      more = true;
    });
  }
  ties_.clear();
  size_t i = 0;
  const size_t pairs = constraints.pairs.size();
  for_each_tie(model, constraints, [&](int a, int b, bool tie) {
    if (tie && needed_[std::max(a, b)]) {
      if (i < pairs) ties_.pairs.push_back(constraints.pairs[i]);
      if (i >= pairs) ties_.joints.push_back(constraints.joints[i - pairs]);
    }
    ++i;
  });
}

/// Takes velocity_ to what ties make of it. False where they have no solution.
bool Forecast::solve_ties(const Model& model, Data& data) {
  if (ties_.empty()) return true;
  assemble_problem(model, ties_, velocity_, diagonal_, data, block_of_tree_, problem_);
  if (w_.size() < problem_.num_velocities()) w_.resize(problem_.num_velocities());
  if (impulse_.size() < problem_.num_rows()) impulse_.resize(problem_.num_rows());
  Eigen::Ref<VectorX> w = w_.head(problem_.num_velocities());
  w = problem_.free_velocity();
  // Not the settings of the step: the inverse has none.
  const contact::Report& solved = solver_.solve(
      problem_, contact::Settings(), w, Eigen::Ref<VectorX>(impulse_.head(problem_.num_rows())));
  if (!contact::succeeded(solved.status)) return false;
  for (int t = 0; t < model.num_trees(); ++t) {
    const int block = block_of_tree_[t];
    if (block < 0) continue;
    const Tree& tree = model.trees()[t];
    const int size = tree.v_end - tree.v_begin;
    auto velocity = velocity_.segment(tree.v_begin, size);
    if (covered_[t])
      tied_.segment(tree.v_begin, size) = w.segment(problem_.block_start(block), size) - velocity;
    velocity = w.segment(problem_.block_start(block), size);
  }
  return true;
}

void Forecast::find(const Model& model, EffectSet effects, Of of, double span, const VectorRef& q,
                    const VectorRef& v, const Vector3& gravity, const ConstraintSet& constraints,
                    std::span<const BodyRange> ranges, Data& data) {
  forget();
  choose(model, effects, of, constraints, ranges, data);
  if (std::find(covered_.begin(), covered_.end(), 1) == covered_.end()) return;
  gather_ties(model, constraints);
  tau_.setZero();
  diagonal_.setZero();
  EffectCounts not_counted;
  add_joint_forces(model, effects, span, q, v, diagonal_, tau_, not_counted);
  velocity_ = v;
  const bool had_external = std::exchange(data.has_external, false);
  added_.swap(data.added);  // of the step before
  bool found = true;
  for (int t = 0; t < model.num_trees() && found; ++t) {
    if (!needed_[t]) continue;
    const Tree& tree = model.trees()[t];
    const BodyRange bodies = {tree.body_begin, tree.body_end};
    compute_inertias(model, bodies, data);
    found = aba(model, tau_, diagonal_, gravity, bodies, data, acceleration_);
    const int size = tree.v_end - tree.v_begin;
    velocity_.segment(tree.v_begin, size) += span * acceleration_.segment(tree.v_begin, size);
  }
  // What has no forecast makes the step itself fail, which says why.
  if (!found || !solve_ties(model, data)) forget();
  added_.swap(data.added);
  data.has_external = had_external;
}

}  // namespace counterpoint
