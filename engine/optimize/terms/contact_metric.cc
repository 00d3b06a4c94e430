// Relative changes of contact forces with the next frame, for the damping of Newton steps.
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/terms/evaluator.h"

namespace counterpoint::optimization {

void Evaluator::find_metric(const Stage& stage, MatrixX& out) {
  const double h = problem_->h();
  const ContactOptions& options = stage.options.contact;
  // Normal forces obey f = (-y + sqrt(y^2 + 4 k r)) / 2 r, y the gap at the end of the step over h,
  // and k r = smoothing g compliance (contact_law.h), so that dlog f / dy = -1 / sqrt(y^2 + 4 k r).
  // Where bodies overlap this is only the order of magnitude.
  const double least = 4.0 * options.smoothing * kStandardGravity * options.compliance;
  out.setZero(model_->nv(), model_->nv());
  compute_poses(*model_, q_, at_);
  for (const ContactForce& force : inverse_.contacts) {
    const collision::Candidate& contact = force.contact;
    if (!(force.force.dot(contact.normal) > 0.0)) continue;
    const auto jacobian = [&](int geometry, MatrixX& J) {
      point_jacobian(*model_, at_, model_->geometries()[static_cast<std::size_t>(geometry)].body,
                     contact.position, J);
    };
    jacobian(contact.geometry_a, scratch_.a);
    jacobian(contact.geometry_b, scratch_.b);
    scratch_.b -= scratch_.a;
    value_.noalias() = scratch_.b.transpose() * contact.normal;
    const double y = gap_bias(options, h, contact.gap) + value_.dot(w_);
    weight_ = stage.contact_damping * stage.penalty / (h * h * (y * y + least)) * value_;
    out.noalias() += weight_ * value_.transpose();
  }
}

}  // namespace counterpoint::optimization
