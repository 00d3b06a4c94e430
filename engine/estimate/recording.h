// Recordings of real motions, and their distance from predictions by simulation: the YAML column
// map from columns to coordinates of a scene (docs/reference/recording-format.md), the recording
// read through it, and the score.
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/engine/estimate/sensors/sensor.h"
#include "counterpoint/engine/sensors/sensor_table.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/tables.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::estimation {

struct ColumnMap {
  /// One coordinate of the scene and its column in the recording.
  struct Entry {
    enum class Kind { kPosition, kVelocity, kForce, kInput };
    Kind kind = Kind::kPosition;
    int index = 0;     ///< index into q, v, the applied force, or the names of input_columns
    std::string name;  ///< column name of the coordinate in a trajectory file
    ColumnSource source;
  };
  std::vector<Entry> entries;
  /// Recorded inputs of servos, tendons, actuators, wrenches and others, which predictions replay.
  std::vector<Entry> inputs;
  InputColumns input_columns;  ///< columns of these inputs
  /// Velocities after an impact. If not empty, each row is one impact: `entries` describe the state
  /// before it, and there is no time.
  std::vector<Entry> after;
  std::vector<std::string> skip;  ///< impacts with a nonzero value in one of these columns are
                                  ///< skipped
  int free_body = -1;  ///< body whose pose is compared; -1: compare the mapped joint positions
  std::optional<double> rate;      ///< row rate [1/s]; if absent, `time` is used
  std::vector<ColumnSource> time;  ///< columns whose sum is the time [s]
  bool time_unit_given = false;    ///< the map scales `time`: do not guess its unit
  TableOptions table;              ///< options for reading the file
  std::optional<int> substeps;     ///< time steps between two rows
  /// Recorded velocities are backward differences of positions: v(t) is the mean over the interval
  /// before t. A body in free fall is g interval / 2 faster at t.
  bool backward_difference = false;
  /// Recorded angular velocities of floating and spherical joints are in world axes instead of body
  /// axes; the recorded orientation converts them.
  bool world_angular = false;
  bool body_linear = false;  ///< recorded linear velocities of floating links are in body axes
  /// A recorded total contact force on a set of links, in W.
  struct ContactForce {
    std::string name;
    std::vector<int> bodies;
    std::vector<ColumnSource> components;  ///< x, y, z; an empty column if a component is not
                                           ///< recorded
    std::string source;  ///< file that holds it, one of `sources`; empty: the recording
  };
  std::vector<ContactForce> contact_forces;
  /// Given standard deviations per coordinate: of positions (nv) [m, rad] and of applied forces
  /// (nv) [N, N m]; infinity where none is given. Empty if none is given at all.
  VectorX position_deviation, force_deviation;
  /// `explain` alone uses this and the following members; predictions read sensors of the scene.
  std::vector<Sensor> sensors;
  std::vector<SensorSource> sources;  ///< other files with sensor readings
  /// Velocity of a treadmill belt under the motion, in W [m/s]. Readings are converted to ground at
  /// rest: floating links and points move by -velocity t.
  Vector3 treadmill = Vector3::Zero();
  bool missing_cells = false;  ///< empty position cells mean "not measured" and are no error
  int average = 1;             ///< odd number of rows in a centred moving average
  int pieces = 1;              ///< number of recordings of equal length that one file is cut into
};

/// Loads a column map for this model. @throws InputError naming file, line, key and the expected
/// value.
ColumnMap load_column_map(const std::filesystem::path& file, const Model& model);

/// A recording in coordinates of the scene; column k of a matrix is row k of the file.
struct Recording {
  std::string file;
  std::string note;          ///< message for the user about assumptions made; usually empty
  std::vector<double> time;  ///< [s]
  MatrixX q, v;              ///< nq, nv; coordinates without a column have the scene's start value
  MatrixX applied_force;     ///< nv [N, N m]; zero where the map has no column
  MatrixX inputs;            ///< ColumnMap::input_columns; the scene's where the map has no column
  MatrixX contact_force;     ///< 3 ColumnMap::contact_forces [N]; NaN where the map has no column
  /// nq x rows: 1 where a position is missing and was interpolated; no columns if none is missing.
  MatrixX missing;
  std::vector<SensorReadings> sensors;  ///< one per map sensor; empty if in other files
  int num_rows() const { return static_cast<int>(time.size()); }
};

/// Returns rows `first` ... `first` + `count` - 1; sensor readings are copied whole.
Recording rows_of(const Recording& whole, int first, int count);

/// Reads the sensors of ColumnMap::sources from the file given for each source name. @throws
/// InputError if a source has no file or a file no source, and as read_recordings.
void read_sources(const std::map<std::string, std::string>& files, const ColumnMap& map,
                  Recording& recording);

