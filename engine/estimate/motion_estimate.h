// The motion behind a noisy recording, and the forces behind the motion: contacts, joints, and what
// neither explains, with standard deviations (docs/explanation/explaining.md).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {

/// Links whose contact forces are added up.
struct ContactSum {
  std::string name;
  std::vector<int> bodies;
};

/// Kinds of errors of the recorded positions.
enum class RecordingErrors {
  kNone,   ///< the recording is a motion of this engine: nothing is estimated
  kWhite,  ///< independent from row to row: encoders, good simulations of noise
  kSlow,   ///< they change slowly (skin, markers, a model that does not fit): accelerations of the
           ///< low-passed recording are trusted more than positions
};
const char* recording_errors_name(RecordingErrors errors);

struct MotionEstimateOptions {
  int threads = 0;  ///< 0: one a core; the result does not depend on it
  /// Sums to be told beside those of each link that touches something.
  std::vector<ContactSum> sums;
  /// None: found from the recording.
  std::optional<RecordingErrors> errors;
  /// Asked before every Newton step: true ends the search with the best motion so far, whose
  /// standard deviations are not computed (NaN; of parameters infinity).
  std::function<bool()> stop;
};

/// All contacts of two geometries in one frame.
struct ContactEstimate {
  int geometry_a = 0, geometry_b = 0;
  Vector3 force = Vector3::Zero();      ///< on geometry B, in W [N]
  Vector3 deviation = Vector3::Zero();  ///< its standard deviation [N]
  Vector3 centre = Vector3::Zero();     ///< centre of pressure, in W [m]
  double normal_force = 0.0;            ///< [N]
  double slip = 0.0;                    ///< tangential velocity of B over A [m/s]
  bool sliding = false;                 ///< friction is at its limit
};

/// A figure found beside the motion.
struct EstimatedParameter {
  std::string name;
  std::string unit;
  double value = 0.0;  ///< difference from the scene's
  double deviation = 0.0;
};

/// A place where the recording is not believed: a value far from the estimate, or an acceleration
/// that nothing here can have given (a jump of the recording).
struct Outlier {
  int row = 0;
  int coordinate = 0;         ///< index into v
  double difference = 0.0;    ///< recorded less estimated [m, rad; m/s^2, rad/s^2]
  double deviations = 0.0;    ///< over its standard deviation
  bool acceleration = false;  ///< the largest of a few rows is told
};

/// How well the readings of a sensor go with the motion.
struct SensorFigures {
  std::string name;
  SensorKind kind = SensorKind::kPoint;
  int rows = 0;            ///< in which it was read
  double deviation = 0.0;  ///< standard deviation of a component in a row
  double rms = 0.0;        ///< root mean square of a component's residual
  int outliers = 0;        ///< components farther off than 6 deviations
};

/// Columns are rows of the recording. Forces of a row are the mean over the intervals before and
/// behind it, with the weights of a triangle; the first and the last row have none (NaN).
struct MotionEstimate {
  std::string file;
  std::vector<double> time;  ///< [s]
  MatrixX recorded;          ///< nq: what columns say, or else sensors of positions
  MatrixX q;                 ///< nq
  MatrixX v;                 ///< nv: mean of the velocities before and behind the row
  MatrixX force;            ///< nv: forces of joints; of links without a motor unexplained [N, N m]
  MatrixX force_deviation;  ///< nv
  std::vector<std::vector<ContactEstimate>> contacts;  ///< one list a row
  std::vector<ContactSum> sums;
  MatrixX sum_force, sum_deviation;  ///< 3 sums: contact forces on the links, in W [N]
  MatrixX sum_centre;                ///< 3 sums: centre of pressure [m]; NaN without a force
  std::vector<EstimatedParameter> parameters;
  std::vector<SensorFigures> sensors;
  VectorX position_deviation;  ///< nv: standard deviations of the recorded positions [m, rad]
  VectorX cost_ratio;          ///< a row each: mean square of residuals over their variance
  std::vector<Outlier> outliers;
  double unexplained_mean = 0.0, unexplained_max = 0.0;  ///< weights of the trees
  double smoothing = 0.0;                                ///< contact law at the end [m]
  int newton_steps = 0;
  double seconds = 0.0;
  RecordingErrors errors = RecordingErrors::kWhite;
  /// Mean square of the measurements' residuals over their deviations. White errors: 0.8 to 1.3 is
  /// right; far above, the model or a deviation is wrong.
  double mean_cost_ratio = 0.0;
  /// nv: lag-1 autocorrelation of the recorded positions' residuals over their deviations, those
  /// beyond three counted as three; NaN where errors are not white, or too few are measured. Far
  /// above 0 the scene lacks something; below 0, as after any smoothing, nothing is wrong.
  VectorX residual_correlation;
  bool stopped = false;  ///< MotionEstimateOptions::stop said so
};

/// The most probable motion of a recording, whose rows are evenly spaced. @throws InputError where
/// it has fewer than `kLeastRows` rows, or no position is mapped; std::runtime_error where its
/// motion has no finite forces.
MotionEstimate estimate_motion(const Scene& scene, const ColumnMap& map, const Recording& recording,
                               const MotionEstimateOptions& options = {});
inline constexpr int kLeastRows = 12;

}  // namespace counterpoint::estimation
