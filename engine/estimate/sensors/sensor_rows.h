// Residuals of sensors at one frame, and their derivatives; one object per thread.
//
//   point               p(q_t) - z
//   orientation         log(R_z' R(q_t))
//   coordinate          q_t - z
//   angular velocity    S' log(R_{t-1}' R_t) / h - z                 mean over the interval before
//   specific force      S' R_t' ((p_{t+1} - 2 p_t + p_{t-1}) / h^2 - g) - z
//
// R: rotation of the link to W; S: rotation of the sensor to the link. z is the reading at t +
// delay of the source. Unknown constants of a sensor (SensorTerm) change the left side: its factor
// is 1 + scale, its offset is added, p and S are those of the displaced and turned sensor.
#pragma once

#include <functional>
#include <vector>

#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/estimate/sensors/sensor_signal.h"

namespace counterpoint::estimation {

/// A sensor as a term of the least squares cost.
struct SensorTerm {
  Sensor sensor;
  SensorSignal signal;
  double weight = 0.0;  ///< inverse standard deviation of a component of SensorSignal::read_frame
  double delay = 0.0;   ///< known part of the delay of its source [s]
  int delay_constant = -1;   ///< index of the constant with the unknown delay; -1: none
  int offset_constant = -1;  ///< index of the first component of the offset; -1: none
  int scale_constant = -1;   ///< index of the relative error of the factor; -1: none
  /// Indices of the first components of the displacement along the sensor's axes [m] and of the
  /// rotation vector about them [rad]; -1: none.
  int position_constant = -1, rotation_constant = -1;
};

/// Frames and constants that residuals depend on.
struct SensorFrames {
  const std::vector<VectorX>& q;
  VectorRef constants;  ///< values of the sensor constants
  double start = 0.0;   ///< time of frame 0 [s]
  double h = 0.0;       ///< [s]
};

/// Time stamp at which a sensor's source reports frame t [s].
double read_time(const SensorFrames& frames, int t, const SensorTerm& term);

/// Place of a sensor in its body.
struct SensorPlace {
  Vector3 point;  ///< [m]
  Matrix3 axes;   ///< rotation from sensor axes to body axes
};
SensorPlace place_of(const SensorTerm& term, const SensorFrames& frames);

/// Factor of a sensor's readings, 1 + scale.
double factor_of(const SensorTerm& term, const SensorFrames& frames);
/// Reading of a sensor for the true `value`, with its unknown factor and offset.
Vector3 reading_of(const SensorTerm& term, const SensorFrames& frames, const Vector3& value);

/// Computes the weighted residual of a term with the constants of the frames. Returns false if it
/// has no reading.
using ResidualOfConstants = std::function<bool(const SensorFrames&, Vector3&)>;
/// Sets the columns of a term's constants in `out` (rows of the term x constants) by central
/// differences: residuals are linear in offsets, scales and displacements.
void difference_constants(const SensorTerm& term, const SensorFrames& frames,
                          const ResidualOfConstants& residual, Eigen::Ref<MatrixX> out);

/// Residuals in standard deviations, with derivatives.
struct WeightedRows {
  VectorX residual;
  MatrixX by_frames;      ///< rows x nv for frame t alone, or rows x 3 nv for t - 1, t, t + 1
  MatrixX by_constants;   ///< rows x constants
  std::vector<int> term;  ///< index of each row's sensor
  int size = 0;           ///< number of rows in use
};

class SensorRows {
 public:
  SensorRows(const Model& model, const std::vector<SensorTerm>& terms, int constants);

  /// Evaluates all rows of frame t, except those of forces (force_sensors.h).
  void evaluate(const Model& model, const SensorFrames& frames, int t, bool derivatives);
  /// The rows that depend on frame t alone.
  const WeightedRows& of_frame() const { return of_frame_; }
  /// The rows that depend on three frames.
  const WeightedRows& of_motion() const { return of_motion_; }

 private:
  void set_poses(const Model& model, const SensorFrames& frames, int t);
  void add(const Model& model, const SensorFrames& frames, int t, int term, bool derivatives);
  Vector3 residual(const SensorFrames& frames, int t, const SensorTerm& term,
                   const Reading& reading) const;
  Vector3 acceleration(double h, int body, const Vector3& point) const;
  void differentiate(const Model& model, const SensorFrames& frames, const SensorTerm& term,
                     const Vector3& error, Eigen::Ref<MatrixX> out);

  const std::vector<SensorTerm>* terms_;
  bool moving_ = false;      ///< some sensor needs three frames
  std::vector<Data> poses_;  ///< poses of frames t - 1, t, t + 1
  WeightedRows of_frame_, of_motion_;
  MatrixX point_, angular_;  ///< 3 x nv: Jacobians of one sensor
  Vector3 gravity_;
};

/// True if the kind depends on a single frame.
bool is_position(SensorKind kind);
/// True for forces, which need inverse dynamics of a step.
bool is_force(SensorKind kind);
/// True for forces and moments that a joint transmits to its link.
bool is_wrench(SensorKind kind);

}  // namespace counterpoint::estimation
