// What a step works with, behind Workspace. Not for users.
#pragma once

#include "counterpoint/contact/laws/cone_lanes.h"
#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/diagnosis/state_check.h"
#include "counterpoint/engine/forces/free_groups.h"
#include "counterpoint/engine/forces/taut_links.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step/overlap_correction.h"
#include "counterpoint/engine/step/sleep.h"
#include "counterpoint/engine/step/softening.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

/// Scratch of the Runge-Kutta method.
struct RungeKuttaStages {
  State at;
  VectorX theta, theta_rate, acceleration, theta_sum, v_sum;
};

/// Scratch of step control.
struct StepControlScratch {
  State whole;                ///< the end of one step in place of two
  VectorX q;                  ///< nv: how far its q is off
  std::vector<char> touched;  ///< by tree: constraints were on it
};

/// @throws InputError unless it is positive and finite.
void check_time_step(double h);

struct DerivativeScratch;  // step_derivatives.cc

struct Workspace::Impl {
  explicit Impl(const Model& model)
      : check(model),
        data(model),
        finder(model, compute_inverse_weights(model, data)),
        sleepers(model),
        start(model),
        free_groups(model),
        other(VectorX::Zero(model.nv())),
        displacement(VectorX::Zero(model.nv())),
        velocity(model.num_bodies()),
        body_impulse(model.num_bodies()),
        velocity_acceleration(model.drags().empty() ? 0 : model.num_bodies()),
        tau(VectorX::Zero(model.nv())),
        diagonal(VectorX::Zero(model.nv())),
        acceleration(VectorX::Zero(model.nv())),
        no_rotors(VectorX::Zero(model.nv())),
        q_middle(model.default_q()),
        middle(VectorX::Zero(model.nv())),
        q_reached(model.default_q()),
        called(called_for(model, finder.collider())),
        taut_links(model, called.has(Effect::kTautLinks)) {}

  PhaseTimes* times = nullptr;  ///< added to by forward steps; none, none is read
  StateCheck check;
  Data data;
  ConstraintFinder finder;
  Sleepers sleepers;
  StepStart start;         ///< what follows from (q, v) alone: only prepare_step changes it
  FreeGroups free_groups;  ///< found by prepare_step
  /// start.constraints(), and what input and solution add to them: limited servos, limits and
  /// contacts that w+ runs into, softer laws.
  ConstraintSet constraints;

  // forward
  VectorX other;  ///< nv: the velocity that forces of the midpoint rule are taken at
  std::vector<int> block_of_tree;
  contact::Problem problem;
  size_t posed_contacts = 0;  ///< the first of the problem's constraints are contacts
  contact::Solver solver;
  OverlapCorrection overlap_correction;
  EqualitySolver equality_solver;
  SoftenedTrees softened_trees;
  // Grown only: Eigen allocates whenever a size changes.
  VectorX w;        ///< velocities of the touched trees, as the problem orders them, then unused
  VectorX impulse;  ///< of all constraints, then unused
  VectorX displacement;  ///< velocities that positions change by, where these are not w+

  // inverse
  std::vector<Motion> velocity;  ///< V at v_next
  std::vector<Force> body_impulse;
  std::vector<double> pair_velocities, pair_impulses;  ///< y and f of the pairs, row by row
  contact::FrictionLanes lanes;                        ///< laws of pairs, four at a time
  PairChain chain;

  std::vector<Motion> velocity_acceleration;  ///< scratch of drag
  VectorX tau, diagonal, acceleration, no_rotors;
  VectorX q_middle, middle, next_middle;  ///< scratch of the midpoint rule
  VectorX q_reached;  ///< nq: the poses at which the velocity after a step is taken (FreeGroups)
  /// nv: that the impulses of a step are functions of: w+, or w_c of the midpoint rule.
  VectorX contact_velocity;
  VectorX not_wanted;  ///< nv: what functions add to that is asked for something else
  RungeKuttaStages stages;
  StepControlScratch control;
  std::shared_ptr<DerivativeScratch> derivatives;  ///< from the first time they are asked for
  EffectSet called;                                ///< what the model calls for
  EffectCounts counts;
  TautLinks taut_links;
  std::vector<Force> joint_force;  ///< by body, scratch of the rates of taut links
};

}  // namespace counterpoint
