// Figures of a scene found from recordings: parameters by name, forces behind a recorded motion,
// objectives, and least squares.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/engine/batch.h"
#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {

// ---- Parameters of a scene by name, to be set or identified: "friction", "mass:cube",
// "damping:elbow".

enum class ParameterKind {
  kFriction,
  kRestitution,
  kTorsionalFriction,
  kRollingFriction,
  kMass,
  kInertia,
  kSize,
  kDamping,
  kDryFriction,
  kArmature,
  kGravity,
  kHeight,
  kCompliance,
  kSmoothing,
  kStabilization,
  kMaxRecoverySpeed,
};

/// One figure of a scene, and between which bounds it is looked for.
struct Parameter {
  ParameterKind kind = ParameterKind::kFriction;
  std::string name;  ///< as written: KIND or KIND:ELEMENT
  std::string unit;
  double lower = 0.0, upper = 0.0;
  bool logarithmic = false;  ///< looked for by its logarithm
  std::vector<int> targets;  ///< geometries, bodies or velocity coordinates, as the kind has it
};

/// KIND[:ELEMENT][=LOW..HIGH], comma separated, for this scene. Kinds, elements, units and default
/// bounds: docs/reference/recording-format.md. @throws InputError naming the part that is no such
/// thing, and what there is.
std::vector<Parameter> parse_parameters(const std::string& text, const Scene& scene);

/// Value of each in the scene; of several targets the mean.
VectorX parameter_values(const std::vector<Parameter>& parameters, const Scene& scene);

/// The scene with these values. @throws InputError for a value that no scene may have.
Scene with_parameters(const Scene& scene, const std::vector<Parameter>& parameters,
                      const VectorX& values);

/// KIND[:ELEMENT]=VALUE, comma separated: the scene with these values ("" leaves it as it is).
Scene with_settings(Scene scene, const std::string& text);

// ---- Forces behind a recorded motion, and how much of them no contact can have given.

/// What is at work from one row to the next.
struct Explanation {
  /// nv: what moved the scene beyond gravity, joints' own forces, recorded forces and contacts, per
  /// coordinate [N, N m]: of actuated coordinates whose force was not recorded their applied force,
  /// of all others unexplained.
  VectorX force;
  double unexplained_force = 0.0;   ///< of free links, over the weight of their trees
  double unexplained_torque = 0.0;  ///< the same, over weight times reach of the link's geometry
  double unexplained_joint = 0.0;   ///< largest where a force was recorded [N or N m]
  double contact_force = 0.0;       ///< sum of the normal forces over the weight of all that moves
  int contacts = 0;                 ///< within reach
};

/// Finds them step by step. Recorded motions are no solutions of a contact law: a velocity that is
/// off by a millimetre a second would be a blow. So contact forces are those within the friction
/// cones at all contacts within `reach` [m] that leave least unexplained (in the norm of inv(M)).
class Explainer {
 public:
  Explainer(const Scene& scene, const ColumnMap& map, double reach);
  ~Explainer();

  /// From `row` to `row` + 1 of the recording, `interval` [s] apart. @throws InputError where a
  /// recorded number cannot be worked with, std::runtime_error where the solver fails.
  Explanation explain(const Recording& recording, int row, double interval);

  /// nv x parameters: how `force` of the step explained last goes with them. False where contacts
  /// gave a part of it: which then depends on the cones.
  bool derive(ParameterDerivator& derivator, InverseParameterDerivatives& out);

