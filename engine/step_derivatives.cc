#include "counterpoint/engine/step_derivatives.h"

#include <limits>

#include "counterpoint/engine/derivatives/inverse_derivator.h"
#include "counterpoint/engine/derivatives/right_jacobian.h"
#include "counterpoint/engine/derivatives/sparse_solve.h"
#include "counterpoint/engine/step_differences.h"
#include "counterpoint/engine/step_workspace.h"
#include "counterpoint/model/rotation.h"

namespace counterpoint {

struct DerivativeScratch {
  explicit DerivativeScratch(const Model& model) : inverse(model) {}
  InverseDerivator inverse;
  DifferenceScratch differences;
  SparseSolver solver;
};

namespace {

DerivativeScratch& scratch_of(const Model& model, Workspace::Impl& ws) {
  if (!ws.derivatives) ws.derivatives = std::make_shared<DerivativeScratch>(model);
  return *ws.derivatives;
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// dq_next = P dq + h Q dv_next at q_next = q (+) h v_next, P and Q being the identity but for
/// quaternions: P = exp(-h w), Q = J(h w).
void chain_configuration(const Model& model, double h, const VectorRef& v_next,
                         ForwardDerivatives& d) {
  d.dq_dq = h * d.dv_dq;
  d.dq_dv = h * d.dv_dv;
  d.dq_du = h * d.dv_du;
  d.dq_dq.diagonal().array() += 1.0;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (body.joint_type != JointType::kSpherical && body.joint_type != JointType::kFloating)
      continue;
    const int k = body.v_index + joint_num_linear(body.joint_type);
    const Vector3 turn = h * v_next.segment<3>(k);
    const Matrix3 Q = h * right_jacobian(turn);
    d.dq_dq.middleRows<3>(k).noalias() = Q.lazyProduct(d.dv_dq.middleRows<3>(k));
    d.dq_dq.block<3, 3>(k, k) += quaternion_exp(-turn).toRotationMatrix();
    d.dq_dv.middleRows<3>(k).noalias() = Q.lazyProduct(d.dv_dv.middleRows<3>(k));
    d.dq_du.middleRows<3>(k).noalias() = Q.lazyProduct(d.dv_du.middleRows<3>(k));
  }
}

}  // namespace

void step_inverse_derivatives(const Model& model, const SimulationOptions& options, VectorRef q,
                              VectorRef v, VectorRef v_next, const Input& known,
                              Workspace& workspace, Inverse& out, InverseDerivatives& d,
                              DerivativeMethod method, double difference_step) {
  step_inverse(model, options, q, v, v_next, known, workspace, out);
  if (out.fault.any()) {
    for (MatrixX* m : {&d.dq, &d.dv, &d.dv_next}) m->setConstant(model.nv(), model.nv(), kNaN);
    return;
  }
  Workspace::Impl& ws = workspace.impl();
  DerivativeScratch& scratch = scratch_of(model, ws);
  const bool analytic =
      method == DerivativeMethod::kAnalytic && options.integrator == Integrator::kSemiImplicitEuler;
  const EffectSet effects = active_effects(ws.called, options.effects);
  const bool closed =
      analytic && scratch.inverse.compute(model, options, effects, q, v, v_next, known, ws, d);
  d.by_differences = method == DerivativeMethod::kAnalytic && !closed;
  if (closed) return;
  const double step = difference_step > 0.0
                          ? difference_step
                          : suitable_difference_step(options, !ws.constraints.empty());
  difference_step_inverse(model, options, q, v, v_next, known, workspace, step,
                          method != DerivativeMethod::kCentralDifferences, !analytic,
                          scratch.differences, d);
}

bool step_forward_derivatives(const Model& model, const SimulationOptions& options, VectorRef q,
                              VectorRef v, VectorRef v_next, const Input& known,
                              Workspace& workspace, Inverse& inverse, InverseDerivatives& d_inverse,
                              ForwardDerivatives& d, DerivativeMethod method) {
  step_inverse_derivatives(model, options, q, v, v_next, known, workspace, inverse, d_inverse,
                           method);
  const int nv = model.nv();
  MatrixX* const all[] = {&d.dv_dq, &d.dv_dv, &d.dv_du, &d.dq_dq, &d.dq_dv, &d.dq_du};
  for (MatrixX* m : all)
    if (m->rows() != nv || m->cols() != nv) m->resize(nv, nv);
  SparseSolver& solver = scratch_of(model, workspace.impl()).solver;
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
  chain_configuration(model, options.time_step, v_next, d);
  return true;
}

}  // namespace counterpoint
