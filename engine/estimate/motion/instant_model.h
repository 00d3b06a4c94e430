// Residuals of a motion estimate at one instant, and their derivatives; one object per thread.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/engine/estimate/motion/motion_problem.h"
#include "counterpoint/engine/estimate/motion/motion_system.h"
#include "counterpoint/engine/estimate/sensors/force_sensors.h"
#include "counterpoint/engine/optimize/terms/tangent_map.h"

namespace counterpoint::estimation {

/// The step from frame t to t + 1. The first and the last frame have none.
struct Instant {
  double cost = 0.0;      ///< cost of the instant's residuals except the change of forces
  VectorX force;          ///< nv: applied force u_t [N, N m]; empty at the first and last frame
  MatrixX by_frames;      ///< nv x 3 nv: derivatives of u_t with respect to q_{t-1}, q_t, q_{t+1}
  MatrixX by_parameters;  ///< nv x parameters: derivatives of u_t
  VectorX sensed;         ///< residuals of measured forces (force_sensors.h)
  MatrixX sensed_by_frames;      ///< derivatives of `sensed` with respect to the three frames
  MatrixX sensed_by_parameters;  ///< and to the parameters, of joint forces, and the constants
};

class InstantModel {
 public:
  /// model: with the parameters at their current values; parameters: as steps differentiate them
  /// there, by default as the problem has them.
  InstantModel(const MotionProblem& problem, const Model& model,
               const std::vector<StepParameter>& parameters);
  InstantModel(const MotionProblem& problem, const Model& model)
      : InstantModel(problem, model, problem.parameters) {}
  ~InstantModel();

  /// Computes cost and force of instant t; infinite cost if inverse dynamics fails.
  void evaluate(const MotionPoint& point, const SimulationOptions& options, int t, Instant& out);
  /// Computes the force of instant t and its derivatives; those with respect to parameters stay
  /// zero unless `parameters`.
  void differentiate(const MotionPoint& point, const SimulationOptions& options, int t,
                     bool parameters, Instant& out);
  /// Builds the normal equations of instant t. Needs differentiate() of instants t and t - 1.
  void assemble(const MotionPoint& point, const std::vector<Instant>& instants, int t,
                InstantEquations& out);
  /// Returns inverse dynamics at frame t, contacts included. Valid until the next call.
  const Inverse& invert(const MotionPoint& point, const SimulationOptions& options, int t);

 private:
  void differentiate_sensed(const MotionPoint& point, const SimulationOptions& options, int t,
                            Instant& out);
  void difference_sensed(const MotionPoint& point, const SimulationOptions& options, int t,
                         Instant& out);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Step of finite differences of contact forces under these laws [m, rad].
double difference_step(const SimulationOptions& options);

/// Cost of the change of forces from instant t - 1 to t; 0 if one of them does not exist.
double change_cost(const MotionProblem& problem, const std::vector<Instant>& instants, int t);

}  // namespace counterpoint::estimation
