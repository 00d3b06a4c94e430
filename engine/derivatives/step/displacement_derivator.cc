#include "counterpoint/engine/derivatives/step/displacement_derivator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/dynamics/crba.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/forces/joint_forces.h"
#include "counterpoint/engine/forces/servos.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {
namespace {

/// Cheap test without a contact problem: whether bodies may be displaced in addition to h w+.
bool may_displace(const ConstraintSet& constraints, const VectorRef& v_next, const Kinematics& data,
                  const std::vector<Motion>& V_next) {
  for (size_t i = 0; i < constraints.contacts.size(); ++i) {
    const PairConstraint& pair = constraints.pairs[i];
    if (pair.impact_time > 0.0) return true;
    if (pair.gap_bias < pair.law.bias[0] &&
        relative_velocity(pair, data, V_next)[0] + pair.gap_bias < 0.0)
      return true;
  }
  return std::any_of(constraints.joints.begin(), constraints.joints.end(), [&](const auto& row) {
    return row.gap_bias < row.law.bias[0] &&
           row_velocity(constraints.terms(row), v_next) + row.gap_bias < 0.0;
  });
}

/// Evaluates the impulses at w+, in the order of the rows of this problem.
void evaluate_impulses(const ConstraintSet& constraints, const contact::Problem& problem,
                       const VectorRef& v_next, const Kinematics& data,
                       const std::vector<Motion>& V_next, VectorX& impulse) {
  if (impulse.size() < problem.num_rows()) impulse.resize(problem.num_rows());
  const auto pairs = static_cast<int>(constraints.pairs.size());
  for (int c = 0; c < problem.num_constraints(); ++c) {
    const contact::Law& law = problem.law(c);
    const auto row_at = [&](int i) {
      return row_velocity(constraints.terms(constraints.joints[static_cast<size_t>(i)]), v_next);
    };
    contact::Rows y =
        c < pairs ? relative_velocity(constraints.pairs[static_cast<size_t>(c)], data, V_next)
                  : contact::Rows::Constant(1, row_at(c - pairs));
    for (int i = 0; i < law.rows; ++i) y[i] += law.bias[static_cast<size_t>(i)];
    impulse.segment(problem.first_row(c), law.rows) = contact::impulse(law, y);
  }
}

bool is_concerned(const OverlapCorrection& correction, const contact::Problem& problem,
                  int constraint) {
  return correction.concerns(std::max(problem.block(constraint, 0), problem.block(constraint, 1)));
}

}  // namespace

DisplacementDerivator::DisplacementDerivator(const Model& model)
    : p(VectorX::Zero(model.nv())), M_(model.nv(), model.nv()), w_(p), diagonal_(p), forces_(p) {
  for (MatrixX* x : {&by_q, &by_v, &by_v_next, &A_}) x->setZero(model.nv(), model.nv());
}

/// Finds p as the step did. Returns false if nothing is displaced, or the problem for p was not
/// solved.
bool DisplacementDerivator::find(const InverseArguments& of, Workspace::Impl& ws) {
  const Model& model = of.model;
  const VectorRef& v_next = of.v_next;
  const EffectSet effects = of.effects;
  const double h = of.h();
  diagonal_.setZero();
  forces_.setZero();  // this output is ignored
  const StepContext at = of.context();
  const Kinematics& data = ws.start.kinematics();
  ContactSolution& solution = ws.solution;
  contact::Problem& problem = solution.problem;
  if (effects.has(Effect::kServos)) add_servos(at, h, of.known, diagonal_, forces_);
  add_joint_forces(at, h, diagonal_, forces_, ws.counts);
  set_drag(model, effects, h, data, ws.motion.external, ws.counts);
  w_ = v_next;
  for (bool again = true; again;) {
    assemble_problem(model, ws.constraints, w_, diagonal_, ws.bodies(), solution.block_of_tree,
                     problem);
    evaluate_impulses(ws.constraints, problem, v_next, data, V_, solution.impulse);
    const OverlapCorrection::Found found =
        ws.overlap_correction.find(ws.constraints, problem, h, contact::Settings(),
                                   problem.free_velocity(), solution.impulses());
    if (!found.needed || !contact::succeeded(found.status)) return false;
    p.setZero();
    for_each_touched(model, solution, [&](auto in_tree, auto in_block) {
      p(in_tree) = ws.overlap_correction.velocity()(in_block);
    });
    forces_ = v_next + p;
    again = ws.finder.contacts().find_reached(at, {forces_}, data, ws.constraints);
  }
  w_ += p;
  return true;
}

