// The rows of a motion estimate at one instant, and their derivatives, by one thread.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/engine/estimate/motion/motion_problem.h"
#include "counterpoint/engine/estimate/motion/motion_system.h"
#include "counterpoint/engine/estimate/sensors/force_sensors.h"
#include "counterpoint/engine/optimize/terms/tangent_map.h"

namespace counterpoint::estimation {

/// The step from frame t to t + 1; frames 0 and N are in none.
struct Instant {
  double cost = 0.0;         ///< share of its own rows: all but the change of forces
  VectorX force;             ///< nv: u_t [N, N m]; empty at frames 0 and N
  MatrixX by_frames;         ///< nv x 3 nv: derivatives of u_t by q_{t-1}, q_t, q_{t+1}
  MatrixX by_parameters;     ///< nv x parameters
  VectorX sensed;            ///< residuals of measured forces (force_sensors.h)
  MatrixX sensed_by_frames;  ///< their derivatives by the three frames
};

class InstantModel {
 public:
  InstantModel(const MotionProblem& problem, const Model& model);
  ~InstantModel();

  /// Cost and force of instant t; infinite cost where the inverse has no answer.
  void evaluate(const MotionPoint& point, const SimulationOptions& options, int t, Instant& out);
  /// The force of instant t and its derivatives; those by parameters are zero unless `parameters`.
  void differentiate(const MotionPoint& point, const SimulationOptions& options, int t,
                     bool parameters, Instant& out);
  /// Normal equations of instant t, whose force and that of t - 1 are differentiated.
  void assemble(const MotionPoint& point, const std::vector<Instant>& instants, int t,
                InstantEquations& out);
  /// The inverse of the step at t, its contacts included. Valid until the next call.
  const Inverse& invert(const MotionPoint& point, const SimulationOptions& options, int t);

 private:
  void differentiate_sensed(const MotionPoint& point, const SimulationOptions& options, int t,
                            Instant& out);
  void difference_sensed(const MotionPoint& point, const SimulationOptions& options, int t,
                         Instant& out);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Step of differences of contact forces under these laws [m, rad].
double difference_step(const SimulationOptions& options);

/// The cost of the change of forces from instant t - 1 to t; 0 where there are not both.
double change_cost(const MotionProblem& problem, const std::vector<Instant>& instants, int t);

}  // namespace counterpoint::estimation