/// @throws InputError if the map has keys that only `explain` supports: sensors, except those of
/// the scene where the command takes them, sources, a treadmill.
void refuse_sensors(const ColumnMap& map, const std::string& command,
                    bool takes_scene_sensors = false);

/// @throws InputError if the map has recorded inputs, which predictions and Explainer alone use.
void refuse_inputs(const ColumnMap& map, const std::string& command);

/// Indices into q of angles on a circle: revolute joints without limits, and the angle of planar
/// joints.
std::vector<int> circular_positions(const Model& model);

/// Reads the recordings of a file: one, the pieces that the map cuts it into, or one per impact;
/// names then say which part it is. Both rows of an impact have the pose and time before it.
/// @throws InputError naming file, line and column: as Table, and for fewer than two rows, time
/// that does not increase, or quaternions off unit length by more than 1e-3 (others are
/// normalised).
std::vector<Recording> read_recordings(const std::filesystem::path& file, const ColumnMap& map,
                                       const Model& model, const VectorX& start_q,
                                       const VectorX& start_v);

/// Reads the recordings of several files; coordinates without a column take the scene's start
/// values.
std::vector<Recording> read_all(const std::vector<std::string>& files, const ColumnMap& map,
                                const Scene& scene);

// ---- Statistics of the difference between prediction and recording, by coordinate.

/// Median; the mean of the middle two for an even count, NaN for no values.
inline double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

/// Statistics of one coordinate's forces [N or N m] or velocities [m/s or rad/s].
struct CoordinateMetrics {
  std::string name;   ///< NAME.u or NAME.v, the column name in a trajectory file
  double rms = 0.0;   ///< root mean square of the difference
  double mean = 0.0;  ///< mean of predicted (recovered) minus recorded
  /// Standard deviation of the recorded values, and R2 = 1 - (rms / deviation)^2. None if nothing
  /// was recorded or it is constant.
  std::optional<double> recorded_deviation, r2;
};

/// @param difference  predicted minus recorded, not empty
/// @param recorded    the recorded values, of the same size
CoordinateMetrics coordinate_metrics(const std::string& name, const VectorX& difference,
                                     const VectorX& recorded);

// ---- Impacts with known velocities before and after only: the contact law maps one to the other
// in an instant, without time or forces in between.

struct Impact {
  VectorX v;                   ///< velocity after the impact [m/s, rad/s]
  int contacts = 0;            ///< number of contacts within reach; 0: the velocity is unchanged
  double energy_before = 0.0;  ///< kinetic energy before [J]
  double energy = 0.0;         ///< kinetic energy after [J]
};

/// Applies the scene's contacts, closures, friction and restitution to velocities. For each pair of
/// geometries nearer than the scene's margin, the nearest point is in contact whatever its gap:
/// recorded poses are not accurate enough to tell where surfaces touch.
class ImpactSolver {
 public:
  explicit ImpactSolver(const Scene& scene);
  ~ImpactSolver();

  /// Returns the impact of velocity v (nv) at configuration q (nq). Valid until the next call.
  /// @throws std::runtime_error if the solver fails.
  const Impact& solve(const VectorX& q, const VectorX& v);

  /// Returns L' d / sqrt(total mass) for a velocity difference d at the pose solved last, M = L L'
  /// [m/s]. Its length is the speed at which the total mass has the kinetic energy of d.
  VectorX weighted(const VectorX& difference) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// ---- Prediction of a recording by simulation, from its first row or restarted every few rows, and
// its distance from the recording (docs/reference/recording-format.md, The score).

/// Distance between prediction and recording at one row. Either a pose is compared, or joints are.
struct Deviation {
  double position = 0.0;  ///< |p - p_recorded| [m]
  double rotation = 0.0;  ///< relative rotation angle [degrees]
  double joints = 0.0;    ///< mean of |q - q_recorded| over the mapped joints [rad or m]

