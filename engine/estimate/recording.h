// Recordings of real motions, and how far predictions by simulation are from them: which column is
// which coordinate of a scene (a YAML column map, docs/reference/recording-format.md), the
// recording read through it, and the score.
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
#include "counterpoint/engine/motion_files.h"
#include "counterpoint/engine/simulator.h"

namespace counterpoint::estimation {

struct ColumnMap {
  /// One coordinate of the scene fed by the recording.
  struct Entry {
    enum class Kind { kPosition, kVelocity, kForce };
    Kind kind = Kind::kPosition;
    int index = 0;     ///< into q, v or the applied force
    std::string name;  ///< as in a trajectory
    ColumnSource source;
  };
  std::vector<Entry> entries;
  /// Velocities after an impact. Where there are any, a row is an impact: `entries` are before it,
  /// and there is no time.
  std::vector<Entry> after;
  std::vector<std::string> skip;  ///< rows of impacts with anything but 0 there are left out
  int free_body = -1;          ///< body whose pose is compared; -1: the mapped joint positions are
  std::optional<double> rate;  ///< [1/s]; else `time` holds
  std::vector<ColumnSource> time;  ///< their sum [s]
  bool time_unit_given = false;    ///< the map scales `time`: its unit is not guessed
  TableOptions table;              ///< how the file is read
  std::optional<int> substeps;     ///< time steps between two rows
  /// Recorded velocities are backward differences of the positions: v(t) is the mean over the
  /// interval before t. A body under gravity g is by then g interval / 2 faster.
  bool backward_difference = false;
  /// Recorded angular velocities of floating and spherical joints are in world axes, not in the
  /// body's; turned by the recorded orientation.
  bool world_angular = false;
  bool body_linear =
      false;  ///< recorded linear velocities of floating links are in the axes of the body
  /// A recorded force that contacts exert on some links together, in W.
  struct ContactForce {
    std::string name;
    std::vector<int> bodies;
    std::vector<ColumnSource> components;  ///< x, y, z; without a column where it is not recorded
    std::string source;  ///< the file, one of `sources`; empty: the recording itself
  };
  std::vector<ContactForce> contact_forces;
  /// Standard deviations that are given, by coordinate: of positions (nv) [m, rad], of applied
  /// forces (nv) [N, N m]; infinity where none is given, empty where none is given at all.
  VectorX position_deviation, force_deviation;
  std::vector<Sensor> sensors;        ///< read by explain alone, as all that follows
  std::vector<SensorSource> sources;  ///< other files with readings of sensors
  /// Velocity of the belt that the motion is on, in W [m/s]: what is read is told as on ground at
  /// rest, so that floating links and points move by -velocity t.
  Vector3 treadmill = Vector3::Zero();
  bool missing_cells = false;  ///< empty cells of positions are no errors, but not measured
  int average = 1;             ///< rows, centred and odd, of which a value is the mean
  int pieces = 1;              ///< as many recordings of equal length one file gives
};

/// @throws InputError naming file, line, key, what was expected.
ColumnMap load_column_map(const std::filesystem::path& file, const Model& model);

/// A recording as coordinates of the scene. Column k is row k.
struct Recording {
  std::string file;
  std::string note;          ///< for the user: what was taken for granted; most often empty
  std::vector<double> time;  ///< [s]
  MatrixX q, v;              ///< coordinates the map does not name are the scene's start
  MatrixX applied_force;     ///< zero where the map names none
  MatrixX contact_force;     ///< 3 ColumnMap::contact_forces [N]; NaN where the map names no column
  /// nq x rows: 1 where a position was missing, and is interpolated; empty where none was.
  MatrixX missing;
  std::vector<SensorReadings> sensors;  ///< by ColumnMap::sensors; empty from other files
  int num_rows() const { return static_cast<int>(time.size()); }
};

/// Rows `first` ... `first` + `count` - 1; readings of sensors stay whole.
Recording rows_of(const Recording& whole, int first, int count);

/// Reads the sensors of ColumnMap::sources, each from the file under its name.
/// @throws InputError where a source has no file or a file no source; as read_recordings.
void read_sources(const std::map<std::string, std::string>& files, const ColumnMap& map,
                  Recording& recording);

/// @throws InputError where the map has what only `explain` reads: sensors, sources, a treadmill.
void refuse_sensors(const ColumnMap& map, const std::string& command);

/// Indices into q of angles that come round: revolute joints without limits, and the angle of
/// planar joints.
std::vector<int> circular_positions(const Model& model);

/// The recordings of a file: one, as many as the map cuts it into, or one for each impact; then
/// their names say which part it is. Of an impact both rows are at the pose and the time before.
/// @throws InputError naming file, line, column: as Table, and for fewer than two rows a
/// recording, time not rising, quaternions that are not of unit length (1e-3; they are normalised).
std::vector<Recording> read_recordings(const std::filesystem::path& file, const ColumnMap& map,
                                       const Model& model, const VectorX& start_q,
                                       const VectorX& start_v);

/// Those of several files, with the scene's start where the map names nothing.
std::vector<Recording> read_all(const std::vector<std::string>& files, const ColumnMap& map,
                                const Scene& scene);

// ---- Statistics of the difference between prediction and recording, by coordinate.

/// Of an even number the mean of the middle two; NaN of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

/// Forces [N or N m] or velocities [m/s or rad/s].
struct CoordinateFigures {
  std::string name;   ///< as in a trajectory, NAME.u or NAME.v
  double rms = 0.0;   ///< root of the mean square of the difference
  double mean = 0.0;  ///< predicted (recovered) less recorded
  /// Of what was recorded about its mean, and R2 = 1 - (rms / deviation)^2; none where nothing was
  /// recorded or it never changed.
  std::optional<double> recorded_deviation, r2;
};

/// @param difference  predicted less recorded, one or more
/// @param recorded    as many
CoordinateFigures coordinate_figures(const std::string& name, const VectorX& difference,
                                     const VectorX& recorded);

// ---- Impacts of which only the velocities before and after are known: what the contact law makes
// of the former at once, without time or forces in between.

struct Impact {
  VectorX v;                   ///< after [m/s, rad/s]
  int contacts = 0;            ///< within reach; none: nothing changes
  double energy_before = 0.0;  ///< kinetic [J]
  double energy = 0.0;         ///< after
};

/// The scene's contacts, closures, friction and restitution on velocities. Of each pair of
/// geometries nearer than the scene's margin the nearest point counts, as touching, whatever its
/// gap: recorded poses are not exact to where surfaces meet.
class ImpactSolver {
 public:
  explicit ImpactSolver(const Scene& scene);
  ~ImpactSolver();

