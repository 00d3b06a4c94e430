// What a step remembers of its constraints' forces, so that the next one starts from them.
//
// Part of the state (state.h): where friction forces are not unique (a box on four corners), the
// memory decides between them, and in any case it decides the last bits. A step without memory
// comes to the same motion within the solver's tolerance.
#pragma once

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

/// The constraints of a step of h [s], at the poses in `data`, and the problem that holds them.
struct PosedConstraints {
  const ConstraintSet& constraints;
  const Kinematics& data;
  const contact::Problem& problem;
  double h;
};

/// Impulses [N s] for the rows of the problem: those remembered of the same constraint; NaN in the
/// first row of one that is new. A contact is the
/// same where its geometries are and its point, as seen from the body that moves, is the nearest.
/// Needs compute_poses.
void recall_impulses(const PosedConstraints& posed, const std::vector<RememberedForce>& memory,
                     Eigen::Ref<VectorX> impulse);

/// The forces of constraints with impulses `impulse`; of idle bodies (sleep.h) those of `before`.
/// Ordered by constraint.
void remember_impulses(const Model& model, const PosedConstraints& posed, const VectorRef& impulse,
                       Idle idle, const std::vector<RememberedForce>& before,
                       std::vector<RememberedForce>& memory);

}  // namespace counterpoint
