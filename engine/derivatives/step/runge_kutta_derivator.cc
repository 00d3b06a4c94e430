#include "counterpoint/engine/derivatives/step/runge_kutta_derivator.h"

#include "counterpoint/engine/derivatives/dynamics/rotation_maps.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/step/equality_motion.h"
#include "counterpoint/engine/step/runge_kutta.h"

namespace counterpoint {
namespace {

/// Replaces dw in drate by dtheta'.
void add_exponent_rate(const Model& model, const VectorX& theta, const VectorX& w,
                       const MatrixX& dtheta, MatrixX& drate) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (body.joint_type != JointType::kSpherical && body.joint_type != JointType::kFloating)
      continue;
    const int k = body.v_index + joint_num_linear(body.joint_type);
    const Vector3 t = theta.segment<3>(k), omega = w.segment<3>(k);
    const Matrix3 T = skew(t), W = skew(omega);
    const Matrix3 by_w = 0.5 * T + T * T / 12.0;
    const Matrix3 by_t = -0.5 * W - (skew(t.cross(omega)) + T * W) / 12.0;
    for (Eigen::Index j = 0; j < drate.cols(); ++j) {
      const Vector3 dw = drate.block<3, 1>(k, j);
      drate.block<3, 1>(k, j) += by_w * dw + by_t * dtheta.block<3, 1>(k, j);
    }
  }
}

void refuse_equalities(const Model& model, EffectSet effects, const VectorRef& z) {
  if (!has_equalities(model, effects, z)) return;
  throw InputError(
      "derivatives of runge_kutta_4 with closures or mimic joints are not given: use "
      "implicit_midpoint or semi_implicit_euler");
}

}  // namespace

RungeKuttaDerivator::RungeKuttaDerivator(const Model& model) {
  const int nv = model.nv();
  theta_ = rate_ = acceleration_ = theta_sum_ = v_sum_ = VectorX::Zero(nv);
  for (MatrixX* m : {&dtheta_, &dq_, &dw_, &drate_, &da_, &dtheta_sum_, &dv_sum_})
    m->setZero(nv, 3 * nv);
}

/// Computes da_ from dq_ and dw_. Returns false if M is singular.
bool RungeKuttaDerivator::accelerate(const Model& model, const SmoothDerivator& smooth) {
  const int nv = model.nv();
  da_.noalias() = -(smooth.dq.lazyProduct(dq_));
  da_.noalias() -= smooth.dw.lazyProduct(dw_);
  for (int i = 0; i < nv; ++i)
    da_.row(i) -= smooth.stiffness[i] * dq_.row(i) + smooth.damping[i] * dw_.row(i);
  da_.rightCols(nv).diagonal().array() += 1.0;
  solver_.begin(smooth.mass, 3 * nv);
  solver_.add(da_, 0, 1.0);
  if (!solver_.solve()) return false;
  solver_.get(0, da_);
  return true;
}

bool RungeKuttaDerivator::compute(const StepContext& start, const Input& input, Workspace::Impl& ws,
                                  SmoothDerivator& smooth, ForwardDerivatives& d) {
  const auto& [model, options, effects, q, v, z] = start;
  const double h = start.h();
  refuse_constraints(model, effects);
  refuse_equalities(model, effects, z);
  ws.constraints.clear();
  ws.sleepers.wake_all(model);
  prepare_step(start, ws);
  const int nv = model.nv();
  at_.q = q;
  at_.v = v;
  theta_.setZero();
  theta_sum_.setZero();
  v_sum_ = v;
  for (MatrixX* m : {&dtheta_, &dtheta_sum_, &dv_sum_}) m->setZero();
  dw_.setZero();
  dw_.middleCols(nv, nv).diagonal().setOnes();
  StepReport report;
  for (int s = 0; s < 4; ++s) {
    const auto [node, weight] = kRungeKuttaStages[s];
    if (s > 0) {
      theta_ = node * h * rate_;
      integrate_configuration(model, q, theta_, 1.0, at_.q);
      at_.v = v + node * h * acceleration_;
      dtheta_ = node * h * drate_;
      dw_ = node * h * da_;
      dw_.middleCols(nv, nv).diagonal().array() += 1.0;
    }
    exponent_rate(model, theta_, at_.v, rate_);
    compute_acceleration({model, options, effects, at_.q, at_.v, z}, input, ws, acceleration_,
                         report);
    if (!report.succeeded()) return false;
    smooth.compute(model, effects, at_.v, acceleration_, input.wrenches, ws.stage,
                   ws.start.rotor_inertia(model, effects));
    // dq_s = P dq + Q dtheta, with P and Q of q (+) theta.
    dq_ = dtheta_;
    multiply_rows(model, RotationMap::kQ, theta_, dq_);
    add_map(model, RotationMap::kP, theta_, dq_.leftCols(nv));
    drate_ = dw_;
    add_exponent_rate(model, theta_, at_.v, dtheta_, drate_);
    if (!accelerate(model, smooth)) return false;
    theta_sum_ += h / 6.0 * weight * rate_;
    v_sum_ += h / 6.0 * weight * acceleration_;
    dtheta_sum_ += h / 6.0 * weight * drate_;
    dv_sum_ += h / 6.0 * weight * da_;
  }
  integrate_configuration(model, q, theta_sum_, 1.0, at_.q);
  at_.v = v_sum_;
  dv_sum_.middleCols(nv, nv).diagonal().array() += 1.0;
  multiply_rows(model, RotationMap::kQ, theta_sum_, dtheta_sum_);
  add_map(model, RotationMap::kP, theta_sum_, dtheta_sum_.leftCols(nv));
  d.dv_dq = dv_sum_.leftCols(nv);
  d.dv_dv = dv_sum_.middleCols(nv, nv);
  d.dv_du = dv_sum_.rightCols(nv);
  d.dq_dq = dtheta_sum_.leftCols(nv);
  d.dq_dv = dtheta_sum_.middleCols(nv, nv);
  d.dq_du = dtheta_sum_.rightCols(nv);
  return true;
}

}  // namespace counterpoint
