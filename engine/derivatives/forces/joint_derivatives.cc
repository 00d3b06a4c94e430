#include "counterpoint/engine/derivatives/forces/joint_derivatives.h"

#include <cmath>

#include "counterpoint/contact/inverse.h"
#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {
namespace {

/// Derivatives of a row's law by q, per coefficient of a term.
struct RowSlopes {
  double bias = 0.0;       ///< [1/s]
  double smoothing = 0.0;  ///< limits only [N or N m]
};

RowSlopes row_slopes(const SimulationOptions& options, const JointConstraint& row,
                     const RowTerm& first, const InverseWeights& weights, bool displacing) {
  const double h = options.time_step;
  if (row.has_given_gains()) return {displacing ? 0.0 : row.bias_by_length, 0.0};
  if (row.law.type == contact::LawType::kEquality) {
    if (displacing) return {};
    const ContactOptions& contact = options.contact;
    const bool capped = std::abs(row.law.bias[0]) >= contact.max_recovery_speed;
    return {capped ? 0.0 : contact.stabilization / h, 0.0};
  }
  if (std::isnan(row.gap_bias) || row.law.type != contact::LawType::kUnilateral) return {};
  const double gap = row.gap;
  const double alpha =
      row.tendon < 0 ? weights.dof[first.v_index] : weights.tendon[static_cast<size_t>(row.tendon)];
  const double bias = displacing ? gap_bias_slope(options.contact, h, gap)
                                 : law_bias_slope(law_options(options), h, gap);
  return {bias, limit_smoothing_slope(options.contact, alpha, gap)};
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

void add_joint_row_derivatives(const SimulationOptions& options, const ConstraintSet& constraints,
                               const VectorRef& v_next, const InverseWeights& weights,
                               InverseDerivatives& d, bool displacing) {
  for (const JointConstraint& row : constraints.joints) {
    const std::span<const RowTerm> terms = constraints.terms(row);
    const double y = row_velocity(terms, v_next) + row.law.bias[0];
    double f = 0.0, G = 0.0;
    contact::evaluate(row.law, &y, &f, &G);
    G /= options.time_step;
    const RowSlopes slopes = row_slopes(options, row, terms[0], weights, displacing);
    double by_q = G * slopes.bias;
    if (slopes.smoothing != 0.0)
      by_q -= contact::compute_sensitivity(row.law, contact::Rows::Constant(1, y)).smoothing[0] *
              slopes.smoothing / options.time_step;
    if (row.bound_by_velocity != 0.0)
      d.dv(terms[0].v_index, terms[0].v_index) -=
          contact::compute_sensitivity(row.law, contact::Rows::Constant(1, y)).bound[0] *
          row.bound_by_velocity / options.time_step;
    for (const RowTerm& i : terms) {
      for (const RowTerm& j : terms) {
        d.dv_next(i.v_index, j.v_index) += i.coefficient * G * j.coefficient;
        d.dq(i.v_index, j.v_index) += i.coefficient * by_q * j.coefficient;
      }
    }
  }
}

void add_tendon_curvature(const InvertedStep& inverted, const Model& model, double h,
                          const VectorRef& v_next, TendonCurvature& scratch,
                          InverseDerivatives& d) {
  const ConstraintSet& constraints = *inverted.constraints;
  int of = -1;
  for (const JointConstraint& row : constraints.joints) {
    if (row.tendon < 0 || !model.tendons()[static_cast<size_t>(row.tendon)].is_spatial()) continue;
    if (row.tendon != of)
      inverted.start.tendons().find_curvature(model, row.tendon, inverted.at(), scratch);
    of = row.tendon;
    const std::span<const RowTerm> terms = constraints.terms(row);
    const double y = row_velocity(terms, v_next) + row.law.bias[0];
    double f = 0.0, G = 0.0;
    contact::evaluate(row.law, &y, &f, &G);
    for (size_t j = 0; j < terms.size(); ++j) {
      double y_by_q = 0.0;
      for (size_t m = 0; m < terms.size(); ++m)
        y_by_q += row.along() * scratch(static_cast<int>(m), static_cast<int>(j)) *
                  v_next[terms[m].v_index];
      for (size_t i = 0; i < terms.size(); ++i)
        d.dq(terms[i].v_index, terms[j].v_index) +=
            (terms[i].coefficient * G * y_by_q -
             row.along() * f * scratch(static_cast<int>(i), static_cast<int>(j))) /
            h;
    }
  }
}

}  // namespace counterpoint
