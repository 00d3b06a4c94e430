// Estimation of the motion behind a noisy recording and of its forces: contact forces, joint forces
// and unexplained forces, with standard deviations (docs/explanation/explaining.md).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {

/// A set of links whose contact forces are summed.
struct ContactSum {
  std::string name;
  std::vector<int> bodies;
};

/// Kinds of errors of the recorded positions.
enum class RecordingErrors {
  kNone,   ///< the recording is an exact motion of this engine; nothing is estimated
  kWhite,  ///< independent from row to row: encoders, simulated noise
  kSlow,   ///< slowly varying (skin, markers, model errors): accelerations of the low-passed
           ///< recording are trusted more than positions
};
const char* recording_errors_name(RecordingErrors errors);

/// A motion on the way to the estimate, after a Newton step.
struct MotionIterate {
  double cost = 0.0;                 ///< half the sum of squared residuals
  double cost_ratio = 0.0;           ///< see MotionEstimate::mean_cost_ratio
  double start = 0.0;                ///< time of the first frame [s]
  const SimulationOptions& options;  ///< contact law and time_step [s] of its steps
  const std::vector<VectorX>& q;     ///< frames, one time_step apart
};

struct MotionEstimateOptions {
  int threads = 0;  ///< 0: one per core; the result does not depend on it
  /// Sums to report besides those of each link that touches something.
  std::vector<ContactSum> sums;
  /// Kind of errors; if absent, it is determined from the recording.
  std::optional<RecordingErrors> errors;
  /// Called before every Newton step: true ends the search with the best motion so far, without
  /// standard deviations (NaN; infinity for parameters).
  std::function<bool()> stop;
  /// Called with the recorded motion (of infinite cost), and after every Newton step with its
  /// motion; both are valid during the call.
  std::function<void(const MotionIterate&)> watch;
};

/// All contacts between two geometries, summed in one frame of the motion.
struct ContactEstimate {
  int geometry_a = 0, geometry_b = 0;
  Vector3 force = Vector3::Zero();      ///< contact force on geometry B, in W [N]
  Vector3 deviation = Vector3::Zero();  ///< standard deviation of the force [N]
  Vector3 centre = Vector3::Zero();     ///< centre of pressure, in W [m]
  double normal_force = 0.0;            ///< [N]
  double slip = 0.0;                    ///< tangential velocity of B relative to A [m/s]
  bool sliding = false;                 ///< the friction force is at its limit
};

/// A parameter estimated together with the motion.
struct EstimatedParameter {
  std::string name;
  std::string unit;
  double value = 0.0;  ///< difference from the scene's value
  double deviation = 0.0;
};

/// A rejected part of the recording: a value far from the estimate, or an acceleration that the
/// scene cannot produce (a jump of the recording).
struct Outlier {
  int row = 0;
  int coordinate = 0;         ///< index into v
  double difference = 0.0;    ///< recorded minus estimated [m, rad; m/s^2, rad/s^2]
  double deviations = 0.0;    ///< the same, in standard deviations
  bool acceleration = false;  ///< the outlier is an acceleration; only the largest of neighbouring
                              ///< rows is reported
};

/// Agreement of a sensor's readings with the motion.
struct SensorMetrics {
  std::string name;
  SensorKind kind = SensorKind::kPoint;
  int rows = 0;            ///< number of rows with a reading
  double deviation = 0.0;  ///< standard deviation of one component in one row
  double rms = 0.0;        ///< root mean square of the residual of one component
  int outliers = 0;        ///< components with a residual above 6 standard deviations
};

/// An estimated motion; matrix columns are rows of the recording. The force of a row is the mean
/// over the intervals before and after it with triangular weights; the first and the last row have
/// none (NaN).
struct MotionEstimate {
  std::string file;
  std::vector<double> time;  ///< [s]
  MatrixX recorded;          ///< nq: values of columns, or of position sensors
  MatrixX q;                 ///< nq
  MatrixX v;                 ///< nv: mean of the velocities before and after the row
  MatrixX force;  ///< nv: joint forces; unexplained forces where there is no actuator [N, N m]
  MatrixX force_deviation;                             ///< nv
  std::vector<std::vector<ContactEstimate>> contacts;  ///< one list per row
  std::vector<ContactSum> sums;
  MatrixX sum_force, sum_deviation;  ///< 3 sums: contact forces on the links, in W [N]
  MatrixX sum_centre;                ///< 3 sums: centre of pressure [m]; NaN without a force
  std::vector<EstimatedParameter> parameters;
  std::vector<SensorMetrics> sensors;
  VectorX position_deviation;  ///< nv: standard deviations of the recorded positions [m, rad]
  VectorX cost_ratio;          ///< per row: mean square of residuals over their variance
  std::vector<Outlier> outliers;
  double unexplained_mean = 0.0, unexplained_max = 0.0;  ///< in weights of the trees
  double smoothing = 0.0;  ///< smoothing of the contact law at the end [m]
  int newton_steps = 0;
  double seconds = 0.0;
  RecordingErrors errors = RecordingErrors::kWhite;
  /// Mean square of the measurement residuals over their variance. For white errors 0.8 to 1.3 is
  /// expected; a much larger value means that the model or a standard deviation is wrong.
  double mean_cost_ratio = 0.0;
  /// nv: lag-1 autocorrelation of the recorded positions' residuals, in standard deviations and
  /// clipped at three. NaN if errors are not white or too few positions are measured. A value far
  /// above 0 means that the scene model is incomplete; below 0 is normal after smoothing.
  VectorX residual_correlation;
  bool stopped = false;  ///< MotionEstimateOptions::stop ended the search
};

/// Estimates the most probable motion of a recording; rows that are not evenly spaced are
/// interpolated. @throws InputError if it has fewer than `kLeastRows` rows or no position is
/// mapped; std::runtime_error if the motion has no finite forces.
MotionEstimate estimate_motion(const Scene& scene, const ColumnMap& map, const Recording& recording,
                               const MotionEstimateOptions& options = {});
inline constexpr int kLeastRows = 12;

}  // namespace counterpoint::estimation
