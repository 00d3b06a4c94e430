// The inverse step whose derivatives are taken, as invert_step left it.
#pragma once

#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

/// A view of the results of invert_step. Only the scratch memory of the dynamics can be written
/// through it. Derivatives of a part of a step replace single members.
struct InvertedStep {
  const StepStart& start;  ///< with inertias
  const ConstraintFinder& finder;
  const FreeGroups& free_groups;
  const TautLinks& taut_links;
  const StageMotion& stage;  ///< implicit_midpoint: the motion at the middle
  const MidpointVelocities& midpoint;
  const VectorX& contact_velocity;  ///< nv: argument of the impulses: w+, or w_c (midpoint.h)
  DynamicsScratch& scratch;

  const ConstraintSet* constraints;          ///< with the laws that were solved
  const std::vector<Motion>* body_velocity;  ///< V of the bodies at the contact velocity
  bool has_coriolis;                         ///< whether velocity-dependent forces count

  const Kinematics& at() const { return start.kinematics(); }  ///< at (q, v)

  explicit InvertedStep(Workspace::Impl& ws)
      : start(ws.start),
        finder(ws.finder),
        free_groups(ws.free_groups),
        taut_links(ws.taut_links),
        stage(ws.stage),
        midpoint(ws.midpoint),
        contact_velocity(ws.inverse.contact_velocity),
        scratch(ws.motion.scratch),
        constraints(&ws.constraints),
        body_velocity(&ws.inverse.body_velocity),
        has_coriolis(ws.start.velocity_forces().has_coriolis) {}
};

}  // namespace counterpoint
