// Switched closures: which of them act in a step, and which break at its end.
//
// The switch is thrown at the start of a step, so that everything that acts in it follows from the
// state and the input there, which the inverse knows too. Breaking follows from the mean force over
// the step. The inverse finds the same forces up to rounding and the tolerance of the solver, so
// that the two may differ only in a step whose force is that close to the limit; a recorded motion
// has the internal states of every step, and its inverse takes these.
#pragma once

#include <span>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/step.h"

namespace counterpoint {

/// Changes z (nz) from the internal states before a step to those at which it acts: attaches and
/// releases closures as Input::attach says. Closures in place that it attaches get the pose of
/// their bodies at q (nq). @throws InputError where the size is not the model's, z has a state that
/// no closure can be in, or an input is none of 0, 1 and NaN.
void switch_closures(const Model& model, const VectorRef& q, const VectorX& attach, VectorX& z);

/// Marks those closures as broken in z (nz) whose force [N] or torque [N m], mean over a step of
/// h [s], was larger than they bear. impulse: of all rows of the problem.
void break_closures(const Model& model, const ConstraintSet& constraints,
                    const contact::Problem& problem, const VectorX& impulse, double h, VectorX& z);
/// The same from the forces of all closures.
void break_closures(const Model& model, std::span<const ClosureForce> forces, VectorX& z);

}  // namespace counterpoint
