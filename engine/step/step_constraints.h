// The constraints of a step, and the velocities that they lead to.
#pragma once

#include "counterpoint/engine/step/step_arguments.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

/// The constraints of all that is awake at `state`, after all are awake that these touch; into
/// ws.constraints. Leaves ws.data at the kinematics of `state`.
void find_constraints(const Model& model, const SimulationOptions& options, EffectSet effects,
                      const State& state, Workspace::Impl& ws);

/// Replaces the velocities of the touched trees in w (nv) by the solution of the contact problem,
/// and adds to ws.constraints what that solution shows to be missing (joint_limits.h,
/// parked_contacts.h). Without constraints w stays. Needs ws.data and ws.diagonal as they are for
/// M.
void solve_constraints(const StepArguments& step, Workspace::Impl& ws, VectorX& w,
                       StepReport& report);

/// The velocities that the bodies are displaced with: w, or where they overlap too far w + p
/// (overlap_correction.h). After solve_constraints; what w + p runs into is added, and w found again with it.
const VectorX& correct_overlaps(const StepArguments& step, Workspace::Impl& ws, VectorX& w,
                                StepReport& report);

}  // namespace counterpoint