  /// Valid until the next call. @throws std::runtime_error where the solver fails.
  const Impact& solve(const VectorX& q, const VectorX& v);

  /// A difference of velocities at the pose solved last as L' d / sqrt(mass), M = L L' [m/s]: its
  /// length is the speed at which all that moves has the kinetic energy of the difference.
  VectorX weighted(const VectorX& difference) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// ---- A recording predicted by simulation, from its first row or anew every few rows, and how far
// the prediction is from it (docs/reference/recording-format.md, The score).

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

/// configuration_difference from `recorded` to `q` [rad, m], on the circle where positions are
/// circular.
void recorded_difference(const Model& model, const VectorX& recorded, const VectorX& q,
                         VectorX& out);

/// What predictions and recordings are compared by.
enum class Compared { kJoints, kPose, kImpacts };
Compared compared(const ColumnMap& map);

struct PredictionOptions {
  std::optional<int> substeps;  ///< time steps from row to row; else as near scene_step as can be
  double scene_step = 0.002;    ///< [s]
  /// Every so many rows the recording is taken anew as the start; 0: its first row only.
  int horizon = 0;
  std::function<bool()> stop = {};  ///< asked before every step: true ends the prediction there
};

/// An impact as predicted, against the one recorded.
struct ImpactDeviation {
  /// nv: velocity after, predicted less recorded, in the norm of M (ImpactSolver::weighted) [m/s].
  VectorX weighted;
  double speed = 0.0;         ///< its length [m/s]
  double energy_ratio = 0.0;  ///< kinetic energy after over before, predicted
  double recorded_energy_ratio = 0.0;
  int contacts = 0;
};

struct Prediction {
  std::string file;
  int rows = 0;
  MatrixX q;                          ///< nq x rows; as recorded where a piece starts
  std::vector<double> time;           ///< of the rows predicted [s]
  std::vector<Deviation> deviations;  ///< at the rows predicted (not those where pieces start)
  /// Over the rows predicted; over the last rows of the pieces.
  Deviation mean, end;
  /// nv x pieces: velocities at the last row of each piece, or after the impact; predicted less
  /// recorded, and recorded [m/s, rad/s].
  MatrixX velocity_error, recorded_velocity;
  std::optional<ImpactDeviation> impact;  ///< of impacts; no row is then predicted
  long steps = 0, newton_iterations = 0;
  std::optional<FailedStep> failure;  ///< rows from there on are not predicted
  bool stopped = false;               ///< by PredictionOptions::stop; means are not to be used
};

/// The recorded state at a row; with `backward_difference` velocities, floating links are g
/// interval / 2 faster.
State recorded_state(const Model& model, const ColumnMap& map, const Recording& recording, int row);

/// From `row` to `row` + 1 [s].
double row_interval(const ColumnMap& map, const Recording& recording, int row);

/// Is told of a prediction by the simulator as it goes on.
class PredictionWatch {
 public:
  virtual ~PredictionWatch() = default;
  /// The recorded state at `row` is the start of a piece.
  virtual void start(const Recording& recording, int row) = 0;
  /// A step of these options that led from `before` to `after` under `input`.
  virtual void step(const SimulationOptions& options, const State& before, const Input& input,
                    const State& after) = 0;
  /// The prediction of `row` is `state`.
  virtual void row(const Recording& recording, int row, const State& state) = 0;
};

/// Predicts by the simulator, or by the impact law where the map is of impacts.
class Predictor {
 public:
  Predictor(const Scene& scene, const ColumnMap& map, const PredictionOptions& options);

  /// @throws std::runtime_error where an impact is not solved.
  Prediction predict(const Recording& recording, PredictionWatch* watch = nullptr);
  const Model& model() const { return simulator_.model(); }

 private:
  Prediction roll_out(const Recording& recording, PredictionWatch* watch);
  Prediction strike(const Recording& recording);

  Simulator simulator_;
  std::optional<ImpactSolver> impacts_;  ///< where the map is of impacts
  ColumnMap map_;
  PredictionOptions options_;
};

/// The figures of a prediction under their names in the report.
std::vector<std::pair<const char*, double>> figures(const Prediction& prediction, Compared by);

/// The medians of figures() over all that did not fail.
std::vector<std::pair<const char*, double>> median_figures(
    const std::vector<Prediction>& predictions, Compared by);

/// The velocities that the map names, at the last rows of all pieces or after impacts, by
/// coordinate; none where no prediction got so far.
std::vector<CoordinateFigures> velocity_figures(const ColumnMap& map,
                                                const std::vector<Prediction>& predictions);

}  // namespace counterpoint::estimation
