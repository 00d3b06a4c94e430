#include "counterpoint/engine/derivatives/step/center_terms.h"

#include "counterpoint/engine/derivatives/dynamics/rotation_maps.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

/// Calls visit(first coordinate, axes in W) for the base of each tree of a group.
template <class Visit>
void for_each_base(const Model& model, const FreeGroups::Group& group, Visit visit) {
  for (const int t : group.trees) {
    const Body& root = model.body(model.trees()[static_cast<size_t>(t)].body_begin);
    visit(root.v_index, root.X_PJ.rotation);
  }
}

/// Subtracts the rows of forces on the bases, in W, from `out`.
void subtract_base_rows(const Model& model, const FreeGroups::Group& group, const MatrixX& d,
                        MatrixX& out) {
  for_each_base(model, group, [&](int first, const Matrix3& R) {
    out.noalias() -= R.lazyProduct(d.middleRows<3>(first));
  });
}

/// Adds rows given in W to the rows of the bases in d.
void add_to_bases(const Model& model, const FreeGroups::Group& group, const MatrixX& rows,
                  MatrixX& d) {
  for_each_base(model, group, [&](int first, const Matrix3& R) {
    d.middleRows<3>(first).noalias() += R.transpose().lazyProduct(rows);
  });
}

}  // namespace

CenterTerms::CenterTerms(const Model& model)
    : data_(model),
      V_(static_cast<size_t>(model.num_bodies())),
      subtrees_(V_.size()),
      rows_(3, model.nv()),
      by_pose_(3, model.nv()),
      w_(VectorX::Zero(model.nv())),
      r_(w_),
      q_(model.default_q()) {
  for (MomentumDerivatives* m : {&start_, &middle_, &end_}) {
    m->J.setZero(3, model.nv());
    m->H.setZero(3, model.nv());
  }
}

/// Writes the columns of a joint. A displacement of it rotates or moves everything it carries,
/// including velocities relative to the parent; translations of a joint come before its rotation.
void CenterTerms::write_columns(const Model& model, const FreeGroups::Group& group, int i,
                                MomentumDerivatives& out) const {
  const Body& body = model.body(i);
  const Subtree& all = subtrees_[static_cast<size_t>(i)];
  const int linear = joint_num_linear(body.joint_type), nv = joint_nv(body.joint_type);
  const Motion* axis = &data_.axis[static_cast<size_t>(body.v_index)];
  Motion before;  // velocity that precedes the joint's rotation, at the body's origin
  if (body.parent != 0)
    before = shift(V_[static_cast<size_t>(body.parent)], data_.arm[static_cast<size_t>(i)]);
  for (int j = 0; j < linear; ++j) {
    const Vector3& e = axis[j].linear;
    out.J.col(body.v_index + j) = all.mass * e;
    out.H.col(body.v_index + j) = all.mass * before.angular.cross(e);
  }
  // Include the joint's own translation.
  if (linear > 0) before.linear = V_[static_cast<size_t>(i)].linear;
  const Vector3 arm = data_.X_WB[static_cast<size_t>(i)].translation - group.origin;
  const Vector3 moment = all.moment - all.mass * arm;
  const Vector3 relative = all.momentum - all.mass * before.linear - before.angular.cross(moment);
  for (int j = linear; j < nv; ++j) {
    const Vector3& e = axis[j].angular;
    const Vector3 moved = e.cross(moment);
    out.J.col(body.v_index + j) = moved;
    out.H.col(body.v_index + j) = before.angular.cross(moved) + e.cross(relative);
  }
}

