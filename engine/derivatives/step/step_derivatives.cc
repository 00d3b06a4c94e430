#include <algorithm>
#include <optional>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/rotation_maps.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/inverted_step.h"
#include "counterpoint/engine/derivatives/step/center_terms.h"
#include "counterpoint/engine/derivatives/step/constrained_midpoint.h"
#include "counterpoint/engine/derivatives/step/displacement_derivator.h"
#include "counterpoint/engine/derivatives/step/inverse_derivator.h"
#include "counterpoint/engine/derivatives/step/midpoint_derivator.h"
#include "counterpoint/engine/derivatives/step/runge_kutta_derivator.h"
#include "counterpoint/engine/derivatives/step/step_differences.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {

struct DerivativeScratch {
  explicit DerivativeScratch(const Model& model) : inverse(model) {}
  InverseDerivator inverse;
  DifferenceScratch differences;
  SparseSolver solver;
  // For integrators other than semi-implicit Euler.
  std::optional<SmoothDerivator> smooth;
  std::optional<RungeKuttaDerivator> runge_kutta;
  std::optional<ConstrainedMidpoint> midpoint;
  std::optional<CenterTerms> center;  ///< set if there are free groups
  // For steps that displace bodies.
  std::optional<DisplacementDerivator> displacement;
  bool impulses = false;  ///< the last step was a midpoint step with constraints
  State start;
  VectorX r;  ///< nv
};

namespace {

DerivativeScratch& scratch_of(const Model& model, std::shared_ptr<DerivativeScratch>& derivatives) {
  if (!derivatives) derivatives = std::make_shared<DerivativeScratch>(model);
  return *derivatives;
}

/// Returns null if the step has no free groups.
CenterTerms* center_terms(const Model& model, const FreeGroups& groups,
                          DerivativeScratch& scratch) {
  if (groups.groups().empty()) return nullptr;
  if (!scratch.center) scratch.center.emplace(model);
  return &*scratch.center;
}

/// Computes the derivatives of q_next = q (+) h (w+ + p), p the displacement velocity of the step.
void chain_displacement(const Model& model, double h, const VectorRef& v_next,
                        const DisplacementDerivator& by, VectorX& r, ForwardDerivatives& d) {
  r = h * (v_next + by.p);
  d.dq_dq = h * (d.dv_dq + by.by_q + by.by_v_next.lazyProduct(d.dv_dq));
  d.dq_dv = h * (d.dv_dv + by.by_v + by.by_v_next.lazyProduct(d.dv_dv));
  d.dq_du = h * (d.dv_du + by.by_v_next.lazyProduct(d.dv_du));
  d.dq_dv_next.setZero(model.nv(), model.nv());
  d.dq_dv_next.diagonal().setConstant(h);
  for (MatrixX* m : {&d.dq_dq, &d.dq_dv, &d.dq_du, &d.dq_dv_next})
    multiply_rows(model, RotationMap::kQ, r, *m);
  add_map(model, RotationMap::kP, r, d.dq_dq);
}

/// Computes the derivatives of q_next = q (+) h w, which are P dq + h Q dw. w is v_next; under the
/// midpoint rule it is the mean of v and v_next, or with constraints that of ConstrainedMidpoint.
void chain_configuration(const InverseArguments& of, const ConstrainedMidpoint* impulses,
                         VectorX& r, ForwardDerivatives& d) {
  const Model& model = of.model;
  const bool midpoint = of.options.integrator == Integrator::kImplicitMidpoint;
  const double h = of.h(), share = midpoint ? 0.5 : 1.0;
  if (impulses != nullptr) {
    r = h * impulses->w;
    d.dq_dq = h * (impulses->w_q + impulses->w_next.lazyProduct(d.dv_dq));
    d.dq_dv = h * (impulses->w_v + impulses->w_next.lazyProduct(d.dv_dv));
    d.dq_du = h * impulses->w_next.lazyProduct(d.dv_du);
  } else {
    r = h * share * of.v_next;
    if (midpoint) r += h * share * of.v;
    d.dq_dq = h * share * d.dv_dq;
    d.dq_dv = h * share * d.dv_dv;
    d.dq_du = h * share * d.dv_du;
    if (midpoint) d.dq_dv.diagonal().array() += h * share;
  }
  for (MatrixX* m : {&d.dq_dq, &d.dq_dv, &d.dq_du}) multiply_rows(model, RotationMap::kQ, r, *m);
  add_map(model, RotationMap::kP, r, d.dq_dq);
}

bool differentiate_runge_kutta(const StepContext& start, const Input& input, Workspace::Impl& ws,
                               DerivativeScratch& scratch, ForwardDerivatives& d) {
  const Model& model = start.model;
  check_time_step(start.h());
  scratch.start.q = start.q;
  scratch.start.v = start.v;
  if (!ws.check.accepts(model, scratch.start, input)) return false;
  if (!scratch.smooth) scratch.smooth.emplace(model);
  if (!scratch.runge_kutta) scratch.runge_kutta.emplace(model);
  if (!scratch.runge_kutta->compute(start, input, ws, *scratch.smooth, d)) return false;
  if (CenterTerms* center = center_terms(model, ws.free_groups, scratch)) {
    const State& reached = scratch.runge_kutta->reached();
    center->correct_forward(start, reached.q, reached.v, ws.free_groups, d);
  }
  return true;
}

/// Computes d in closed form. Returns false if something acts that has none.
bool differentiate(const InverseArguments& of, const InvertedStep& inverted,
                   DerivativeScratch& scratch, InverseDerivatives& d) {
  if (of.options.integrator == Integrator::kSemiImplicitEuler)
    return scratch.inverse.compute(of, inverted, d);
  if (inverted.taut_links.loses()) return false;
  if (!scratch.smooth) scratch.smooth.emplace(of.model);
  if (scratch.impulses)
    return scratch.midpoint->compute(of, inverted, *scratch.smooth, scratch.inverse, d);
  compute_midpoint_derivatives(of, inverted, *scratch.smooth, scratch.r, d);
  return true;
}

/// Whether some law changes within a smoothing length: all do but those of equalities, springs and
/// rows of given gains.
bool has_kinks(const ConstraintSet& constraints) {
  const auto kinked = [](const auto& row) {
    return row.law.type != contact::LawType::kEquality && row.law.type != contact::LawType::kSpring;
  };
  return std::any_of(constraints.pairs.begin(), constraints.pairs.end(), kinked) ||
         std::any_of(constraints.joints.begin(), constraints.joints.end(),
                     [&](const auto& row) { return !row.has_given_gains() && kinked(row); });
}

void refuse_prescribed(EffectSet effects) {
  if (effects.has(Effect::kPrescribed))
    throw InputError(
        "derivatives of forward steps with prescribed joints are not given; use those of the "
        "inverse, or differences");
}

/// Whether the limit of a ball joint has a row, whose direction turns with the joint.
bool has_turning_limits(const ConstraintSet& constraints) {
  return std::any_of(constraints.joints.begin(), constraints.joints.end(), [](const auto& row) {
    return row.effect == Effect::kLimits && row.num_terms > 1;
  });
}

void fill_with_nan(int nv, InverseDerivatives& d) {
  for (MatrixX* m : {&d.dq, &d.dv, &d.dv_next}) m->setConstant(nv, nv, kNaN);
  const auto rows = 3 * static_cast<Eigen::Index>(d.contacts.bodies.size());
  for (MatrixX* m : {&d.contacts.dq, &d.contacts.dv, &d.contacts.dv_next})
    m->setConstant(rows, nv, kNaN);
}

}  // namespace

