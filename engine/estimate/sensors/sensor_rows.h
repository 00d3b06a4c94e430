// Residuals of sensors at one frame, and their derivatives, by one thread.
//
//   point               p(q_t) - z
//   orientation         log(R_z' R(q_t))
//   coordinate          q_t - z
//   angular velocity    S' log(R_{t-1}' R_t) / h - z                 mean over the interval before
//   t specific force      S' R_t' ((p_{t+1} - 2 p_t + p_{t-1}) / h^2 - g) - z
//
// R: axes of the link in W; S: those of the sensor in the link's. z is read at t + the source's
// delay; an unknown offset of the sensor is added to the left side.
#pragma once

#include <vector>

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/estimate/sensors/sensor_signal.h"

namespace counterpoint::estimation {

/// A sensor in a sum of squares.
struct SensorTerm {
  Sensor sensor;
  SensorSignal signal;
  double weight = 0.0;  ///< inverse standard deviation of a component of SensorSignal::read_frame
  double delay = 0.0;   ///< known part of its source's delay [s]
  int delay_constant = -1;   ///< index of the delay's unknown part; -1: there is none
  int offset_constant = -1;  ///< index of the first component of its offset
};

/// Frames, and what else residuals depend on.
struct SensorFrames {
  const std::vector<VectorX>& q;
  VectorRef constants;  ///< their values
  double start = 0.0;   ///< time of frame 0 [s]
  double h = 0.0;       ///< [s]
};

/// When the source of a sensor tells of frame t [s].
double read_time(const SensorFrames& frames, int t, const SensorTerm& term);

/// Rows divided by their standard deviations.
struct WeightedRows {
  VectorX residual;
  MatrixX by_frames;      ///< rows x nv of frame t alone, or x 3 nv of t - 1, t, t + 1
  MatrixX by_constants;   ///< rows x constants
  std::vector<int> term;  ///< index of each row's sensor
  int size = 0;           ///< rows in use
};

class SensorRows {
 public:
  SensorRows(const Model& model, const std::vector<SensorTerm>& terms, int constants);

  /// All rows of frame t. Forces have none here (force_sensors.h).
  void evaluate(const Model& model, const SensorFrames& frames, int t, bool derivatives);
  const WeightedRows& of_frame() const { return of_frame_; }    ///< those of frame t alone
  const WeightedRows& of_motion() const { return of_motion_; }  ///< those of three frames

 private:
  void set_poses(const Model& model, const SensorFrames& frames, int t);
  void add(const Model& model, const SensorFrames& frames, int t, int term, bool derivatives);
  Vector3 residual(const SensorFrames& frames, int t, const SensorTerm& term,
                   const Reading& reading) const;
  Vector3 acceleration(double h, const Sensor& sensor) const;
  void differentiate(const Model& model, double h, const SensorTerm& term, const Vector3& error,
                     Eigen::Ref<MatrixX> out);

  const std::vector<SensorTerm>* terms_;
  bool moving_ = false;      ///< some sensor needs three frames
  std::vector<Data> poses_;  ///< poses of frames t - 1, t, t + 1
  WeightedRows of_frame_, of_motion_;
  MatrixX point_, angular_;  ///< 3 x nv: Jacobians of one sensor
  Vector3 gravity_;
};

/// Can the kind be told from one frame?
bool is_position(SensorKind kind);
/// Is it of forces, which need the inverse of a step?
bool is_force(SensorKind kind);
/// Is it of what a joint passes to its link?
bool is_wrench(SensorKind kind);

}  // namespace counterpoint::estimation
