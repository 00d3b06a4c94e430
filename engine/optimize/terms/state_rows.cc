// Rows of terms that are functions of (q, v, v_next): contact forces and the angular momentum.
#include <algorithm>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/terms/evaluator.h"

namespace counterpoint::optimization {

void Evaluator::take_contact_rows(const Term& term) {
  const ContactForceDerivatives& all = derivatives_.contacts;
  const auto at = std::find(all.bodies.begin(), all.bodies.end(), term.body) - all.bodies.begin();
  by_q_v_w_[0] = all.dq.middleRows<3>(3 * at);
  by_q_v_w_[1] = all.dv.middleRows<3>(3 * at);
  by_q_v_w_[2] = all.dv_next.middleRows<3>(3 * at);
}

/// Differentiates the angular momentum: exactly with respect to v, in which it is linear; by
/// central differences of kinematics with respect to q.
void Evaluator::differentiate_angular_momentum() {
  constexpr double kStep = 1e-5;
  const Eigen::Index nv = model_->nv();
  for (MatrixX& out : by_q_v_w_) out.setZero(3, nv);
  VectorX unit = VectorX::Zero(nv), moved = q_;
  for (Eigen::Index j = 0; j < nv; ++j) {
    unit[j] = 1.0;
    compute_velocities(*model_, unit, at_);
    by_q_v_w_[1].col(j) = angular_momentum(*model_, at_);
    for (const double side : {1.0, -1.0}) {
      moved = q_;
      integrate_configuration(*model_, q_, unit, side * kStep, moved);
      compute_poses(*model_, moved, scratch_data_);
      compute_velocities(*model_, v_, scratch_data_);
      by_q_v_w_[0].col(j) += side / (2.0 * kStep) * angular_momentum(*model_, scratch_data_);
    }
    unit[j] = 0.0;
  }
}

}  // namespace counterpoint::optimization