void step_inverse_derivatives(const Model& model, const SimulationOptions& options, VectorRef q,
                              VectorRef v, VectorRef q_next, VectorRef v_next, const Input& known,
                              Workspace& workspace, Inverse& out, InverseDerivatives& d,
                              DerivativeMethod method, double difference_step) {
  if (!d.contacts.bodies.empty() && options.integrator != Integrator::kSemiImplicitEuler)
    throw InputError("derivatives of contact forces need the integrator semi_implicit_euler");
  step_inverse(model, options, q, v, q_next, v_next, known, workspace, out);
  if (out.fault.any()) return fill_with_nan(model.nv(), d);
  Workspace::Impl& ws = workspace.impl();
  DerivativeScratch& scratch = scratch_of(model, ws.derivatives);
  const bool analytic = method == DerivativeMethod::kAnalytic;
  const bool constrained = !ws.constraints.empty();
  scratch.impulses = constrained && options.integrator == Integrator::kImplicitMidpoint;
  if (scratch.impulses && !scratch.midpoint) scratch.midpoint.emplace(model);
  const EffectSet effects = active_effects(ws.called, options.effects);
  const Model& slowed = ws.taut_links.slowed(model);
  const InverseArguments of{slowed, options, q, v, q_next, v_next, known, effects, ws.z};
  CenterTerms* const center = analytic ? center_terms(model, ws.free_groups, scratch) : nullptr;
  const VectorRef w =
      center != nullptr
          ? VectorRef(center->find_step_velocity(of, ws.free_groups, ws.start.kinematics(),
                                                 ws.inverse, ws.midpoint.w_m))
          : v_next;
  const InverseArguments alone{slowed, options, q, v, q_next, w, known, effects, ws.z};
  const InvertedStep inverted(ws);
  if (analytic) ws.start.find_inertias(slowed);
  const bool has_forms = (!effects.has(Effect::kActuators) || ws.actuators.have_closed_forms()) &&
                         !has_turning_limits(ws.constraints);
  const bool closed = analytic && differentiate(alone, inverted, scratch, d) && has_forms;
  d.by_differences = analytic && !closed;
  // Differences of a midpoint step with constraints include the correction.
  if (center != nullptr && (closed || !scratch.impulses))
    center->correct_inverse(of, scratch.impulses ? &*scratch.midpoint : nullptr, inverted, d);
  if (closed) return;
  const double step = difference_step > 0.0
                          ? difference_step
                          : suitable_difference_step(options, has_kinks(ws.constraints));
  const bool extrapolated = method != DerivativeMethod::kCentralDifferences;
  // For Euler steps du/dv+ was found in closed form.
  const bool by_v_next = !analytic || options.integrator != Integrator::kSemiImplicitEuler;
  if (!scratch.impulses)
    return difference_step_inverse(of, workspace, {step, extrapolated, by_v_next},
                                   scratch.differences, d);
  if (!scratch.midpoint->difference(of, step, extrapolated, workspace, d))
    fill_with_nan(model.nv(), d);
}

