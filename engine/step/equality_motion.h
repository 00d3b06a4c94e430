// Motion under closures and mimic joints without compliance, for integrators of smooth forces.
//
// Index reduction: accelerations satisfy the second derivative of the closures' error,
//
//   M a = M a_free - J' f,    J a + dJ/dt w = 0
//
// with f minus the impulse of contact/problem.h. The error that the steps accumulate is removed by
// projection in the metric of M, first of q (Newton's method on the error), then of w (J w = 0).
// Projection keeps a method's order (Hairer, Lubich and Wanner, Geometric Numerical Integration,
// IV.4).
#pragma once

#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

/// Whether closures or mimic joints act at internal states z (nz).
bool has_equalities(const Model& model, EffectSet effects, const VectorRef& z);

/// Motion under closures and mimic joints. It writes constraints, solution, equality_solver,
/// stage.at, displacement and counts of a workspace.
class EqualityMotion {
 public:
  explicit EqualityMotion(Workspace::Impl& ws) : ws_(ws) {}

  /// Turns the accelerations (nv) of the smooth motion at (q, v), whose kinematics are in ws.stage,
  /// into those under its closures and mimic joints.
  void constrain_acceleration(const StepContext& at, VectorX& acceleration, StepReport& report);

  /// Projects (q, w) of a state onto its closures and mimic joints, by no more than h times
  /// max_recovery_speed, so that a closure that starts open closes gradually. Returns the largest
  /// error before the projection [m or rad].
  double project(const StepArguments& step, State& state, StepReport& report);

 private:
  bool solve(const Model& model, EffectSet effects, VectorX& x);
  void find(const StepContext& at);

  Workspace::Impl& ws_;
};

}  // namespace counterpoint