  /// By coordinate, what makes an unexplained force a residual: of free links 1 / weight (and /
  /// reach of the geometry), of others 1; 0 where a motor may have given it.
  VectorX scales() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A whole recording.
struct ExplainedRecording {
  std::string file;
  int rows = 0;
  std::vector<double> time;  ///< of the rows where steps start [s]
  std::vector<Explanation> steps;
  std::vector<std::pair<const char*, double>> figures;  ///< under their names in the report
  bool stopped = false;
};
/// stop: asked at every row; where it says so, the result is marked and has no figures.
ExplainedRecording explain_recording(Explainer& explainer, const ColumnMap& map,
                                     const Recording& recording,
                                     const std::function<bool()>& stop = {});

/// What is left unexplained by coordinate over all steps of some recordings, but for those that a
/// motor may have moved with a force that was not recorded.
std::vector<CoordinateFigures> force_figures(const Explainer& explainer, const Model& model,
                                             const std::vector<const Recording*>& recordings,
                                             const std::vector<ExplainedRecording>& explained);

// ---- Least squares over groups of residuals (one a recording), within bounds, from many starts.

/// One vector a group, of the same sizes in every call.
using GroupedResiduals = std::vector<VectorX>;

/// Residuals and their derivatives: a matrix a group, a column a parameter.
struct LinearizedResiduals {
  GroupedResiduals residuals;
  std::vector<MatrixX> jacobians;
};

struct FitProblem {
  std::function<GroupedResiduals(const VectorX& values)> residuals;
  /// Exact derivatives by the parameters that `exact` marks, the columns of the others not looked
  /// at; none where they are not known. May be empty.
  std::function<std::optional<LinearizedResiduals>(const VectorX& values)> linearize;
  std::vector<char> exact;
  /// The residuals are rough: differences over wide steps find the way, exact derivatives finish.
  bool rough = false;
  VectorX lower, upper, start;
  std::vector<char> logarithmic;  ///< by parameter: looked for by its logarithm
};

struct FitOptions {
  int samples = 64;     ///< points tried beside the start before any is refined
  int refined = 3;      ///< of these the best are refined by Levenberg-Marquardt
  int max_rounds = 15;  ///< of Levenberg-Marquardt, each
  /// Groups far off count less: Cauchy's loss, its scale the median of the groups at the best
  /// point tried. Else plain squares.
  bool robust = true;
  int bootstrap = 0;  ///< refits to groups drawn anew; 0: intervals from derivatives only
  /// Exact derivatives where the problem has them; else differences of all.
  bool exact = true;
  /// Step of the central differences, as a share of the range between the bounds.
  double difference = 1e-3;
  /// Told by the threads at work, one at a time, in evaluations.
  std::function<void(int done, int total)> progress = {};
  /// Asked as the search goes on: true ends it with the best found so far.
  std::function<bool()> stop = {};
  /// Runs the lists of tasks that a fit is made of; by default in this thread. `residuals`
  /// and `linearize` are then called by all threads that it has.
  tasks::ListRunner run = tasks::run_here;
  /// Of all that the problem and these options depend on, for `run`.
  std::uint64_t fingerprint = 0;
};

/// The lists of a fit, one after the other: points tried, the best of them refined, refits to
/// groups drawn anew. The last one's name.
const char* last_fit_list(const FitOptions& options);

struct Interval {
  double lower = 0.0, upper = 0.0;
};

struct FittedParameter {
  double value = 0.0;
  std::optional<Interval> interval;   ///< 95 %; none where the residuals do not depend on it
  std::optional<Interval> bootstrap;  ///< 95 %, percentiles of the refits
  bool at_bound = false;
};

struct Fit {
  std::vector<FittedParameter> parameters;
  MatrixX correlation;      ///< of the estimates, by the derivatives
  double start_cost = 0.0;  ///< sum over groups of the loss, at the start
  double cost = 0.0;        ///< at the values found
  double loss_scale = 0.0;  ///< of Cauchy's loss, in the units of the residuals; 0: squares
  int evaluations = 0;      ///< of all residuals
  int linearizations = 0;   ///< of all residuals with their exact derivatives
  std::vector<double> refined_costs;  ///< of the points refined, best first
  bool stopped = false;               ///< by FitOptions::stop: intervals may be missing
  VectorX values() const;
};

/// The same input gives the same bits, whatever runs its tasks. @throws InputError where start or
/// bounds are no numbers, or there are fewer residuals than parameters.
Fit fit(const FitProblem& problem, const FitOptions& options);

// ---- Objectives of a fit: distances of predictions from recordings.

/// The recordings to be explained, and how they are predicted.
struct Experiment {
  Scene scene;
  ColumnMap map;
  std::vector<Recording> recordings;
  int num_given = 0;  ///< the first of these, without those given to be scored
  PredictionOptions prediction;
  /// Residuals are the mean deviations of each recording, else deviations at every row.
  bool by_score = false;
  double reach = 0.01;  ///< of contacts, for forces [m]
};

/// Predictions of some of the recordings by a scene.
std::vector<Prediction> predict_all(const Experiment& experiment, const Scene& scene,
                                    const std::vector<int>& which);

/// What turns a difference of coordinates (nv) into lengths: 1 for lengths of what is compared, for
/// rotations of a free link the distance of its farthest point from its origin [m]; 1 for the
/// mapped coordinates where no link is free [rad or m]; 0 for all others.
VectorX deviation_weights(const Model& model, const ColumnMap& map);

/// Residuals of each recording at given values: by score the mean deviations; else at every row
/// predicted the difference of coordinates, over the root of the number of rows. Both weighted as
/// above; rows that a failed step left out count 1 m (1 rad). Of impacts the error of the
/// velocities after in the norm of M [m/s], by score its length.
GroupedResiduals prediction_residuals(const Experiment& experiment,
                                      const std::vector<Parameter>& parameters,
                                      const VectorX& values, const std::vector<int>& which);

/// Residuals of each recording at given values: at every step the force that is unexplained
/// (Explanation), of free links over weight (and reach), of others in N or N m, over the root of
/// the number of steps.
GroupedResiduals force_residuals(const Experiment& experiment,
                                 const std::vector<Parameter>& parameters, const VectorX& values,
                                 const std::vector<int>& which);

/// Row by row: the residual of a prediction at a row that `state` stands for is
/// share * weights * (state - recorded).
struct RowWeights {
  VectorX by_coordinate;  ///< nv (deviation_weights)
  std::vector<Eigen::Index> used;
  double turning = 1.0;  ///< [m] a radian of a free link
};
RowWeights row_weights(const Experiment& experiment);

/// The residual of one recording's prediction (prediction_residuals).
VectorX prediction_residual(const Experiment& experiment, const Model& model,
                            const Recording& recording, const Prediction& prediction,
                            const RowWeights& by_row);

/// What identification solves: residuals of some of the recordings as a function of the parameters,
/// which start where the scene has them. by_force: force_residuals, else prediction_residuals. All
/// arguments must outlive it.
FitProblem fit_problem(const Experiment& experiment, const std::vector<Parameter>& parameters,
                       const std::vector<int>& which, bool by_force);

/// What a scene leaves unexplained by coordinate, over some of the recordings.
std::vector<CoordinateFigures> unexplained_figures(const Experiment& experiment, const Scene& scene,
                                                   const std::vector<int>& which);

}  // namespace counterpoint::estimation
