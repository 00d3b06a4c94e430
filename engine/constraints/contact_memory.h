// Memory of the constraint forces of a step, from which the solver of the next step starts (warm
// start).
//
// It is part of the state (state.h): where friction forces are not unique (a box on four corners),
// it selects one solution, and it always decides the last bits. A step without memory gives the
// same motion within the tolerance of the solver.
#pragma once

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

/// The constraints of a step of h [s] at the poses in `data`, and the contact problem that contains
/// them.
struct PosedConstraints {
  const ConstraintSet& constraints;
  const Kinematics& data;
  const contact::Problem& problem;
  double h;
};

/// Sets the impulses [N s] of the problem's rows to those remembered of the same constraint; the
/// first row of a new constraint is NaN. A contact matches the remembered contact of the same
/// geometries that is nearest in the frame of the moving body. Requires compute_poses.
void recall_impulses(const PosedConstraints& posed, const std::vector<RememberedForce>& memory,
                     Eigen::Ref<VectorX> impulse);

/// The normal force [N] of the contact that matches contacts[i] in the memory; 0 if none does.
/// Requires compute_poses.
double recall_load(const ConstraintSet& constraints, size_t i, const Kinematics& data,
                   const std::vector<RememberedForce>& memory);

/// Stores the forces of the constraints, impulse / h, sorted by constraint. Forces between idle
/// bodies (sleep.h) are copied from `before`.
void remember_impulses(const Model& model, const PosedConstraints& posed, const VectorRef& impulse,
                       SleepMask idle, const std::vector<RememberedForce>& before,
                       std::vector<RememberedForce>& memory);

}  // namespace counterpoint
