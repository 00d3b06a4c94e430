// Finds the constraint, joint or force that caused a step to fail. Called after a failure only: it
// may allocate, and does not affect any motion.
#pragma once

#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step.h"

namespace counterpoint {

/// Returns the fault of a body whose joint moves no inertia, after ABA failed. value: the inertia
/// along the joint [kg, kg m^2], the least eigenvalue if it has several coordinates, from the IA
/// that ABA left in `data`.
Fault singular_inertia_fault(const Model& model, int body, const VectorRef& diagonal,
                             const Kinematics& at, const DynamicsScratch& scratch);

/// Finds why the solver failed with `status` on the problem of these constraints: a constraint that
/// is not valid, a free velocity that is not finite, or the constraint with the largest residual of
/// the equation of motion as a velocity (largest row of J inv(diag M) (M (w - w*) - J' f)). w,
/// impulse: as the solver left them, in its order. block_of_tree: as assemble_problem set it.
Fault solver_fault(const Model& model, contact::Status status, const ConstraintSet& constraints,
                   const contact::Problem& problem, const std::vector<int>& block_of_tree,
                   const VectorRef& w, const VectorRef& impulse);

/// Finds why the coordinate of a kSpeed fault became so fast between state and next, over a step of
/// h [s]. reach: see StateCheck.
SpeedCause speed_cause(const Model& model, double h, const Fault& fault, double reach,
                       const State& state, const Input& input, const State& next);

}  // namespace counterpoint