/// Copies the rows of gaps that p may close to kept_, with their laws for p.
void DisplacementDerivator::keep_gaps(const ConstraintSet& all, const contact::Problem& problem,
                                      const OverlapCorrection& correction) {
  kept_.clear();
  for (size_t i = 0; i < all.contacts.size(); ++i) {
    if (!is_concerned(correction, problem, static_cast<int>(i))) continue;
    kept_.contacts.push_back(all.contacts[i]);
    kept_.pairs.push_back(all.pairs[i]);
    PairConstraint& pair = kept_.pairs.back();
    pair.law = displacement_law(pair.law, pair.gap_bias, pair.soft);
    pair.impact_time = 0.0;
    pair.fastest_contact = -1;
  }
  for (size_t i = 0; i < all.joints.size(); ++i) {
    const JointConstraint& row = all.joints[i];
    if (std::isnan(row.gap_bias) ||
        !is_concerned(correction, problem, static_cast<int>(all.pairs.size() + i)))
      continue;
    kept_.add(row, all.terms(row));
    kept_.joints.back().law = displacement_law(row.law, row.gap_bias);
  }
}

/// Copies the equalities to kept_. Returns whether they or drag act on p.
bool DisplacementDerivator::keep_ties(const ConstraintSet& all, bool drag) {
  constexpr double kNoGap = std::numeric_limits<double>::quiet_NaN();
  kept_.clear();
  for (size_t i = 0; i < all.closures.size(); ++i) {
    kept_.pairs.push_back(all.pairs[all.contacts.size() + i]);
    kept_.pairs.back().law = displacement_law(kept_.pairs.back().law, kNoGap);
    kept_.closures.push_back(all.closures[i]);
  }
  for (const JointConstraint& row : all.joints) {
    if (row.law.type != contact::LawType::kEquality) continue;
    kept_.add(row, all.terms(row));
    kept_.joints.back().law = displacement_law(row.law, kNoGap);
  }
  return drag || !kept_.empty();
}

bool DisplacementDerivator::compute(const InverseArguments& of, Workspace::Impl& ws,
                                    InverseDerivator& parts) {
  using enum InverseDerivator::Displacing;
  const Model& model = of.model;
  const VectorRef& v_next = of.v_next;
  if (of.options.integrator != Integrator::kSemiImplicitEuler || ws.constraints.empty())
    return false;
  const Kinematics& data = ws.start.kinematics();
  V_.resize(static_cast<size_t>(model.num_bodies()));
  compute_body_velocities(model, v_next, data, V_);
  if (!may_displace(ws.constraints, v_next, data, V_)) return false;
  const bool found = find(of, ws);
  ws.motion.external.added.clear();
  if (!found) return false;
  const auto differentiate = [&](InverseDerivator::Displacing part, const VectorX& w,
                                 const ConstraintSet& constraints, InverseDerivatives& d) {
    compute_body_velocities(model, w, data, V_);
    InvertedStep inverted(ws);
    inverted.constraints = &constraints;
    inverted.body_velocity = &V_;
    return parts.compute_displacing(part, of, p, w, inverted, d);
  };
  forces_ = v_next;
  bool closed = differentiate(kLateImpulses, forces_, ws.constraints, late_);
  keep_gaps(ws.constraints, ws.solution.problem, ws.overlap_correction);
  closed = closed && differentiate(kRecovery, w_, kept_, recovery_);
  if (!closed) return false;
  crba(model, ws.bodies(), M_);
  by_v_next = recovery_.dv_next - late_.dv_next - M_ / of.h();
  by_q = recovery_.dq - late_.dq;
  by_v = recovery_.dv - late_.dv;
  A_ = recovery_.dv_next;
  A_.diagonal() += diagonal_ / of.h();
  if (keep_ties(ws.constraints, of.effects.has(Effect::kDrag) && !model.drags().empty())) {
    differentiate(kEqualities, p, kept_, equalities_);
    A_ += equalities_.dv_next;
    by_q += equalities_.dq;
    by_v += equalities_.dv;
  }
  const int nv = model.nv();
  solver_.begin(A_, 3 * nv);
  solver_.add(by_q, 0, -1.0);
  solver_.add(by_v, nv, -1.0);
  solver_.add(by_v_next, 2 * nv, -1.0);
  if (!solver_.solve()) return false;
  solver_.get(0, by_q);
  solver_.get(nv, by_v);
  solver_.get(2 * nv, by_v_next);
  return true;
}

}  // namespace counterpoint
