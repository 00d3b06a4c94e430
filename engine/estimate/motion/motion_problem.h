// Cost of a motion estimate: measurements and priors, weighted by inverse standard deviations.
//
//   sum  rho(weight (q_t (-) measured_t))                      measurements
//      + rho(weight (a_t - measured acceleration))             for slow errors
//      + rho(weight u_t)                                       unexplained and motor forces
//      + 1/2 | weight (u_t - measured u_t) |^2                 measured joint forces
//      + 1/2 | weight (u_t - u_{t-1}) |^2                      change of joint forces per interval
//      + rho(weight (sensor - reading))                        sensors (sensor_rows.h)
//      + 1/2 | weight (p - prior p) |^2                        parameters, constants of sensors
//
// rho(r) = 1/2 r^2, or a robust loss per component if it has a scale (robust_loss.h).
// u_t is the applied force that step_inverse recovers from (q_t, v_t, v_{t+1}); velocities are
// differences of frames. The unknown is the motion; the contact law is part of u.
#pragma once

#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/engine/estimate/sensors/robust_loss.h"
#include "counterpoint/engine/estimate/sensors/sensor_rows.h"

namespace counterpoint::estimation {

struct MotionProblem {
  Model model;                ///< parameters at their prior values
  SimulationOptions options;  ///< options of the last stage; time_step is the interval of frames
                              ///< [s]

  std::vector<VectorX> measured = {};  ///< nq; one per frame
  MatrixX position_weight = {};        ///< nv x frames [1/m, 1/rad]; 0: not measured
  double loss_scale = 0.0;             ///< c [standard deviations]; 0: squares
  MatrixX acceleration = {};           ///< nv x frames [m/s^2, rad/s^2]
  VectorX acceleration_weight = {};    ///< nv [s^2/m, s^2/rad]; 0: not compared
  MatrixX force = {};                  ///< nv x frames: measured joint forces [N, N m]
  VectorX force_weight = {};           ///< nv [1/N, 1/(N m)]; 0: not measured
  VectorX size_weight = {};            ///< nv [1/N, 1/(N m)]: unexplained forces; motor forces
  double force_loss_scale = 0.0;       ///< c of residuals with `size_weight`; 0: squares
  VectorX change_weight = {};          ///< nv [1/N, 1/(N m)]: change of a joint force per interval

  double start = 0.0;  ///< time of frame 0 [s]
  std::vector<SensorTerm> sensors = {};
  /// Loss scale per component of all sensor readings, except those of positions (which use
  /// loss_scale).
  double sensor_loss_scale = 0.0;
  bool convex_sensor_loss = false;  ///< pseudo-Huber loss: outliers keep a constant pull

  /// Parameters, as steps differentiate them at `model`.
  std::vector<StepParameter> parameters = {};
  /// The same by name, with their values in `model`; empty if `parameters` tells all, as it does
  /// where the model is linear in them.
  std::vector<Parameter> named = {};
  VectorX named_values = {};
  std::vector<SensorConstant> constants = {};  ///< offsets and delays, after the parameters
  VectorX parameter_weight = {};               ///< inverse prior standard deviations of both
  /// Standard deviation of the drift of parameters during the recording. It widens intervals and
  /// has no other effect.
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

/// Configurations of all frames; and differences from their prior means of the parameters, followed
/// by the constants of sensors.
struct MotionPoint {
  std::vector<VectorX> q;
  VectorX parameters;
};

}  // namespace counterpoint::estimation
