// A recording predicted by simulation, from its first row or anew every few rows, and how far the
// prediction is from it (docs/reference/recording-format.md, The score).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinate_figures.h"
#include "counterpoint/engine/simulator.h"
#include "impact.h"
#include "recording.h"
#include "report/failure.h"

namespace counterpoint::apps {

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

/// What predictions and recordings are compared by.
enum class Compared { kJoints, kPose, kImpacts };
Compared compared(const ColumnMap& map);

struct PredictionOptions {
  std::optional<int> substeps;  ///< time steps from row to row; else as near scene_step as can be
  double scene_step = 0.002;    ///< [s]
  /// Every so many rows the recording is taken anew as the start; 0: its first row only.
  int horizon = 0;
  std::function<bool()> stop = {};  ///< asked at every row: true ends the prediction there
};

/// An impact as predicted, against the one recorded.
struct ImpactDeviation {
  /// nv: velocity after, predicted less recorded, in the norm of M (impact.h) [m/s].
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

}  // namespace counterpoint::apps
