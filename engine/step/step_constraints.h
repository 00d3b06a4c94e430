// The velocities that the constraints of a step lead to.
#pragma once

#include "counterpoint/engine/step/step_start.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

/// Replaces the velocities of the touched trees in w (nv) by the solution of the contact problem,
/// and adds to ws.constraints what that solution shows to be missing (joint_limits.h,
/// parked_contacts.h). Without constraints w stays. Needs ws.data and ws.diagonal as they are for
/// M.
void solve_constraints(const StepArguments& step, Workspace::Impl& ws, VectorX& w,
                       StepReport& report);

/// The velocities that the bodies are displaced with: w, or where they overlap too far w + p
/// (overlap_correction.h). After solve_constraints; what w + p runs into is added, and w found
/// again with it.
const VectorX& correct_overlaps(const StepArguments& step, Workspace::Impl& ws, VectorX& w,
                                StepReport& report);

}  // namespace counterpoint
