#include "counterpoint/engine/diagnosis/failure_cause.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/dynamics/gravity_compensation.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/forces/servos.h"

namespace counterpoint {
namespace {

ConstraintKind joint_row_kind(const JointConstraint& row) {
  if (row.tendon >= 0) return ConstraintKind::kTendon;
  if (row.actuator >= 0) return ConstraintKind::kActuator;
  switch (row.law.type) {
    case contact::LawType::kEquality:
      return ConstraintKind::kMimic;
    case contact::LawType::kDryFriction:
      return ConstraintKind::kJointFriction;
    default:
      return ConstraintKind::kLimit;
  }
}

/// Returns the fault of constraint c of a problem: pairs come first, then joint rows (assemble.h).
Fault constraint_fault(FaultKind kind, const Model& model, const ConstraintSet& set, int c) {
  Fault fault;
  fault.kind = kind;
  const auto i = static_cast<size_t>(c);
  if (i < set.pairs.size()) {
    fault.body = set.pairs[i].body_a;
    fault.other_body = set.pairs[i].body_b;
    if (i < set.contacts.size()) {
      fault.constraint = ConstraintKind::kContact;
      fault.geometry_a = set.contacts[i].geometry_a;
      fault.geometry_b = set.contacts[i].geometry_b;
    } else {
      fault.constraint = ConstraintKind::kClosure;
      fault.index = set.closures[i - set.contacts.size()].index;
    }
    return fault;
  }
  const JointConstraint& row = set.joints[i - set.pairs.size()];
  fault.constraint = joint_row_kind(row);
  const std::span<const RowTerm> terms = set.terms(row);
  if (row.tendon >= 0) fault.index = row.tendon;
  if (row.actuator >= 0) fault.index = row.actuator;
  fault.coordinate = terms.front().v_index;
  fault.body = body_of_velocity(model, terms.front().v_index);
  if (terms.size() > 1) fault.other_body = body_of_velocity(model, terms.back().v_index);
  return fault;
}

/// Returns the coordinate of v that corresponds to a velocity of the problem.
int coordinate_of(const Model& model, const contact::Problem& problem,
                  const std::vector<int>& block_of_tree, int velocity) {
  for (int t = 0; t < model.num_trees(); ++t) {
    const int block = block_of_tree[t];
    if (block < 0) continue;
    const int offset = velocity - problem.block_start(block);
    if (offset >= 0 && offset < problem.block_size(block)) return model.trees()[t].v_begin + offset;
  }
  return -1;
}

/// Finds a number of the problem that is not finite, or an invalid law.
Fault unposed_fault(const Model& model, const ConstraintSet& constraints,
                    const contact::Problem& problem, const std::vector<int>& block_of_tree) {
  const auto free_velocity = problem.free_velocity();
  for (int i = 0; i < problem.num_velocities(); ++i) {
    if (std::isfinite(free_velocity[i])) continue;
    return velocity_fault(FaultKind::kNewVelocity, model,
                          coordinate_of(model, problem, block_of_tree, i), free_velocity[i]);
  }
  for (int c = 0; c < problem.num_constraints(); ++c) {
    bool good = contact::is_finite(problem.law(c)) && contact::is_valid(problem.law(c));
    for (int side = 0; side < 2; ++side)
      good = good && (problem.block(c, side) < 0 || problem.jacobian(c, side).allFinite());
    if (good) continue;
    Fault fault = constraint_fault(FaultKind::kConstraint, model, constraints, c);
    fault.value = problem.law(c).regularizer;
    return fault;
  }
  return {};
}

/// Finds the first joint at which a block of M is not positive definite.
Fault singular_mass_fault(const Model& model, const contact::Problem& problem,
                          const std::vector<int>& block_of_tree) {
  for (int b = 0; b < problem.num_blocks(); ++b) {
    MatrixX L = problem.mass(b);
    for (int k = 0; k < L.cols(); ++k) {
      const double pivot = L(k, k) - L.row(k).head(k).squaredNorm();
      if (!(pivot > 0.0)) {
        return velocity_fault(
            FaultKind::kSingularInertia, model,
            coordinate_of(model, problem, block_of_tree, problem.block_start(b) + k), pivot);
      }
      L(k, k) = std::sqrt(pivot);
      for (int i = k + 1; i < L.rows(); ++i)
        L(i, k) = (L(i, k) - L.row(i).head(k).dot(L.row(k).head(k))) / L(k, k);
    }
  }
  return {};
}

/// Returns inv(diag M) (M (w - w*) - J' f), the residual of the equation of motion as a velocity.
VectorX missed_velocity(const contact::Problem& problem, const VectorRef& w,
                        const VectorRef& impulse) {
  VectorX missed = VectorX::Zero(problem.num_velocities());
  for (int b = 0; b < problem.num_blocks(); ++b) {
    const int start = problem.block_start(b), size = problem.block_size(b);
    missed.segment(start, size) =
        problem.mass(b) * (w.segment(start, size) - problem.free_velocity().segment(start, size));
  }
  for (int c = 0; c < problem.num_constraints(); ++c) {
    const auto f = impulse.segment(problem.first_row(c), problem.law(c).rows);
    for (int side = 0; side < 2; ++side) {
      const int b = problem.block(c, side);
      if (b < 0) continue;
      missed.segment(problem.block_start(b), problem.block_size(b)) -=
          problem.jacobian(c, side).transpose() * f;
    }
  }
  for (int b = 0; b < problem.num_blocks(); ++b) {
    missed.segment(problem.block_start(b), problem.block_size(b)).array() /=
        problem.mass(b).diagonal().array();
  }
  return missed;
}

Fault unsolved_fault(const Model& model, const ConstraintSet& constraints,
                     const contact::Problem& problem, const VectorRef& w,
                     const VectorRef& impulse) {
  const VectorX missed = missed_velocity(problem, w, impulse);
  int worst = 0;
  double largest = -1.0;
  for (int c = 0; c < problem.num_constraints() && !std::isnan(largest); ++c) {
    contact::Rows y = contact::Rows::Zero(problem.law(c).rows);
    for (int side = 0; side < 2; ++side) {
      const int b = problem.block(c, side);
      if (b < 0) continue;
      y +=
          problem.jacobian(c, side) * missed.segment(problem.block_start(b), problem.block_size(b));
    }
    const double here = y.lpNorm<Eigen::Infinity>();
    if (here <= largest) continue;  // NaN counts as the largest residual
    largest = here;
    worst = c;
  }
  Fault fault = constraint_fault(FaultKind::kUnsolved, model, constraints, worst);
  fault.value = largest;
  return fault;
}

/// Work [J] of the servos and springs of a tree in the step that ends at `next`, with the implicit
/// forces of the step.
double work_of_joint_forces(const Model& model, const Tree& tree, double h, const State& state,
                            const Input& input, const State& next) {
  double work = 0.0;
  const auto add = [&](int joint, double force) {
    const Body& body = model.body(joint + 1);
    if (body.v_index < tree.v_begin || body.v_index >= tree.v_end) return;
    work += 0.5 * h * force * (state.v[body.v_index] + next.v[body.v_index]);
  };
  VectorX servo_force(static_cast<Eigen::Index>(model.servos().size()));
  compute_servo_forces(model, h, state.q, next.v, input, servo_force);
  for (Eigen::Index i = 0; i < servo_force.size(); ++i) {
    const int joint = model.servos()[i].joint;
    const double limit = model.joint(joint).effort_limit;
    add(joint, std::clamp(servo_force[i], -limit, limit));
  }
  for (const JointSpring& spring : model.springs()) {
    const Body& body = model.body(spring.joint + 1);
    add(spring.joint,
        -spring.stiffness * (state.q[body.q_index] + h * next.v[body.v_index] - spring.reference));
  }
  return work;
}

}  // namespace

Fault singular_inertia_fault(const Model& model, int body, const VectorRef& diagonal,
                             const Kinematics& at, const DynamicsScratch& scratch) {
  const Body& moved = model.body(body);
  const int nv = joint_nv(moved.joint_type);
  MatrixX D = MatrixX::Zero(nv, nv);
  for (int j = 0; j < nv; ++j) {
    const Force column = scratch.IA[body] * at.axis[moved.v_index + j];
    for (int i = 0; i < nv; ++i) D(i, j) = dot(at.axis[moved.v_index + i], column);
    D(j, j) += diagonal[moved.v_index + j];
  }
  Fault fault;
  fault.kind = FaultKind::kSingularInertia;
  fault.body = body;
  fault.coordinate = moved.v_index;
  fault.value = nv == 1 || !D.allFinite()
                    ? D(0, 0)
                    : Eigen::SelfAdjointEigenSolver<MatrixX>(D, Eigen::EigenvaluesOnly)
                          .eigenvalues()
                          .minCoeff();
  return fault;
}

Fault solver_fault(const Model& model, contact::Status status, const ConstraintSet& constraints,
                   const contact::Problem& problem, const std::vector<int>& block_of_tree,
                   const VectorRef& w, const VectorRef& impulse) {
  Fault fault;
  if (status == contact::Status::kNotFinite || status == contact::Status::kInvalidLaw)
    fault = unposed_fault(model, constraints, problem, block_of_tree);
  if (status == contact::Status::kSingular)
    fault = singular_mass_fault(model, problem, block_of_tree);
  if (fault.any()) return fault;
  return unsolved_fault(model, constraints, problem, w, impulse);
}

SpeedCause speed_cause(const Model& model, double h, const Fault& fault, double reach,
                       const State& state, const Input& input, const State& next) {
  if (!(std::abs(state.v[fault.coordinate]) * reach < fault.bound)) return SpeedCause::kGiven;
  Kinematics at(model);
  compute_poses(model, state.q, at);
  compute_velocities(model, state.v, at);
  compute_inertias(model, at);
  std::vector<Motion> V_next(static_cast<size_t>(model.num_bodies()));
  const Tree& tree = model.trees()[model.body(fault.body).tree];
  compute_body_velocities(model, next.v, at, V_next);
  double gained = 0.0, work = work_of_joint_forces(model, tree, h, state, input, next);
  const auto mean_velocity = [&](int b, const Vector3& arm) -> Vector3 {
    return 0.5 * (at.V[b].at(arm) + V_next[b].at(arm));
  };
  for (int b = tree.body_begin; b < tree.body_end; ++b) {
    const SpatialInertia& inertia = at.inertia[b];
    gained += 0.5 * dot(V_next[b], inertia * V_next[b]) - 0.5 * dot(at.V[b], inertia * at.V[b]);
    work += h * inertia.mass * model.gravity().dot(mean_velocity(b, inertia.center));
  }
  for (const GravityCompensation& carried :
       compensations_of(model, {tree.body_begin, tree.body_end}))
    work -=
        h * carried.mass * model.gravity().dot(mean_velocity(carried.body, arm_of(carried, at)));
  for (int k = tree.v_begin; k < tree.v_end && input.applied_force.size() > 0; ++k)
    work += 0.5 * h * input.applied_force[k] * (state.v[k] + next.v[k]);
  for (const ExternalWrench& w : input.wrenches) {
    if (w.body < tree.body_begin || w.body >= tree.body_end) continue;
    const Vector3 turned = 0.5 * (at.V[w.body].angular + V_next[w.body].angular);
    work += h * (w.wrench.force.dot(mean_velocity(w.body, at.X_WB[w.body].rotation * w.point)) +
                 w.wrench.torque.dot(turned));
  }
  return work >= 0.5 * gained ? SpeedCause::kDriven : SpeedCause::kStep;
}

}  // namespace counterpoint
