#include "counterpoint/engine/derivatives/forces/joint_derivatives.h"

#include <cmath>

#include "counterpoint/contact/inverse.h"
#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {
namespace {

/// Derivatives of a row's law by q at the coordinate of its first or second entry.
struct RowSlopes {
  double bias = 0.0;       ///< [1/s]
  double smoothing = 0.0;  ///< joint limits only [N or N m]
};

RowSlopes row_slopes(const SimulationOptions& options, const JointConstraint& row, int side,
                     const InverseWeights& weights, bool displacing) {
  const double h = options.time_step;
  if (row.law.type == contact::LawType::kEquality) {
    if (displacing) return {};
    const ContactOptions& contact = options.contact;
    const bool capped = std::abs(row.law.bias[0]) >= contact.max_recovery_speed;
    return {capped ? 0.0 : row.coefficient[side] * contact.stabilization / h, 0.0};
  }
  if (std::isnan(row.gap_bias) || row.law.type != contact::LawType::kUnilateral) return {};
  const double gap = row.gap, sign = row.coefficient[0];
  const double alpha = weights.dof[row.v_index[0]];
  const double bias = displacing ? gap_bias_slope(options.contact, h, gap)
                                 : law_bias_slope(law_options(options), h, gap);
  return {sign * bias, sign * limit_smoothing_slope(options.contact, alpha, gap)};
}

}  // namespace

void add_joint_force_derivatives(const Model& model, EffectSet effects, double h,
                                 InverseDerivatives& d) {
  if (effects.has(Effect::kArmature)) {
    d.dv_next.diagonal() += model.armature() / h;
    d.dv.diagonal() -= model.armature() / h;
  }
  if (effects.has(Effect::kDamping)) d.dv_next.diagonal() += model.damping();
  if (effects.has(Effect::kSprings)) {
    for (const JointSpring& spring : model.springs()) {
      const int k = model.body(spring.joint + 1).v_index;
      d.dq(k, k) += spring.stiffness;
      d.dv_next(k, k) += h * spring.stiffness;
    }
  }
  if (!effects.has(Effect::kServos)) return;
  for (const JointServo& servo : model.servos()) {
    const int k = model.body(servo.joint + 1).v_index;
    d.dq(k, k) += servo.stiffness;
    d.dv_next(k, k) += h * servo.stiffness + servo.damping;
  }
}

void add_joint_row_derivatives(const SimulationOptions& options,
                               const std::vector<JointConstraint>& joints, const VectorRef& v_next,
                               const InverseWeights& weights, InverseDerivatives& d,
                               bool displacing) {
  for (const JointConstraint& row : joints) {
    double y = row.law.bias[0], f = 0.0, G = 0.0;
    const int sides = row.v_index[1] >= 0 ? 2 : 1;
    for (int k = 0; k < sides; ++k) y += row.coefficient[k] * v_next[row.v_index[k]];
    contact::evaluate(row.law, &y, &f, &G);
    G /= options.time_step;
    for (int j = 0; j < sides; ++j) {
      const RowSlopes slopes = row_slopes(options, row, j, weights, displacing);
      double by_q = G * slopes.bias;
      if (slopes.smoothing != 0.0)
        by_q -= contact::compute_sensitivity(row.law, contact::Rows::Constant(1, y)).smoothing[0] *
                slopes.smoothing / options.time_step;
      for (int i = 0; i < sides; ++i) {
        d.dv_next(row.v_index[i], row.v_index[j]) += row.coefficient[i] * G * row.coefficient[j];
        d.dq(row.v_index[i], row.v_index[j]) += row.coefficient[i] * by_q;
      }
    }
  }
}

}  // namespace counterpoint
