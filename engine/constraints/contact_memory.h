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

/// Impulses [N s] for the rows of `problem`, which holds these constraints: those remembered of the
/// same constraint, for a step of h [s]; NaN in the first row of one that is new. A contact is the
/// same where its geometries are and its point, as seen from the body that moves, is the nearest.
/// Needs compute_poses.
void recall_impulses(const ConstraintSet& constraints, const Data& data, double h,
                     const std::vector<RememberedForce>& memory, const contact::Problem& problem,
                     Eigen::Ref<VectorX> impulse);

/// The forces of a step of h [s], of constraints with impulses `impulse`; of idle bodies (sleep.h)
/// those of `before`. Ordered by constraint.
void remember_impulses(const Model& model, const ConstraintSet& constraints, const Data& data,
                       double h, const contact::Problem& problem, const VectorRef& impulse,
                       Idle idle, const std::vector<RememberedForce>& before,
                       std::vector<RememberedForce>& memory);  // Parameters: what it depends on, one by one

}  // namespace counterpoint