void CenterTerms::find(const Model& model, const FreeGroups::Group& group, const VectorRef& q,
                       const VectorRef& v, MomentumDerivatives& out) {
  out.J.setZero();
  out.H.setZero();
  for (const int t : group.trees) {
    const Tree& tree = model.trees()[static_cast<size_t>(t)];
    const BodyRange bodies = {tree.body_begin, tree.body_end};
    compute_poses(model, q, bodies, data_);
    compute_body_velocities(model, v, bodies, data_, V_);
    for (int i = bodies.begin; i < bodies.end; ++i) {
      const SpatialInertia& inertia = model.body(i).inertia;
      const Pose& X = data_.X_WB[static_cast<size_t>(i)];
      const Vector3 center = X.rotation * inertia.center;
      subtrees_[static_cast<size_t>(i)] = {inertia.mass,
                                           inertia.mass * (X.translation - group.origin + center),
                                           inertia.mass * V_[static_cast<size_t>(i)].at(center)};
    }
    for (int i = bodies.end - 1; i >= bodies.begin; --i) {
      write_columns(model, group, i, out);
      const int parent = model.body(i).parent;
      if (parent == 0) continue;
      const Subtree& from = subtrees_[static_cast<size_t>(i)];
      Subtree& to = subtrees_[static_cast<size_t>(parent)];
      to.mass += from.mass;
      to.moment += from.moment;
      to.momentum += from.momentum;
    }
  }
}

const VectorX& CenterTerms::find_step_velocity(const InverseArguments& of, const FreeGroups& groups,
                                               const Kinematics& at, InverseScratch& inverse,
                                               VectorX& w_m) {
  w_ = of.v_next;
  const bool euler = of.options.integrator == Integrator::kSemiImplicitEuler;
  for (const FreeGroups::Group& group : groups.groups())
    for_each_base(of.model, group, [&](int first, const Matrix3& R) {
      const Vector3 more = of.h() * (R.transpose() * group.shift);
      w_.segment<3>(first) += more;
      if (euler) return;
      w_m.segment<3>(first) += 0.5 * more;
      inverse.contact_velocity.segment<3>(first) += 0.5 * more;
    });
  if (euler) compute_body_velocities(of.model, w_, at, inverse.body_velocity);
  return w_;
}

void CenterTerms::correct_inverse(const InverseArguments& of, const ConstrainedMidpoint* impulses,
                                  const InvertedStep& inverted, InverseDerivatives& d) {
  const Model& model = of.model;
  const double h = of.h();
  const bool midpoint = of.options.integrator == Integrator::kImplicitMidpoint;
  r_ = h * inverted.contact_velocity;
  integrate_configuration(model, of.q, inverted.contact_velocity, h, q_);
  for (const FreeGroups::Group& group : inverted.free_groups.groups()) {
    find(model, group, of.q, of.v, start_);
    find(model, group, q_, of.v_next, end_);
    const Rows* at_forces = &start_.J;
    if (midpoint) {
      find(model, group, inverted.midpoint.at_q, of.v, middle_);
      at_forces = &middle_.J;
    }
    by_pose_ = end_.H;
    multiply_columns(model, RotationMap::kQ, r_, by_pose_);  // derivative by w
    by_pose_ *= h;
    const auto add = [&](MatrixX& part) {
      rows_ /= h;
      subtract_base_rows(model, group, part, rows_);
      rows_ /= group.mass;
      part.noalias() += at_forces->transpose().lazyProduct(rows_);
    };
    // Derivative by v+ through the velocity that moves poses: v+, the mean of both ends (midpoint
    // rule), or w of the midpoint rule with constraints.
    rows_ = end_.J;
    if (impulses != nullptr) {
      rows_.noalias() += by_pose_.lazyProduct(impulses->w_next);
    } else {
      rows_ += (midpoint ? 0.5 : 1.0) * by_pose_;
    }
    add(d.dv_next);
    if (d.by_differences) continue;
    rows_ = -start_.J;
    if (impulses != nullptr) {
      rows_.noalias() += by_pose_.lazyProduct(impulses->w_v);
    } else if (midpoint) {
      rows_ += 0.5 * by_pose_;
    }
    add(d.dv);
    rows_ = end_.H;
    multiply_columns(model, RotationMap::kP, r_, rows_);
    rows_ -= start_.H;
    if (impulses != nullptr) rows_.noalias() += by_pose_.lazyProduct(impulses->w_q);
    add(d.dq);
  }
}

