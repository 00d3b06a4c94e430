// Trajectory optimization through contact with configurations as the only variables: times and
// places of contacts are found, not given (docs/guide/trajectory-optimization.md).
//
//   Result result = optimize(problem, frames, settings);
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::optimization {

// ---- The problem. Its variables are the frames of a motion, and their distance h if wished.
//
// Frames q_0 ... q_N are h apart; velocities are differences, v_t = (q_t (-) q_{t-1}) / h, and u_t
// is the applied force of the step from frame t to t + 1 that step_inverse recovers from (q_t, v_t,
// v_{t+1}). The objective is a sum of squares,
//
//   minimize over q   1/2 sum over frames, terms of | weight (value - target) |^2
//
// subject to conditions, terms that must vanish. One of them is zero force where there is no motor
// (kUnactuatedForce). After Kurtz, Castro, Oncul and Lin, "Inverse Dynamics Trajectory Optimization
// for Contact-Implicit Model Predictive Control" (2023), and Todorov, "A convex, smooth and
// invertible contact model for trajectory optimization" (ICRA 2011).

/// Value of a term, with its number of rows. Quantities of a frame depend on (q_{t-1}, q_t);
/// quantities of a step, from frame t to t + 1, also on q_{t+1}.
enum class Quantity {
  // nv rows, for a frame
  kConfiguration,  ///< q_t (-) target [m, rad]; target: nq
  kVelocity,       ///< v_t [m/s, rad/s]
  kJointLimits,    ///< excess over the joint limits, which are tightened by `length` [m, rad]
  // nv rows, for a step
  kAcceleration,     ///< (v_{t+1} - v_t) / h [m/s^2, rad/s^2]
  kAppliedForce,     ///< u_t [N, N m]
  kEffortLimits,     ///< excess of u_t over the effort limits of the joints [N, N m]
  kUnactuatedForce,  ///< the same, for coordinates without a motor
  // for a frame, and a point or a body
  kPosition,         ///< 3 rows: position of the point in W [m]
  kOrientation,      ///< 3 rows: log(R_target' R_WB) [rad]
  kPointVelocity,    ///< 3 rows: displacement of the point over h, divided by h, in W [m/s]
  kClearance,        ///< 1 row: target minus height of the point, clipped at zero [m]
  kSliding,          ///< 2 rows: horizontal velocity of the point times exp(-height / length) [m/s]
  kTilt,             ///< 2 rows: horizontal part of a body axis times exp(-height / length) [1]
  kCenterOfMass,     ///< 3 rows: centre of mass of all bodies, or of the body's tree, in W [m]
  kMomentum,         ///< 3 rows: linear momentum of the same bodies in W [kg m/s]
  kAngularMomentum,  ///< 3 rows: of all bodies about their centre of mass, in W [kg m^2/s]
  // for a step, and a body
  kContactForce,  ///< 3 rows: sum of the contact forces on the body, in W [N]
  // for the whole motion
  kDuration,  ///< 1 row: N h [s]
};
/// Name in problem files: "configuration", "applied_force", ...
const char* quantity_name(Quantity quantity);
std::optional<Quantity> quantity_from_name(const std::string& name);
std::string quantity_names();
/// True for quantities of a step, false for those of a frame.
bool of_step(Quantity quantity);
/// True for quantities with one row per coordinate of v.
bool of_coordinates(Quantity quantity);
int rows_of(const Model& model, Quantity quantity);
/// Power of 1/h in a quantity while the frames are held: 1 for velocities and momenta, 2 for
/// accelerations, -1 for the duration, else 0. Forces follow no power; 0 for them, too.
int rate_order(Quantity quantity);

/// Frames first ... last; negative values count from the end, -1 is the last frame.
struct FrameRange {
  int first = 0, last = -1;
};

class Reference;  // reference.h

struct Term {
  Quantity quantity = Quantity::kConfiguration;
  std::string name;  ///< name in reports
  VectorX weight;    ///< per row, in inverse units of the value
  VectorX target;    ///< per row, or nq for kConfiguration; empty: zero
  /// kConfiguration: if not empty (nv), the target is start_q (+) offset; entries without weight do
  /// not matter. A Planner counts it from the present state [m, rad].
  VectorX offset;
  /// One target per frame 0 ... N, in place of `target`; kOrientation: unit quaternions w x y z.
  /// One that contains NaN is unknown, and the term has no residual in that frame.
  std::vector<VectorX> targets;
  /// Source of `targets`, which a Planner moves on with time; may be null.
  std::shared_ptr<const Reference> reference;
  bool condition = false;  ///< the term must vanish (newton.h) instead of being weighed against the
                           ///< others
  FrameRange frames;
  /// One entry per frame 0 ... N: 0 where the term does not count although `frames` has the frame;
  /// empty: it counts in all of them. Not for a Planner, whose frames move on with time.
  std::vector<char> active;
  int body = 0;                               ///< index into Model::bodies
  Vector3 point = Vector3::Zero();            ///< in the body frame [m]
  Vector3 axis = Vector3::UnitZ();            ///< kTilt: unit vector in the body frame
  Matrix3 orientation = Matrix3::Identity();  ///< kOrientation: R_target, from body axes to W
  double radius = 0.0;                        ///< subtracted from the heights of the point [m]
  double length = 0.05;                       ///< length scale [m, rad], see Quantity
  /// Factor by which the weight grows as smoothing falls from kLateFrom to kLateTo, for terms that
  /// would block the search while contacts are forming.
  double late_weight = 1.0;

  const VectorX& target_at(int frame) const {
    return targets.empty() ? target : targets[static_cast<std::size_t>(frame)];
  }
  bool known_at(int frame) const {
    return targets.empty() || !targets[static_cast<std::size_t>(frame)].hasNaN();
  }
};

/// Range of smoothing [m] over which late weights grow.
inline constexpr double kLateFrom = 1e-2, kLateTo = 1e-5;

/// A reflection of configurations in the plane y = 0: coordinates are permuted and change sign.
struct Mirror {
  std::vector<int> q_index, v_index;  ///< mirrored[i] = sign[i] original[index[i]]
  VectorX q_sign, v_sign;
};
/// Builds the mirror of a model whose joint names contain left and right: `left` in a name becomes
/// `right` and vice versa; other joints map to themselves. Signs follow from the axes at the
/// default pose. @throws InputError if a joint has no partner, or its axes are not mirror images.
Mirror make_mirror(const Model& model, const std::string& left, const std::string& right);

/// Bounds of a duration [s].
struct DurationRange {
  double least = 0.0, most = 0.0;
};

struct Problem {
  const Model* model = nullptr;
  /// Options of the steps at the end of the continuation; time_step is h.
  SimulationOptions options;
  int steps = 0;  ///< N
  /// If set, h is an unknown, too: N h lies within this range, and options.time_step is where the
  /// search starts, moved into the range. Not for a Planner.
  std::optional<DurationRange> duration;
  /// Frame t + N equals frame t after the mirror (if any) and a shift of every floating tree by
  /// `displacement` [m]. Variables are frames 0 ... N - 1 if periodic, otherwise 1 ... N (-1 ... N
  /// with a free start) without those fixed by a goal.
  bool periodic = false;
  Vector3 displacement = Vector3::Zero();
  std::optional<Mirror> mirror;
  VectorX start_q, start_v;  ///< frame 0 and its velocity, if not periodic
  /// Frames 0 and -1 are variables, too: pose and velocity at the start are free.
  bool free_start = false;
  std::optional<VectorX> goal_q;  ///< frame N; if absent, the end is free
  VectorX goal_v;                 ///< nv: velocity at frame N, used with goal_q
  /// Start and goal are standing poses: at each smoothing, their floating trees are raised or
  /// lowered until contacts carry their weight.
  bool settle = false;
  std::vector<Term> terms;
  /// nv: 1 for coordinates with an active motor. See motors_of.
  std::vector<char> motors;

  double h() const { return options.time_step; }
};

/// Marks the coordinates (nv) of actuated joints; free bases are not actuated.
std::vector<char> motors_of(const Model& model);
/// Weights (nv) for kUnactuatedForce: zero with a motor, otherwise 1 over the weight of the
/// coordinate's tree [N], or 1 over weight times `lever` [m] for torques. For a single-body tree
/// the lever is at most twice its radius of gyration.
VectorX unactuated_weights(const Model& model, const std::vector<char>& motors, double lever = 0.5);
/// The condition that coordinates without a motor have no applied force, in weights of the trees.
Term unactuated_condition(const Model& model, const std::vector<char>& motors, double lever = 0.5);
/// g0 times the mass of all bodies [N].
double scene_weight(const Model& model);

/// Returns steps + 1 frames on a straight line between two configurations.
std::vector<VectorX> straight_line(const Model& model, const VectorX& from, const VectorX& to,
                                   int steps);

/// @throws InputError if sizes or indices do not fit the model.
void check_problem(const Problem& problem);

// ---- The search.

/// Maximum of a quantity over a motion, and mean over the frames.
struct Spread {
  double max = 0.0, mean = 0.0;
};

/// Report of one Newton iteration.
struct Iteration {
  bool accepted = false;
  double cost = 0.0, decrease = 0.0;
  double step = 0.0;  ///< largest change of a coordinate [m, rad]
  double damping = 0.0;
  int trials = 0;
  double linearize_seconds = 0.0, factor_seconds = 0.0, trial_seconds = 0.0;
};

struct Stage;  // terms/evaluator.h

/// Schedule of the smoothing: from far-reaching soft contacts, through which contact forces are
/// found, to the problem's own contact options.
struct Continuation {
  double start = 0.1;         ///< first smoothing [m]
  std::optional<double> end;  ///< last smoothing [m]; default: that of the problem's options
  /// Smoothing [m] from which a stopped run continues.
  std::optional<double> resume_at;
  double factor = 2.0;        ///< initial ratio of the smoothings of two stages
  double max_factor = 2.0;    ///< upper bound of the ratio, which grows while stages need few
                              ///< iterations
  double hard_factor = 10.0;  ///< ratio below 2e-9 m
  /// Compliance per smoothing [1/m], but not below the problem's compliance: with stiff
  /// far-reaching laws, Newton's method overshoots into a wall.
  double compliance_per_metre = 10.0;
  /// The contact margin is at least this multiple of the smoothing; objects to be pushed from afar
  /// must lie within it.
  double margin_per_smoothing = 0.0;
  /// Above this smoothing [m] overlaps are recovered in one step at any speed; between it and 1e-6
  /// m the recovery changes to that of the problem's options.
  double quick_recovery_above = 3e-5;
  /// Extrapolate the last two stages linearly to start the next one, if that lowers the cost.
  bool extrapolate = true;
  double limits_below = 1e-4;  ///< joint limits act at and below this smoothing [m]
  double penalty_start = 10.0, penalty_end = 1e4;  ///< penalties of conditions at the first
                                                   ///< smoothing and below 1e-6 m
  /// Weight of relative changes of contact forces in the damping (newton.h), for bodies that tilt
  /// over light contacts: 0 none, 50 usual.
  double contact_damping = 0.0;
  int rounds = 2;                  ///< rounds of minimization and multiplier update per stage
  double multiplier_limit = 0.03;  ///< multipliers are updated only if all violations are below
                                   ///< this
};

/// State after a Newton iteration, accepted or not, reported during the search.
struct Progress {
  int iteration = 0;  ///< counted over all stages
  int stage = 0;
  double smoothing = 0.0;  ///< [m]
  double penalty = 0.0;
  double cost = 0.0;
  Spread unactuated;     ///< weights of the trees
  Spread violation;      ///< violation of all conditions
  double seconds = 0.0;  ///< time since the start [s]
  Iteration step;
};

enum class Outcome {
  kConverged,   ///< the conditions hold to violation_tolerance at the last smoothing
  kInfeasible,  ///< the last stage ended with larger violations
  kIterations,  ///< max_iterations was reached
  kStopped,     ///< progress() returned false
};
const char* outcome_name(Outcome outcome);

struct Result {
  Outcome outcome = Outcome::kInfeasible;
  std::vector<VectorX> q;              ///< frames 0 ... N
  std::vector<VectorX> v;              ///< velocities of frames 0 ... N
  std::vector<VectorX> applied_force;  ///< forces of the N steps
  double cost = 0.0;                   ///< without conditions
  VectorX cost_by_term;
  Spread unactuated, violation;
  double smoothing = 0.0;     ///< smoothing of the last stage [m]
  SimulationOptions options;  ///< options of the last stage; time_step is the h that was found
  int iterations = 0;         ///< Newton steps
  int stages = 0, refused_stages = 0;
  std::vector<Progress> history;
  double seconds = 0.0;
};

struct Settings {
  int threads = 0;            ///< 0: one per core
  int max_iterations = 600;   ///< limit of Newton iterations over all stages
  int stage_iterations = 40;  ///< limit of Newton iterations per minimization
  double tolerance = 1e-3;    ///< a minimization ends when a step lowers the cost by less than this
                              ///< fraction
  double violation_tolerance = 1e-5;  ///< limit for the conditions at the end
  Continuation continuation;
  DerivativeMethod derivatives = DerivativeMethod::kAnalytic;
  /// Called after every Newton iteration; false stops the search, which returns the current motion.
  std::function<bool(const Progress&)> progress;
  /// Called before `progress` with a function that returns the motion so far, without its history.
  std::function<void(const Progress&, const std::function<Result()>& so_far)> watch;
  /// Called after every stage with the motion so far, without its history.
  std::function<void(const Result&)> stage_done;
};

/// Optimizes a motion. start: initial frames q_0 ... q_N (straight_line, or an earlier result).
/// @throws InputError as check_problem and Frames.
Result optimize(const Problem& problem, const std::vector<VectorX>& start,
                const Settings& settings = {});

/// Returns the stage of the continuation at a smoothing [m].
Stage stage_at(const Problem& problem, const Settings& settings, double smoothing);

// ---- Problem files in YAML (docs/reference/optimization-format.md).

struct Retargeting;  // retarget.h

/// A problem read from a file, and the objects it refers to.
struct ProblemFile {
  std::filesystem::path file, scene_file;
  std::vector<std::filesystem::path> read_files;  ///< tables of targets
  std::string name;
  std::shared_ptr<const Scene> scene;  ///< owns the model of `problem`
  Problem problem;
  Settings settings;           ///< continuation, iteration limits and tolerances from the file
  std::vector<VectorX> guess;  ///< initial frames 0 ... N, without noise
  double noise = 0.0;  ///< standard deviation of the noise that seeds add to joint coordinates
                       ///< [rad, m]
  std::shared_ptr<const Retargeting> retargeting;  ///< null: the file has no key `retarget`
};

/// Loads a problem. steps: replaces the number of steps in the file. @throws InputError naming
/// file, line, element and the expected value.
ProblemFile load_problem(const std::filesystem::path& file, std::optional<int> steps = {});

/// Returns the guess with noise on all joint coordinates except those of floating joints; seed 0
/// adds no noise. Reproducible bitwise for each seed.
std::vector<VectorX> seeded_guess(const ProblemFile& file, std::uint64_t seed);

/// Returns whether `name` matches a pattern in which '*' stands for any characters.
bool matches(const std::string& pattern, const std::string& name);

// ---- Verification of a motion: does a forward step from each frame reach the next one?

/// Results over all steps of a motion.
struct Verification {
  /// Largest coordinate difference [m, rad] between frame t + 1 and the result of step_forward from
  /// frame t under the recovered force.
  double forward_check_max = 0.0;
  int forward_failures = 0;      ///< forward steps that failed, were softened, or had taut links
  double unactuated_max = 0.0;   ///< largest force without a motor, weighted by unactuated_weights
  double unactuated_mean = 0.0;  ///< mean over the steps of the largest one in each
  double overlap_max = 0.0;      ///< largest overlap [m]
  double cone_violation_max = 0.0;  ///< friction beyond mu times the normal force, in weights of
                                    ///< the scene
  /// Largest slip in one step [m] of contacts that carry more than kLoaded of the weight. Stance:
  /// the pair was loaded in the step before, too; landing: it was not.
  double stance_slip_max = 0.0, landing_slip_max = 0.0;
  double effort_max = 0.0;         ///< largest ratio of applied force to effort limit
  double contact_force_max = 0.0;  ///< largest normal force, in weights of the scene
};

/// A contact is loaded if it carries this fraction of the scene's weight.
inline constexpr double kLoaded = 0.05;

/// Verifies a motion with frames q, options.time_step apart. v_0 (nv): velocity of frame 0.
Verification verify(const Model& model, const SimulationOptions& options,
                    const std::vector<char>& motors, const std::vector<VectorX>& q,
                    const VectorX& v_0);

/// Verifies a motion step by step; `out` accumulates the worst values.
class Verifier {
 public:
  Verifier(const Model& model, const SimulationOptions& options, const std::vector<char>& motors);
  /// Adds a step from (q, v) to (q_next, v_next). Returns its inverse dynamics.
  const Inverse& add_step(const VectorX& q, const VectorX& v, const VectorX& q_next,
                          const VectorX& v_next, Verification& out);

 private:
  void check_forward(const VectorX& q, const VectorX& v, const VectorX& q_next, Verification& out);
  void check_contacts(const VectorX& q, const VectorX& v_next, Verification& out);
  void check_forces(Verification& out);

  const Model* model_;
  SimulationOptions options_;
  Workspace workspace_;
  Inverse inverse_;
  VectorX unactuated_;                                       ///< nv: unactuated_weights
  double weight_;                                            ///< scene_weight [N]
  std::vector<std::pair<int, int>> loaded_, loaded_before_;  ///< pairs of geometries
  int steps_ = 0;
};

/// Converts the contact forces of an inverse at q to the memory of a state: if a forward step has
/// several solutions, it then finds that of the plan.
std::vector<RememberedForce> memory_of(const Model& model, const VectorX& q,
                                       const Inverse& inverse);

}  // namespace counterpoint::optimization
