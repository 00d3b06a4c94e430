// Relative changes of contact forces with the next frame, for the damping of Newton steps.
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/optimize/terms/evaluator.h"

namespace counterpoint::optimization {

void Evaluator::find_metric(const Stage& stage, MatrixX& out) {
  const double h = h_;
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
    value_.setZero(model_->nv());
    const auto add = [&](int geometry, const Vector3& direction) {
      add_point_speed(*model_, at_, model_->geometries()[static_cast<std::size_t>(geometry)].body,
                      contact.position, direction, value_);
    };
    add(contact.geometry_b, contact.normal);
    add(contact.geometry_a, -contact.normal);
    const double y = gap_bias(options, h, contact.gap) + value_.dot(w_);
    const double weight = stage.contact_damping * stage.penalty / (h * h * (y * y + least));
    for (Eigen::Index j = 0; j < value_.size(); ++j)
      if (value_[j] != 0.0) out.col(j) += weight * value_[j] * value_;
  }
}

}  // namespace counterpoint::optimization