/// Adds factor times the derivatives of a group's momentum by inertial parameters to
/// parameter_rows_, at the kinematics of the last find().
void CenterTerms::add_momentum(std::span<const StepParameter> parameters, const Model& model,
                               const FreeGroups::Group& group, double factor) {
  for (size_t k = 0; k < parameters.size(); ++k) {
    const StepParameter& p = parameters[k];
    if (p.kind != StepParameterKind::kInertia) continue;
    for (size_t i = 0; i < p.targets.size(); ++i) {
      const auto body = static_cast<size_t>(p.targets[i]);
      if (!group.holds(model.body(p.targets[i]).tree)) continue;
      const Vector3 moment = data_.X_WB[body].rotation * p.changes[i].segment<3>(1);
      parameter_rows_.col(static_cast<Eigen::Index>(k)) +=
          factor * (p.changes[i][0] * V_[body].linear + V_[body].angular.cross(moment));
    }
  }
}

void CenterTerms::correct_parameters(std::span<const StepParameter> parameters,
                                     const InverseArguments& of, const InvertedStep& inverted,
                                     const std::vector<char>& by_differences, MatrixX& du) {
  const Model& model = of.model;
  const double h = of.h();
  const bool heavy = of.effects.has(Effect::kGravity);
  integrate_configuration(model, of.q, inverted.contact_velocity, h, q_);
  for (const FreeGroups::Group& group : inverted.free_groups.groups()) {
    parameter_rows_.setZero(3, du.cols());
    find(model, group, q_, of.v_next, end_);
    add_momentum(parameters, model, group, 1.0 / h);
    find(model, group, of.q, of.v, start_);
    add_momentum(parameters, model, group, -1.0 / h);
    for (size_t k = 0; k < parameters.size(); ++k) {
      if (by_differences[k]) continue;
      const StepParameter& p = parameters[k];
      const auto column = static_cast<Eigen::Index>(k);
      Vector3 row = parameter_rows_.col(column);
      // The weight is part of the outer force F, not of u.
      for (size_t i = 0; heavy && p.kind == StepParameterKind::kInertia && i < p.targets.size();
           ++i)
        if (group.holds(model.body(p.targets[i]).tree)) row -= p.changes[i][0] * model.gravity();
      if (heavy && p.kind == StepParameterKind::kGravity)
        row -= group.heavy_mass * model.gravity().normalized();
      for_each_base(model, group, [&](int first, const Matrix3& R) {
        row -= R * du.col(column).segment<3>(first);
      });
      du.col(column).noalias() += start_.J.transpose().lazyProduct(row / group.mass);
    }
  }
}

void CenterTerms::correct_forward(const StepContext& at, const VectorRef& q_next,
                                  const VectorRef& v_next, const FreeGroups& groups,
                                  ForwardDerivatives& d) {
  const Model& model = at.model;
  const double h = at.h();
  const Integrator integrator = at.options.integrator;
  const bool euler = integrator == Integrator::kSemiImplicitEuler;
  if (euler && !at.options.mean_velocity_forces) return;
  const double of_start = euler ? 0.0 : 0.5;  // share of the velocity at the start
  for (const FreeGroups::Group& group : groups.groups()) {
    find(model, group, at.q, at.v, start_);
    find(model, group, q_next, v_next, end_);
    // set_gain sets rows_ to the derivative of the momentum after the step by q, v or u.
    const auto correct = [&](const auto& set_gain, const Rows* before, MatrixX& dq, MatrixX& dv,
                             bool by_q) {
      if (integrator == Integrator::kRungeKutta4) {
        set_gain();
        rows_.noalias() -= end_.J.lazyProduct(dv);
        rows_.noalias() -= end_.H.lazyProduct(dq);
        rows_ /= group.mass;
        add_to_bases(model, group, rows_, dv);
      }
      set_gain();
      rows_ *= h * (1.0 - of_start);
      if (before != nullptr) rows_ += h * of_start * *before;
      if (by_q) rows_ += start_.J;
      rows_.noalias() -= end_.J.lazyProduct(dq);
      rows_ /= group.mass;
      add_to_bases(model, group, rows_, dq);
    };
    correct([&] { rows_ = start_.H; }, &start_.H, d.dq_dq, d.dv_dq, true);
    correct([&] { rows_ = start_.J; }, &start_.J, d.dq_dv, d.dv_dv, false);
    const auto by_force = [&] {
      rows_.setZero();
      for_each_base(model, group,
                    [&](int first, const Matrix3& R) { rows_.middleCols<3>(first) = h * R; });
    };
    correct(by_force, nullptr, d.dq_du, d.dv_du, false);
  }
}

}  // namespace counterpoint
