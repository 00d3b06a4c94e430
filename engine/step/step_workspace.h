// The memory of a step behind Workspace. Outputs of stages have members of their own; scratch
// members are shared, and hold a value only within one function.
#pragma once

#include <memory>

#include "counterpoint/contact/laws/cone_lanes.h"
#include "counterpoint/contact/thread_pool.h"
#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/diagnosis/state_check.h"
#include "counterpoint/engine/dynamics/equality_solver.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/forces/actuators.h"
#include "counterpoint/engine/forces/free_groups.h"
#include "counterpoint/engine/forces/taut_links.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step/overlap_correction.h"
#include "counterpoint/engine/step/sleep.h"
#include "counterpoint/engine/step/step_constraints.h"
#include "counterpoint/engine/step/step_forces.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

/// The midpoint rule's velocities w_m (nv) and their scratch (midpoint.h).
struct MidpointVelocities {
  VectorX w_m;       ///< velocity at the middle without the share of equalities
  VectorX next_w_m;  ///< next iterate
  VectorX at_w;      ///< w_m and the share of equalities: forces are taken here
  VectorX at_q;      ///< nq: poses at the middle
  VectorX w_c;       ///< velocity that the constraints saw
};

/// Scratch memory of the Runge-Kutta method.
struct RungeKuttaStages {
  State at;
  VectorX theta, theta_rate, acceleration, theta_sum, v_sum;
};

/// Scratch memory of step control (step_control.cc).
struct StepControlScratch {
  State whole;                ///< end of one step in place of two half steps
  VectorX q;                  ///< nv: difference of its q
  std::vector<char> touched;  ///< per tree: constraints acted on it
};

/// Results and scratch memory of the inverse.
struct InverseScratch {
  explicit InverseScratch(const Model& model)
      : body_velocity(model.num_bodies()),
        body_impulse(model.num_bodies()),
        tau(VectorX::Zero(model.nv())),
        acceleration(VectorX::Zero(model.nv())) {}

  VectorX contact_velocity;           ///< nv: argument of the impulses: w+, or w_c (midpoint.h)
  std::vector<Motion> body_velocity;  ///< V of the bodies at it
  std::vector<Force> body_impulse;
  std::vector<double> pair_velocities, pair_impulses;  ///< y and f of the pairs, row by row
  contact::FrictionLanes lanes;                        ///< laws of pairs, four at a time
  PairChain chain;
  VectorX tau, acceleration;  ///< nv
  VectorX discarded;          ///< nv: output that this caller ignores
};

/// Finds the forces of actuators, adds their rows to ws.constraints, and returns the arguments of
/// the step with their wrenches as input. Call after prepare_step.
StepArguments actuate(const StepArguments& step, Workspace::Impl& ws);
InverseArguments actuate(const InverseArguments& step, Workspace::Impl& ws);

/// Throws InputError unless the time step [s] is positive and finite.
void check_time_step(double h);

struct DerivativeScratch;  // step_derivatives.cc

struct Workspace::Impl {
  explicit Impl(const Model& model)
      : check(model),
        finder(model, inverse_weights_of(model)),
        sleepers(model),
        start(model),
        prescribed(model),
        actuators(model),
        free_groups(model),
        motion(model),
        stage(model),
        no_velocity_forces(model),
        displacement(VectorX::Zero(model.nv())),
        q_reached(model.default_q()),
        inverse(model),
        called(called_for(model, finder.collider())),
        taut_links(model, called.has(Effect::kTautLinks)) {
    midpoint.w_m = midpoint.at_w = VectorX::Zero(model.nv());
    midpoint.at_q = model.default_q();
    no_velocity_forces.has_coriolis = false;
  }

  PhaseTimes* times = nullptr;                ///< forward steps add to it, unless it is null
  std::unique_ptr<contact::ThreadPool> pool;  ///< shares the work of forward steps; may be null
  StateCheck check;
  ConstraintFinder finder;
  Sleepers sleepers;
  VectorX z;        ///< nz: internal states at which the step acts
  StepStart start;  ///< written by prepare_step
  PrescribedMotion prescribed;
  Actuators actuators;     ///< found by actuate
  Input actuated;          ///< input of the step with the wrenches of actuators
  VectorX actuator_force;  ///< per actuator, in a forward step [N, N m]
  FreeGroups free_groups;  ///< found by prepare_step
  /// start.constraints() and the rows that input and solution add: limited servos, limits and
  /// contacts that w+ reaches. The inverse also softens laws here; the forward step softens them in
  /// solution.problem.
  ConstraintSet constraints;

  // Forward.
  FreeMotion motion;  ///< forces and the dynamics that use them
  StageMotion stage;  ///< kinematics within the step
  MidpointVelocities midpoint;
  VelocityForces no_velocity_forces;
  ContactSolution solution;
  OverlapCorrection overlap_correction;
  EqualitySolver equality_solver;
  /// Velocities (nv) that displace the bodies, where these are not w+ (semi-implicit Euler);
  /// scratch of runge_kutta_4.
  VectorX displacement;
  VectorX q_reached;  ///< nq: poses at which the velocity after a step is taken (FreeGroups)
  RungeKuttaStages stages;
  StepControlScratch control;
  std::vector<Force> joint_force;  ///< per body: scratch of the rates of taut links

  InverseScratch inverse;
  std::shared_ptr<DerivativeScratch> derivatives;  ///< made when derivatives are first asked for

  EffectSet called;  ///< effects that the model calls for
  EffectCounts counts;
  TautLinks taut_links;

  /// The state of the bodies at (q, v) as the recursive algorithms read it.
  BodyState bodies() {
    return {start.kinematics(), start.velocity_forces(), motion.external, motion.scratch};
  }

 private:
  static InverseWeights inverse_weights_of(const Model& model) {
    Data data(model);
    return compute_inverse_weights(model, data);
  }
};

}  // namespace counterpoint
