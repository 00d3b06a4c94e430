// Identification of a scene from recordings: parameters by name, inverse dynamics of a recorded
// motion, objectives, and nonlinear least squares.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/tasks.h"

namespace counterpoint::estimation {

// ---- Named parameters of a scene that can be set or identified: "friction", "mass:cube",
// "damping:elbow".

enum class ParameterKind {
  kFriction,
  kStaticFriction,
  kRestitution,
  kTorsionalFriction,
  kRollingFriction,
  kStiffness,
  kPlaceX,  ///< places and tilts of geometries, along and about their axes
  kPlaceY,
  kPlaceZ,
  kTiltX,
  kTiltY,
  kTiltZ,
  kMass,
  kInertia,
  kCenterX,  ///< centres, shears and spreads are in axes of the link's file
  kCenterY,
  kCenterZ,
  kShearXY,  ///< shears and spreads deform the body about its centre of mass
  kShearXZ,
  kShearYZ,
  kSpreadX,
  kSpreadY,
  kSpreadZ,
  kSize,
  kDamping,
  kDryFriction,
  kBreakawayFriction,
  kStribeckSpeed,
  kArmature,
  kSpringStiffness,
  kSpringReference,
  kServoStiffness,
  kServoDamping,
  kGear,  ///< gears of actuators, as the three after it
  kGain,
  kTorqueConstant,
  kResistance,
  kJointX,  ///< place of a joint in the link that carries it
  kJointY,
  kJointZ,
  kJointZero,    ///< the scene's coordinate where the joint is at zero
  kForceOffset,  ///< offset, gain and delay of the recorded force of a joint, not of the scene
  kForceGain,
  kForceDelay,
  kGravity,
  kHeight,
  kCompliance,
  kSmoothing,
  kStabilization,
  kMaxRecoverySpeed,
};

/// One scalar parameter of a scene, with the bounds of the search. All its targets share the value.
struct Parameter {
  ParameterKind kind = ParameterKind::kFriction;
  std::string name;  ///< KIND or KIND:ELEMENT, as written by the user; KIND:A+~B if it is tied
  std::string unit;
  double lower = 0.0, upper = 0.0;
  bool logarithmic = false;  ///< the search uses its logarithm
  std::vector<int> targets;  ///< indices of geometries, bodies, coordinates of v, springs, servos
                             ///< or actuators, depending on the kind
  std::vector<double> signs = {};  ///< -1 for each target that takes the negative value, otherwise
                                   ///< 1; empty: all 1
  /// Standard deviation of the prior about the scene's value, in the parameter's unit; none: that
  /// of the objective, if it has priors.
  std::optional<double> deviation = {};

  double sign(std::size_t index) const { return signs.empty() ? 1.0 : signs[index]; }
  double sign_of(int target) const;  ///< the same by target; 0 if it is none of the parameter
};

/// Parses KIND[:ELEMENT[+ELEMENT...]][=LOW..HIGH][~DEVIATION], comma separated, or the YAML file of
/// "@FILE", for this scene. Kinds, elements, units, default bounds and the file's format:
/// docs/reference/recording-format.md. @throws InputError that names the unknown part, or file and
/// line, and lists the valid ones.
std::vector<Parameter> parse_parameters(const std::string& text, const Scene& scene);

/// Returns the value of each parameter in the scene: the mean over its targets, each with its sign.
VectorX parameter_values(const std::vector<Parameter>& parameters, const Scene& scene);

/// Returns the scene with these parameter values. @throws InputError for a value outside the range
/// that a scene allows.
Scene with_parameters(const Scene& scene, const std::vector<Parameter>& parameters,
                      const VectorX& values);

/// Applies KIND[:ELEMENT[+ELEMENT...]]=VALUE, comma separated, to a scene ("" leaves it unchanged);
/// "@FILE": the lines of a file, in which '#' begins a comment. @throws InputError naming the part
/// that is wrong, or a file that cannot be read.
Scene with_settings(Scene scene, const std::string& text);

// ---- Forces behind a recorded motion, and the part that contacts cannot have exerted.

/// The forces that act from one row of a recording to the next.
struct Explanation {
  /// nv: generalized force beyond gravity, passive joint forces, recorded forces and contact forces
  /// [N, N m]. In actuated coordinates without a recorded force it is the applied force; in all
  /// others it is unexplained.
  VectorX force;
  double unexplained_force = 0.0;   ///< largest over floating links, in weights of their trees
  double unexplained_torque = 0.0;  ///< the same, in weight times radius of the link's geometry
  double unexplained_joint = 0.0;   ///< largest over joints without actuator or with a recorded
                                    ///< force [N or N m]
  double contact_force = 0.0;       ///< sum of normal forces, in weights of all moving bodies
  int contacts = 0;                 ///< number of contacts within reach
};

/// Computes the explanation of a recording step by step. A recorded motion does not satisfy a
/// contact law: a velocity error of 1 mm/s would count as an impact. Contact forces are therefore
/// chosen within the friction cones of all contacts within `reach` [m] so that the unexplained
/// force is minimal in the norm of inv(M).
class Explainer {
 public:
  Explainer(const Scene& scene, const ColumnMap& map, double reach);
  ~Explainer();

