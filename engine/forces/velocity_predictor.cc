#include "counterpoint/engine/forces/velocity_predictor.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/constraints/closures.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/forces/joint_forces.h"

namespace counterpoint {
namespace {

/// Calls visit(tree_a, tree_b, equality) for every constraint, as for_each_constraint; equality is
/// true for a mimic joint or a closure other than a rope.
template <class Visit>
void for_each_marked(const Model& model, const ConstraintSet& constraints, Visit visit) {
  size_t i = 0;
  const size_t pairs = constraints.pairs.size();
  for_each_constraint(model, constraints, [&](int tree_a, int tree_b) {
    const contact::Law& law =
        i < pairs ? constraints.pairs[i].law : constraints.joints[i - pairs].law;
    visit(tree_a, tree_b, law.type == contact::LawType::kEquality);
    ++i;
  });
}

bool turns(const Tree& tree, const Kinematics& data) {
  for (int i = tree.body_begin; i < tree.body_end; ++i)
    if (!data.V[i].angular.isZero(0.0)) return true;
  return false;
}

/// Returns the largest angular speed of a body and its ancestors [rad/s].
double fastest_turn(const Model& model, int body, const std::vector<Motion>& V) {
  double square = 0.0;
  for (int i = body; i != 0; i = model.body(i).parent)
    square = std::max(square, V[i].angular.squaredNorm());
  return std::sqrt(square);
}

}  // namespace

VelocityPredictor::VelocityPredictor(const Model& model)
    : with_servo_(model.num_trees(), 0),
      driven_(model.num_trees(), 0),
      known_(model.num_trees(), 0),
      covered_(model.num_trees(), 0),
      needed_(model.num_trees(), 0),
      tau_(VectorX::Zero(model.nv())),
      diagonal_(VectorX::Zero(model.nv())),
      acceleration_(VectorX::Zero(model.nv())),
      velocity_(VectorX::Zero(model.nv())),
      equality_change_(VectorX::Zero(model.nv())),
      mid_velocity_(model),
      first_(VectorX::Zero(model.nv())),
      q_reached_(model.default_q()),
      V_(model.num_bodies()) {
  if (!model.closures().empty()) reached_.emplace(model);
  for (const JointServo& servo : model.servos()) with_servo_[model.body(servo.joint + 1).tree] = 1;
  for (int i = 1; i < model.num_bodies(); ++i)
    if (model.joint(i - 1).prescribed) driven_[model.body(i).tree] = 1;
}

void VelocityPredictor::forget() {
  if (!any_) return;
  std::fill(covered_.begin(), covered_.end(), 0);
  equality_change_.setZero();
  any_ = refined_ = false;
}

bool VelocityPredictor::aims(const Model& model, const PairConstraint& pair) const {
  if (!any_ || pair.soft || pair.law.type != contact::LawType::kEquality) return false;
  for (const int body : {pair.body_a, pair.body_b})
    if (body != 0 && !(known_[model.body(body).tree] && needed_[model.body(body).tree]))
      return false;
  return true;
}

/// Chooses the trees to cover: requested trees that rotate, without servos, prescribed joints, and
/// constraints other than equalities. False if there are none.
bool VelocityPredictor::choose(const Model& model, EffectSet effects, Of of,
                               const ConstraintSet& constraints, std::span<const BodyRange> ranges,
                               const Kinematics& data) {
  const bool servos = effects.has(Effect::kServos);
  for (size_t t = 0; t < known_.size(); ++t) known_[t] = !driven_[t] && !(servos && with_servo_[t]);
  for_each_marked(model, constraints, [&](int a, int b, bool equality) {
    for (const int t : {a, b})
      if (t >= 0 && !equality) known_[t] = 0;
  });
  for (const BodyRange& bodies : ranges) {
    for (int i = bodies.begin; i < bodies.end;) {
      const int t = model.body(i).tree;
      const Tree& tree = model.trees()[t];
      i = tree.body_end;
      const bool asked = of == Of::kUnderEqualities || tree.body_end - tree.body_begin > 1;
      covered_[t] = asked && known_[t] && (of == Of::kAllLinkages || turns(tree, data));
    }
  }
  const auto any = [&] { return std::find(covered_.begin(), covered_.end(), 1) != covered_.end(); };
  if (of != Of::kUnderEqualities) return any();
  needed_.assign(needed_.size(), 0);
  for_each_marked(model, constraints, [&](int a, int b, bool equality) {
    for (const int t : {a, b})
      if (t >= 0 && equality) needed_[t] = 1;
  });
  for (size_t t = 0; t < covered_.size(); ++t) covered_[t] = covered_[t] && needed_[t];
  return any();
}

/// Marks the trees that equalities couple to covered trees, directly or through others, and lists
/// these equalities.
void VelocityPredictor::gather_equalities(const Model& model, const ConstraintSet& constraints) {
  needed_ = covered_;
  for (bool more = true; more;) {
    more = false;
    for_each_marked(model, constraints, [&](int a, int b, bool equality) {
      if (!equality || a < 0 || b < 0 || needed_[a] == needed_[b]) return;
      needed_[a] = needed_[b] = 1;
      more = true;
    });
  }
  equalities_.clear();
  equality_closures_.clear();
  size_t i = 0;
  const size_t pairs = constraints.pairs.size();
  for_each_marked(model, constraints, [&](int a, int b, bool equality) {
    if (equality && needed_[std::max(a, b)]) {
      if (i < pairs) {
        equalities_.pairs.push_back(constraints.pairs[i]);
        equality_closures_.push_back(static_cast<int>(i - constraints.contacts.size()));
      }
      if (i >= pairs) {
        const JointConstraint& row = constraints.joints[i - pairs];
        equalities_.add(row, constraints.terms(row));
      }
    }
    ++i;
  });
}

/// Sets velocity_ of a tree without its equalities. False if its inertia is singular.
bool VelocityPredictor::accelerate(const Model& model, const Tree& tree, double span,
                                   const VectorRef& v, const Vector3& gravity, Data& data) {
  const BodyRange bodies = {tree.body_begin, tree.body_end};
  if (!aba(model, tau_, diagonal_, gravity, bodies, data, acceleration_)) return false;
  const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
  velocity_(part) = v(part) + span * acceleration_(part);
  return true;
}

/// Replaces velocity_ by the solution of problem_, the velocity under the equalities. False if
/// there is no solution.
bool VelocityPredictor::solve_equalities(const Model& model) {
  if (w_.size() < problem_.num_velocities()) w_.resize(problem_.num_velocities());
  if (impulse_.size() < problem_.num_rows()) impulse_.resize(problem_.num_rows());
  Eigen::Ref<VectorX> w = w_.head(problem_.num_velocities());
  if (factored_) {
    equality_solver_.solve(problem_, w);
  } else {
    w = problem_.free_velocity();
    // The default settings, since the inverse does not know those of the step.
    const contact::Report& solved = solver_.solve(
        problem_, contact::Settings(), w, Eigen::Ref<VectorX>(impulse_.head(problem_.num_rows())));
    if (!contact::succeeded(solved.status)) return false;
  }
  for (int t = 0; t < model.num_trees(); ++t) {
    const int block = block_of_tree_[t];
    if (block < 0) continue;
    const Tree& tree = model.trees()[t];
    const int size = tree.v_end - tree.v_begin;
    auto velocity = velocity_.segment(tree.v_begin, size);
    if (covered_[t])
      equality_change_.segment(tree.v_begin, size) =
          w.segment(problem_.block_start(block), size) - velocity;
    velocity = w.segment(problem_.block_start(block), size);
  }
  return true;
}

void VelocityPredictor::find(const StepContext& at, Of of, double span, const Vector3& gravity,
                             const ConstraintSet& constraints, std::span<const BodyRange> ranges,
                             Data& data) {
  const Model& model = at.model;
  forget();
  any_ = choose(model, at.effects, of, constraints, ranges, data);
  if (!any_) return;
  gather_equalities(model, constraints);
  tau_.setZero();
  diagonal_.setZero();
  EffectCounts not_counted;
  add_joint_forces(at, span, diagonal_, tau_, not_counted);
  velocity_ = at.v;
  bool found = true;
  for (int t = 0; t < model.num_trees() && found; ++t) {
    if (!needed_[t]) continue;
    const Tree& tree = model.trees()[t];
    compute_inertias(model, {tree.body_begin, tree.body_end}, data);
    found = accelerate(model, tree, span, at.v, gravity, data);
  }
  if (found && !equalities_.empty()) {
    assemble_problem(model, equalities_, velocity_, diagonal_, data, block_of_tree_, problem_);
    factored_ = equality_solver_.factor(problem_);
    found = solve_equalities(model);
  }
  // Without a prediction the step itself fails and reports the reason.
  if (!found) forget();
}

/// Aims closures between trees with known forces at the pose that velocity_ leads to.
void VelocityPredictor::aim(const StepContext& at, ConstraintSet& constraints,
                            const Kinematics& data) {
  const Model& model = at.model;
  const double h = at.h();
  if (equalities_.pairs.empty()) return;
  for (int t = 0; t < model.num_trees(); ++t) {
    if (!needed_[t] || block_of_tree_[t] < 0) continue;
    const Tree& tree = model.trees()[t];
    const BodyRange bodies = {tree.body_begin, tree.body_end};
    integrate_configuration(model, at.q, velocity_, h, bodies, q_reached_);
    compute_poses(model, q_reached_, bodies, *reached_);
  }
  compute_body_velocities(model, velocity_, data, V_);
  for (size_t i = 0; i < equalities_.pairs.size(); ++i) {
    const size_t index = static_cast<size_t>(equality_closures_[i]);
    PairConstraint& pair = constraints.pairs[constraints.contacts.size() + index];
    if (!aims(model, pair)) continue;
    const double share = share_aimed(
        h * std::max(fastest_turn(model, pair.body_a, V_), fastest_turn(model, pair.body_b, V_)));
    aim_closure(model, constraints.closures[index], at.options.contact, h, data, *reached_, V_,
                pair);
    const contact::Law& by_curvature = equalities_.pairs[i].law;
    for (size_t k = 0; k < static_cast<size_t>(pair.law.rows); ++k)
      pair.law.bias[k] = share * pair.law.bias[k] + (1.0 - share) * by_curvature.bias[k];
    problem_.law(static_cast<int>(i)).bias = pair.law.bias;
  }
}

void VelocityPredictor::refine(const StepContext& at, const Vector3& gravity,
                               ConstraintSet& constraints, Data& data) {
  const Model& model = at.model;
  const VectorRef& v = at.v;
  const double h = at.h();
  if (!any_ || equalities_.empty()) return;
  aim(at, constraints, data);
  first_ = velocity_;
  bool found = true;
  for (int t = 0; t < model.num_trees() && found; ++t) {
    const int block = block_of_tree_[t];
    if (block < 0) continue;
    const Tree& tree = model.trees()[t];
    if (covered_[t]) {
      mid_velocity_.add_force(model, v, first_, tree, data);
      found = accelerate(model, tree, h, v, gravity, data);
      for (int i = tree.body_begin; i < tree.body_end; ++i) data.has_mean_force[i] = 0;
    } else {
      found = accelerate(model, tree, h, v, gravity, data);
    }
    const int size = tree.v_end - tree.v_begin;
    problem_.free_velocity().segment(problem_.block_start(block), size) =
        velocity_.segment(tree.v_begin, size);
  }
  refined_ = found && solve_equalities(model);
  if (!refined_) velocity_ = first_;
  aim(at, constraints, data);
}

}  // namespace counterpoint