bool step_forward_derivatives(const Model& model, const SimulationOptions& options, VectorRef q,
                              VectorRef v, VectorRef q_next, VectorRef v_next, const Input& known,
                              Workspace& workspace, Inverse& inverse, InverseDerivatives& d_inverse,
                              ForwardDerivatives& d, DerivativeMethod method) {
  const int nv = model.nv();
  MatrixX* const all[] = {&d.dv_dq, &d.dv_dv, &d.dv_du, &d.dq_dq, &d.dq_dv, &d.dq_du};
  for (MatrixX* m : all)
    if (m->rows() != nv || m->cols() != nv) m->resize(nv, nv);
  DerivativeScratch& scratch = scratch_of(model, workspace.impl().derivatives);
  refuse_prescribed(active_effects(workspace.impl().called, options.effects));
  d.displaces = false;
  if (options.integrator == Integrator::kRungeKutta4) {
    Workspace::Impl& ws = workspace.impl();
    const EffectSet effects = active_effects(ws.called, options.effects);
    const StepContext start{
        model, options, effects, q, v, set_internal_states(model, effects, q, known.z, known, ws)};
    const bool found = differentiate_runge_kutta(start, known, ws, scratch, d);
    for (MatrixX* m : all)
      if (!found) m->setConstant(kNaN);
    inverse.applied_force.setConstant(nv, kNaN);
    fill_with_nan(nv, d_inverse);
    return found;
  }
  step_inverse_derivatives(model, options, q, v, q_next, v_next, known, workspace, inverse,
                           d_inverse, method);
  SparseSolver& solver = scratch.solver;
  bool regular = !inverse.fault.any();
  if (regular) {
    solver.begin(d_inverse.dv_next, 3 * nv);
    solver.add(d_inverse.dq, 0, -1.0);
    solver.add(d_inverse.dv, nv, -1.0);
    solver.add_identity(2 * nv);
    regular = solver.solve();
  }
  if (!regular) {
    for (MatrixX* m : all) m->setConstant(kNaN);
    return false;
  }
  solver.get(0, d.dv_dq);
  solver.get(nv, d.dv_dv);
  solver.get(2 * nv, d.dv_du);
  Workspace::Impl& ws = workspace.impl();
  if (!scratch.displacement) scratch.displacement.emplace(model);
  const EffectSet effects = active_effects(ws.called, options.effects);
  const InverseArguments of{
      ws.taut_links.slowed(model), options, q, v, q_next, v_next, known, effects, ws.z};
  d.displaces = scratch.displacement->compute(of, ws, scratch.inverse);
  if (d.displaces) {
    chain_displacement(model, options.time_step, v_next, *scratch.displacement, scratch.r, d);
  } else {
    chain_configuration(of, scratch.impulses ? &*scratch.midpoint : nullptr, scratch.r, d);
  }
  if (CenterTerms* center = center_terms(model, ws.free_groups, scratch)) {
    scratch.start.q = q;
    integrate_configuration(model, q, scratch.r, 1.0, scratch.start.q);
    center->correct_forward(of.context(), scratch.start.q, v_next, ws.free_groups, d);
  }
  return true;
}

}  // namespace counterpoint