  /// Explains the step from `row` to `row` + 1 of the recording, `interval` [s] apart. @throws
  /// InputError if a recorded value is invalid, std::runtime_error if the contact solver fails.
  Explanation explain(const Recording& recording, int row, double interval);

  /// Computes the derivatives (nv x parameters) of `force` of the step explained last. Returns
  /// false if that step had contacts, whose forces depend on the cones.
  bool derive(ParameterDerivator& derivator, InverseParameterDerivatives& out);

  /// Weights (nv) that turn unexplained forces into residuals: 1 / weight for the force on a
  /// floating link (and 1 / radius of its geometry for the torque), 1 for other joints, and 0 where
  /// an unrecorded motor force may act.
  VectorX scales() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Explanation of a whole recording.
struct ExplainedRecording {
  std::string file;
  int rows = 0;
  std::vector<double> time;  ///< times of the rows where steps start [s]
  std::vector<Explanation> steps;
  std::vector<std::pair<const char*, double>> metrics;  ///< metrics by their names in the report
  bool stopped = false;
};
/// Explains all steps. `stop` is called before every row; if it returns true, the result is marked
/// as stopped and has no metrics.
ExplainedRecording explain_recording(Explainer& explainer, const ColumnMap& map,
                                     const Recording& recording,
                                     const std::function<bool()>& stop = {});

/// Statistics of the unexplained force per coordinate, over all steps of the recordings.
/// Coordinates with an unrecorded motor force are left out.
std::vector<CoordinateMetrics> force_metrics(const Explainer& explainer, const Model& model,
                                             const std::vector<const Recording*>& recordings,
                                             const std::vector<ExplainedRecording>& explained);

// ---- Nonlinear least squares over groups of residuals (one group per recording), within bounds,
// from several starts.

/// One residual vector per group; sizes are the same in every call.
using GroupedResiduals = std::vector<VectorX>;

/// Residuals and their Jacobians: one matrix per group, one column per parameter.
struct LinearizedResiduals {
  GroupedResiduals residuals;
  std::vector<MatrixX> jacobians;
};

struct FitProblem {
  std::function<GroupedResiduals(const VectorX& values)> residuals;
  /// Residuals with exact derivatives with respect to the parameters marked in `exact`; the other
  /// columns are ignored. Returns nullopt at values where derivatives are unavailable. May be
  /// empty.
  std::function<std::optional<LinearizedResiduals>(const VectorX& values)> linearize;
  std::vector<char> exact;
  /// The residuals are not smooth: the search uses finite differences over wide steps, and exact
  /// derivatives only to finish.
  bool rough = false;
  VectorX lower, upper, start;
  std::vector<char> logarithmic;  ///< per parameter: the search uses its logarithm
};

struct FitOptions {
  int samples = 64;  ///< points evaluated besides the start, before refinement
  int refined = 3;   ///< number of best points refined by Levenberg-Marquardt
  /// Limit of Levenberg-Marquardt iterations per refined point; 0: none is refined.
  int max_rounds = 15;
  /// Robust: Cauchy loss per group, with the median group norm at the best sampled point as its
  /// scale. Otherwise plain squares.
  bool robust = true;
  int bootstrap = 0;  ///< refits to resampled groups; 0: intervals from derivatives only
  /// Use exact derivatives where the problem has them; otherwise finite differences for all
  /// parameters.
  bool exact = true;
  /// Step of the central differences, as a fraction of the range between the bounds.
  double difference = 1e-3;
  /// Progress in evaluations, called by the worker threads one at a time.
  std::function<void(int done, int total)> progress = {};
  /// Called during the search; true ends it with the best point so far.
  std::function<bool()> stop = {};
  /// Runs the task lists of a fit; by default in the calling thread. `residuals` and `linearize`
  /// are then called concurrently by all of its threads.
  tasks::ListRunner run = tasks::run_here;
  /// Hash of everything that the problem and these options depend on, for `run`.
  std::uint64_t fingerprint = 0;
};

/// Returns the name of the last task list. The lists of a fit run in this order: sampled points,
/// refinement of the best, refits to resampled groups.
const char* last_fit_list(const FitOptions& options);

struct Interval {
  double lower = 0.0, upper = 0.0;
};

struct FittedParameter {
  double value = 0.0;
  std::optional<Interval> interval;  ///< 95 %; none if the residuals do not depend on the parameter
  std::optional<Interval> bootstrap;  ///< 95 %, from percentiles of the refits
  bool at_bound = false;
};

struct Fit {
  std::vector<FittedParameter> parameters;
  MatrixX correlation;  ///< correlation of the estimates, from the Jacobian
  MatrixX covariance;   ///< covariance of the values, meaningful where they have intervals
  /// Information of the recordings on the parameters (logarithms of logarithmic ones), without
  /// priors: J'J of residuals over their standard deviations; and its diagonal by recording
  /// (parameters x recordings). Empty if the fit was stopped.
  MatrixX information, information_by_recording;
  double start_cost = 0.0;  ///< sum over groups of the loss, at the start
  double cost = 0.0;        ///< the same at the estimate
  double loss_scale = 0.0;  ///< scale of the Cauchy loss, in units of the residuals; 0: squares
  int evaluations = 0;      ///< number of evaluations of all residuals
  int linearizations = 0;   ///< number of evaluations of all residuals and exact derivatives
  std::vector<double> refined_costs;  ///< costs of the refined points, best first
  bool stopped = false;               ///< FitOptions::stop ended the fit: intervals may be missing
  VectorX values() const;
};

/// Minimizes the cost. The result is bitwise reproducible, whatever runs its tasks. @throws
/// InputError if start or bounds are not finite, or there are fewer residuals than parameters.
Fit fit(const FitProblem& problem, const FitOptions& options);

// ---- Objectives of a fit: distances between predictions and recordings.

/// Recordings and the options of their prediction.
struct Experiment {
  Scene scene;
  ColumnMap map;
  std::vector<Recording> recordings;
  int num_given = 0;  ///< number of leading recordings that were given to be fitted; the rest are
                      ///< for scoring
  PredictionOptions prediction;
  /// True: residuals are the mean deviations of each recording; false: deviations at every row.
  bool by_score = false;
  double reach = 0.01;  ///< largest gap of a contact that may exert a force [m]
};

/// Predicts the recordings `which` with a scene.
std::vector<Prediction> predict_all(const Experiment& experiment, const Scene& scene,
                                    const std::vector<int>& which);

/// Weights (nv) that turn coordinate differences into lengths. With a compared floating link: 1 for
/// its translation, and for its rotation the distance of its farthest point from its origin [m].
/// Otherwise 1 for the mapped coordinates [rad or m]. 0 elsewhere.
VectorX deviation_weights(const Model& model, const ColumnMap& map);

/// Residuals of each recording at given parameter values. By score: the mean deviations. Otherwise:
/// the weighted coordinate difference at every predicted row, over the root of the number of rows.
/// Weights as above; rows lost to a failed step count 1 m (1 rad). For impacts: the error of the
/// post-impact velocity in the norm of M [m/s]; by score, its length.
GroupedResiduals prediction_residuals(const Experiment& experiment,
                                      const std::vector<Parameter>& parameters,
                                      const VectorX& values, const std::vector<int>& which);

/// Residuals of each recording at given parameter values: the unexplained force of every step
/// (Explanation) times Explainer::scales(), over the root of the number of steps.
GroupedResiduals force_residuals(const Experiment& experiment,
                                 const std::vector<Parameter>& parameters, const VectorX& values,
                                 const std::vector<int>& which);

/// Weights of the per-row residual: share * weights * (state - recorded), for a predicted `state`.
struct RowWeights {
  VectorX by_coordinate;  ///< nv (deviation_weights)
  std::vector<Eigen::Index> used;
  double turning = 1.0;  ///< lever arm that turns rotations of a floating link into lengths [m]
};
RowWeights row_weights(const Experiment& experiment);

/// Residual of one recording's prediction (prediction_residuals).
VectorX prediction_residual(const Experiment& experiment, const Model& model,
                            const Recording& recording, const Prediction& prediction,
                            const RowWeights& by_row);

/// Builds the least-squares problem of identification for the recordings `which`; parameters start
/// at the scene's values. by_force: force_residuals, otherwise prediction_residuals. All arguments
/// must outlive the problem.
FitProblem fit_problem(const Experiment& experiment, const std::vector<Parameter>& parameters,
                       const std::vector<int>& which, bool by_force);

/// Statistics of the unexplained force of a scene per coordinate, over the recordings `which`.
std::vector<CoordinateMetrics> unexplained_metrics(const Experiment& experiment, const Scene& scene,
                                                   const std::vector<int>& which);

}  // namespace counterpoint::estimation