  Deviation& operator+=(const Deviation& o);
  Deviation operator*(double s) const { return {position * s, rotation * s, joints * s}; }
};

Deviation deviation(const Model& model, const ColumnMap& map, const VectorX& q,
                    const VectorX& recorded);

/// Computes configuration_difference from `recorded` to `q` (nv) [rad, m]; angles of
/// circular_positions() are wrapped to [-pi, pi].
void recorded_difference(const Model& model, const VectorX& recorded, const VectorX& q,
                         VectorX& out);

/// Quantity that predictions and recordings are compared by.
enum class Compared { kJoints, kPose, kImpacts };
Compared compared(const ColumnMap& map);

struct PredictionOptions {
  std::optional<int> substeps;  ///< time steps per row; default: as close to scene_step as possible
  double scene_step = 0.002;    ///< [s]
  /// Number of rows after which the prediction restarts from the recording; 0: never.
  int horizon = 0;
  std::function<bool()> stop = {};  ///< called before every step: true ends the prediction
};

/// A predicted impact compared with the recorded one.
struct ImpactDeviation {
  /// nv: post-impact velocity, predicted minus recorded, in the norm of M (ImpactSolver::weighted)
  /// [m/s].
  VectorX weighted;
  double speed = 0.0;         ///< length of `weighted` [m/s]
  double energy_ratio = 0.0;  ///< predicted kinetic energy after over before
  double recorded_energy_ratio = 0.0;
  int contacts = 0;
};

struct Prediction {
  std::string file;
  int rows = 0;
  MatrixX q;                          ///< nq x rows; recorded values at the rows where pieces start
  std::vector<double> time;           ///< times of the predicted rows [s]
  std::vector<Deviation> deviations;  ///< at the predicted rows (not at the starts of pieces)
  /// Mean over the predicted rows; mean over the last rows of the pieces.
  Deviation mean, end;
  /// nv x pieces: velocities at the last row of each piece, or after the impact: predicted minus
  /// recorded, and recorded [m/s, rad/s].
  MatrixX velocity_error, recorded_velocity;
  /// Values of ColumnMap::sensors (their columns, one after the other) x rows, each at the start of
  /// the step from the row's predicted state; NaN in the last row. Empty without sensors.
  MatrixX sensors;
  std::optional<ImpactDeviation> impact;  ///< for maps of impacts, which predict no rows
  long steps = 0, newton_iterations = 0;
  std::optional<FailedStep> failure;  ///< rows after it are not predicted
  bool stopped = false;               ///< PredictionOptions::stop ended it; means are invalid
};

/// Returns the recorded state at a row. If the map has `backward_difference` velocities, floating
/// links get g interval / 2 added.
State recorded_state(const Model& model, const ColumnMap& map, const Recording& recording, int row);

/// Time from `row` to `row` + 1 [s].
double row_interval(const ColumnMap& map, const Recording& recording, int row);

/// Observer of a prediction by the simulator.
class PredictionWatch {
 public:
  virtual ~PredictionWatch() = default;
  /// A piece starts at the recorded state of `row`.
  virtual void start(const Recording& recording, int row) = 0;
  /// A step with these options led from `before` to `after` under `input`.
  virtual void step(const SimulationOptions& options, const State& before, const Input& input,
                    const State& after) = 0;
  /// The predicted state at `row` is `state`.
  virtual void row(const Recording& recording, int row, const State& state) = 0;
};

/// Predicts recordings with the simulator, or with the impact law if the map describes impacts.
class Predictor {
 public:
  Predictor(const Scene& scene, const ColumnMap& map, const PredictionOptions& options);

  /// Predicts one recording. @throws std::runtime_error if the solver fails at an impact.
  Prediction predict(const Recording& recording, PredictionWatch* watch = nullptr);
  const Model& model() const { return simulator_.model(); }

 private:
  bool predict_row(const Recording& recording, int row, PredictionWatch* watch, Prediction& out);
  void read_sensors(const Recording& recording, int row, const State& before, const Input& input,
                    Prediction& out);
  Prediction roll_out(const Recording& recording, PredictionWatch* watch);
  Prediction strike(const Recording& recording);

  Simulator simulator_;
  std::optional<ImpactSolver> impacts_;  ///< only for maps of impacts
  std::optional<SensorTable> table_;     ///< only for maps with sensors
  std::vector<int> first_;               ///< per map sensor: its first column in table_
  Eigen::Index sensed_ = 0;              ///< rows of Prediction::sensors
  ColumnMap map_;
  PredictionOptions options_;
};

/// The metrics of a prediction, by their names in the report.
std::vector<std::pair<const char*, double>> metrics(const Prediction& prediction, Compared by);

/// The medians of metrics() over all predictions that did not fail.
std::vector<std::pair<const char*, double>> median_metrics(
    const std::vector<Prediction>& predictions, Compared by);

/// Statistics of the mapped velocities per coordinate, at the last rows of all pieces or after
/// impacts; empty if no prediction got that far.
std::vector<CoordinateMetrics> velocity_metrics(const ColumnMap& map,
                                                const std::vector<Prediction>& predictions);

/// Statistics of each column of ColumnMap::sensors over all rows with a reading, predicted minus
/// recorded; `recordings` are those of the predictions. Names are those of the scene's columns.
std::vector<CoordinateMetrics> sensor_metrics(const Model& model, const ColumnMap& map,
                                              const std::vector<Recording>& recordings,
                                              const std::vector<Prediction>& predictions);

}  // namespace counterpoint::estimation
