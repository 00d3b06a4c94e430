// Which constraint, joint or force caused a step to fail. Run after a failure only: it may
// allocate, and nothing in it shapes a motion.
#pragma once

#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step.h"

namespace counterpoint {

/// The joint of `body`, at which ABA found no inertia: `value` is what it found [kg, kg m^2], the
/// least eigenvalue where there are several coordinates. Of the data that it left.
Fault singular_inertia_fault(const Model& model, int body, const VectorRef& diagonal,
                             const Kinematics& at, const DynamicsScratch& scratch);

/// Why the solver failed with `status` on the problem of these constraints: a constraint that
/// cannot be posed, a free velocity that is not finite, or the constraint at which the equation of
/// motion is missed most, as a velocity (J inv(diag M) (M (w - w*) - J' f), the largest row). w,
/// impulse: as the solver left them, in its order. block_of_tree: as assemble_problem made it.
Fault solver_fault(const Model& model, contact::Status status, const ConstraintSet& constraints,
                   const contact::Problem& problem, const std::vector<int>& block_of_tree,
                   const VectorRef& w,
                   const VectorRef& impulse);  // Parameters: what it depends on, one by one

/// Finds why the coordinate of a kSpeed fault became so fast between state and next, over a step of
/// h [s]. reach: see StateCheck.
SpeedCause speed_cause(const Model& model, double h, const Fault& fault, double reach,
                       const State& state, const Input& input, const State& next);

}  // namespace counterpoint
