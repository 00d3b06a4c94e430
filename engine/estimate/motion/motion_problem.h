// The sum that a motion estimate minimizes: what was measured, and how sure everything is.
//
//   sum  rho(weight (q_t (-) measured_t))                      measurements
//      + rho(weight (a_t - measured acceleration))             where positions are loose
//      + rho(weight u_t)                                       unexplained forces, sizes of others
//      + 1/2 | weight (u_t - measured u_t) |^2                 joint forces that were measured
//      + 1/2 | weight (u_t - u_{t-1}) |^2                      joint forces change little in a row
//      + rho(weight (sensor - reading))                        sensors (sensor_rows.h)
//      + 1/2 | weight (p - prior p) |^2                        parameters, constants of sensors
//
// rho(r) = 1/2 r^2, or with a scale a robust loss by coordinate (robust_loss.h).
// u_t is the applied force that step_inverse recovers from (q_t, v_t, v_{t+1}), the velocities
// being differences of frames: the motion is a variable, and the contact law is a part of u.
#pragma once

#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/estimate/sensors/robust_loss.h"
#include "counterpoint/engine/estimate/sensors/sensor_rows.h"

namespace counterpoint::estimation {

struct MotionProblem {
  Model model;                ///< parameters at their prior values
  SimulationOptions options;  ///< the last stage's; time_step is the interval of frames [s]

  std::vector<VectorX> measured = {};  ///< one a frame: nq
  MatrixX position_weight = {};        ///< nv x frames [1/m, 1/rad]; 0: not measured
  double loss_scale = 0.0;             ///< c [standard deviations]; 0: squares
  MatrixX acceleration = {};           ///< nv x frames [m/s^2, rad/s^2]
  VectorX acceleration_weight = {};    ///< nv [s^2/m, s^2/rad]; 0: not compared
  MatrixX force = {};                  ///< nv x frames: measured joint forces [N, N m]
  VectorX force_weight = {};           ///< nv [1/N, 1/(N m)]; 0: not measured
  VectorX size_weight = {};            ///< nv [1/N, 1/(N m)]: unexplained forces, sizes of others
  double force_loss_scale = 0.0;       ///< c of `size_weight`'s residuals; 0: squares
  VectorX change_weight = {};          ///< nv [1/N, 1/(N m)]: change of a joint's force in a row

  double start = 0.0;  ///< time of frame 0 [s]
  std::vector<SensorTerm> sensors = {};
  /// Scale of the loss by component of a reading, of all sensors but those of positions, which
  /// have loss_scale itself.
  double sensor_loss_scale = 0.0;
  bool convex_sensor_loss = false;  ///< any reading keeps its pull, however far off it is

  std::vector<StepParameter> parameters = {};
  std::vector<SensorConstant> constants = {};  ///< offsets and delays, told behind parameters
  VectorX parameter_weight = {};  ///< inverse standard deviations of the priors of both
  /// Parameters are not quite constant: standard deviation of what they drift by. It widens
  /// intervals, and nothing else.
  double parameter_drift = 0.0;

  int frames() const { return static_cast<int>(measured.size()); }
  int nv() const { return model.nv(); }
  int num_parameters() const { return static_cast<int>(parameters.size() + constants.size()); }
  SensorFrames sensor_frames(const std::vector<VectorX>& q, const VectorX& values) const {
    return {q, values.tail(static_cast<Eigen::Index>(constants.size())), start, h()};
  }
  RobustLoss sensor_loss() const { return {sensor_loss_scale, convex_sensor_loss}; }
  double h() const { return options.time_step; }
};

/// Configurations of all frames, and differences from their prior values of parameters and of
/// sensors' constants, which come last.
struct MotionPoint {
  std::vector<VectorX> q;
  VectorX parameters;
};

}  // namespace counterpoint::estimation
