#include "counterpoint/engine/derivatives/step/constrained_midpoint.h"

#include <algorithm>

#include "counterpoint/engine/derivatives/dynamics/rotation_maps.h"
#include "counterpoint/engine/derivatives/step/step_differences.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/crba.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {
ConstrainedMidpoint::ConstrainedMidpoint(const Model& model)
    : w(VectorX::Zero(model.nv())),
      M_(model.nv(), model.nv()),
      r_(w),
      m_(w),
      diagonal_(w),
      at_q_(model.default_q()),
      at_v_(w),
      at_w_(w),
      at_v_next_(w),
      q_next_(at_q_),
      direction_(w),
      no_external_(model) {
  for (MatrixX* x : {&w_q, &w_v, &w_next, &by_q_, &by_m_, &mass_, &G_m_, &A_})
    x->setZero(model.nv(), model.nv());
}

bool ConstrainedMidpoint::compute(const InverseArguments& of, const InvertedStep& inverted,
                                  SmoothDerivator& smooth, InverseDerivator& impulses,
                                  InverseDerivatives& d) {
  if (inverted.has_coriolis && has_equalities(*inverted.constraints)) return false;
  const Model& model = of.model;
  const double h = of.h();
  const int nv = model.nv();
  w = inverted.contact_velocity;
  m_ = inverted.midpoint.w_m;
  const VectorX& rotors = inverted.start.rotor_inertia(model, of.effects);
  r_ = (m_ - of.v) / (0.5 * h);
  smooth.compute(model, of.effects, m_, r_, of.known.wrenches, inverted.stage, rotors);
  r_ = 0.5 * h * m_;
  by_q_ = smooth.dq;
  multiply_columns(model, RotationMap::kP, r_, by_q_);
  by_q_.diagonal() += smooth.stiffness;
  multiply_columns(model, RotationMap::kQ, r_, smooth.dq);
  mass_ = (2.0 / h) * smooth.mass;
  by_m_ = smooth.dw + 0.5 * h * smooth.dq + mass_;
  diagonal_ = smooth.damping + 0.5 * h * smooth.stiffness;
  by_m_.diagonal() += diagonal_;

  V_.resize(static_cast<size_t>(model.num_bodies()));
  compute_body_velocities(model, w, inverted.at(), V_);
  InvertedStep at_w = inverted;
  at_w.body_velocity = &V_;
  if (!impulses.compute_impulses(of, m_, w, at_w, G_)) return false;
  crba(model, {inverted.at(), inverted.start.velocity_forces(), no_external_, inverted.scratch},
       M_);
  diagonal_ += rotors / h;
  G_.dv_next.diagonal() += diagonal_;
  G_.dv.diagonal() -= diagonal_;
  G_m_ = -M_ / h;
  G_m_.diagonal() -= diagonal_;
  A_ = G_.dv_next - G_m_;
  solver_.begin(A_, 3 * nv);
  solver_.add(G_.dq, 0, -1.0);
  solver_.add(G_.dv, nv, -1.0);
  solver_.add(G_m_, 2 * nv, -1.0);
  if (!solver_.solve()) return false;
  solver_.get(0, w_q);
  solver_.get(nv, w_v);
  solver_.get(2 * nv, w_next);
  d.dq = by_q_ - by_m_.lazyProduct(w_q);
  d.dv = by_m_ - mass_ - by_m_.lazyProduct(w_v);
  d.dv_next = by_m_ - by_m_.lazyProduct(w_next);
  return true;
}

bool ConstrainedMidpoint::difference(const InverseArguments& of, double step, bool extrapolated,
                                     Workspace& workspace, InverseDerivatives& d) {
  Workspace::Impl& ws = workspace.impl();
  const Model& model = of.model;
  const VectorRef &q = of.q, &v = of.v, &v_next = of.v_next;
  const int nv = model.nv();
  const double h = of.h(), v_step = velocity_difference_step(step, h);
  w = ws.inverse.contact_velocity;
  at_q_ = q;
  at_v_ = v;
  at_w_ = w;
  at_v_next_ = v_next;
  const auto evaluate = [&](Sample& out) {
    integrate_configuration(model, at_q_, at_w_, h, q_next_);
    invert_step(
        {model, of.options, at_q_, at_v_, q_next_, at_v_next_, of.known, of.effects, of.z, true},
        ws, inverse_);
    out.u = inverse_.applied_force;
    out.rest = at_v_ + at_v_next_ - at_w_ - ws.midpoint.w_m;
  };
  // `move(k, s)` shifts component k of the argument by s; s = 0 restores it.
  const auto columns = [&](double s, Block& block, const auto& move) {
    for (MatrixX* x : {&block.u, &block.rest})
      if (x->rows() != nv) x->resize(nv, nv);
    for (int k = 0; k < nv; ++k) {
      move(k, s);
      evaluate(plus_);
      move(k, -s);
      evaluate(minus_);
      move(k, 0.0);
      block.u.col(k) = (plus_.u - minus_.u) / (2.0 * s);
      block.rest.col(k) = (plus_.rest - minus_.rest) / (2.0 * s);
    }
  };
  const auto difference_by = [&](double s, Block& block, const auto& move) {
    columns(s, block, move);
    if (!extrapolated) return;
    columns(2.0 * s, wide_, move);
    block.u = (4.0 * block.u - wide_.u) / 3.0;
    block.rest = (4.0 * block.rest - wide_.rest) / 3.0;
  };
  difference_by(step, blocks_[0], [&](int k, double s) {
    direction_[k] = 1.0;
    integrate_configuration(model, q, direction_, s, at_q_);
    direction_[k] = 0.0;
  });
  at_q_ = q;
  difference_by(v_step, blocks_[1], [&](int k, double s) { at_v_[k] = v[k] + s; });
  difference_by(v_step, blocks_[2], [&](int k, double s) { at_w_[k] = w[k] + s; });
  difference_by(v_step, blocks_[3], [&](int k, double s) { at_v_next_[k] = v_next[k] + s; });
  return eliminate(d);
}

bool ConstrainedMidpoint::eliminate(InverseDerivatives& d) {
  const auto nv = static_cast<int>(blocks_[0].u.rows());
  solver_.begin(blocks_[2].rest, 3 * nv);
  solver_.add(blocks_[0].rest, 0, -1.0);
  solver_.add(blocks_[1].rest, nv, -1.0);
  solver_.add(blocks_[3].rest, 2 * nv, -1.0);
  if (!solver_.solve()) return false;
  solver_.get(0, w_q);
  solver_.get(nv, w_v);
  solver_.get(2 * nv, w_next);
  d.dq = blocks_[0].u + blocks_[2].u.lazyProduct(w_q);
  d.dv = blocks_[1].u + blocks_[2].u.lazyProduct(w_v);
  d.dv_next = blocks_[3].u + blocks_[2].u.lazyProduct(w_next);
  return true;
}

}  // namespace counterpoint
