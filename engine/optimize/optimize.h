// Trajectory optimization through contact with positions as the only unknowns: contact times and
// places are found, not given (docs/guide/trajectory-optimization.md).
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

// ---- The problem: the frames of a motion are its variables, and nothing else.
//
// Frames q_0 ... q_N are h apart; velocities are differences, v_t = (q_t (-) q_{t-1}) / h, and the
// applied forces u_t of the step from frame t to frame t + 1 are those that step_inverse recovers
// from (q_t, v_t, v_{t+1}). What is wanted of the motion is a sum of squares,
//
//   minimize over q   1/2 sum over frames, terms of | weight (value - target) |^2
//
// subject to conditions, terms that are to vanish; one is that there is no force where
// there is no motor (kUnactuatedForce). After Kurtz, Castro, Oncul and Lin, "Inverse Dynamics
// Trajectory Optimization for Contact-Implicit Model Predictive Control" (2023), and Todorov, "A
// convex, smooth and invertible contact model for trajectory optimization" (ICRA 2011).

/// What a term is about, by rows. A frame has what (q_{t-1}, q_t) tells; a step, from frame t to
/// t + 1, what needs q_{t+1} too.
enum class Quantity {
  // nv rows, of a frame
  kConfiguration,  ///< q_t (-) target [m, rad]; target: nq
  kVelocity,       ///< v_t [m/s, rad/s]
  kJointLimits,    ///< how far a coordinate is beyond `length` before its limit [m, rad]
  // nv rows, of a step
  kAcceleration,     ///< (v_{t+1} - v_t) / h
  kAppliedForce,     ///< u_t [N, N m]
  kUnactuatedForce,  ///< the same
  // of a frame, and of a point or a body
  kPosition,         ///< 3 rows: of the point, in W [m]
  kOrientation,      ///< 3 rows: log(R_target' R_WB) [rad]
  kPointVelocity,    ///< 3 rows: change of the point's position over h, in W [m/s]
  kClearance,        ///< 1 row: target less the point's height, where that is positive [m]
  kSliding,          ///< 2 rows: horizontal velocity of the point times exp(-height / length) [m/s]
  kTilt,             ///< 2 rows: horizontal part of a body axis times exp(-height / length) [1]
  kCenterOfMass,     ///< 3 rows: of all that moves, or of the body's tree [m]
  kMomentum,         ///< 3 rows: mass times the velocity of that point [kg m/s]
  kAngularMomentum,  ///< 3 rows: about the centre of mass [kg m^2/s]
  // of a step, and of a body
  kContactForce,  ///< 3 rows: of all contacts on the body, in W [N]
};
/// As in problem files: "configuration", "applied_force", ...
const char* quantity_name(Quantity quantity);
std::optional<Quantity> quantity_from_name(const std::string& name);
std::string quantity_names();
/// Is it of a step, not of a frame?
bool of_step(Quantity quantity);
/// Has it a row for every coordinate of v?
bool of_coordinates(Quantity quantity);
int rows_of(const Model& model, Quantity quantity);

/// Frames first ... last; negative ones are counted from the end, -1 being the last.
struct FrameRange {
  int first = 0, last = -1;
};

struct Term {
  Quantity quantity = Quantity::kConfiguration;
  std::string name;        ///< in reports
  VectorX weight;          ///< by row, inverse units of the value
  VectorX target;          ///< by row, or nq for kConfiguration; empty: zero
  bool condition = false;  ///< driven to zero (newton.h) instead of weighed against the others
  FrameRange frames;
  int body = 0;                               ///< index into Model::bodies
  Vector3 point = Vector3::Zero();            ///< in the body frame [m]
  Vector3 axis = Vector3::UnitZ();            ///< kTilt: in the body frame, unit length
  Matrix3 orientation = Matrix3::Identity();  ///< kOrientation: the target
  double radius = 0.0;                        ///< heights are of the point less this [m]
  double length = 0.05;                       ///< [m, rad], see Quantity
  /// The weight grows by this factor as smoothing falls from kLateFrom to kLateTo: for what would
  /// block the search while contacts are forming.
  double late_weight = 1.0;
};

/// Smoothing [m] between which late weights grow.
inline constexpr double kLateFrom = 1e-2, kLateTo = 1e-5;

/// A reflection of configurations in the plane y = 0: coordinates change places and signs.
struct Mirror {
  std::vector<int> q_index, v_index;  ///< mirrored[i] = sign[i] original[index[i]]
  VectorX q_sign, v_sign;
};
/// The mirror of a model whose joints' names say left and right: `left` in a name becomes `right`
/// and the reverse; all other joints stay. Signs follow from the axes at the default pose.
/// @throws InputError where a joint has no partner, or axes that are no mirror image.
Mirror make_mirror(const Model& model, const std::string& left, const std::string& right);

struct Problem {
  const Model* model = nullptr;
  /// How steps are done at the end of the continuation: `contact`, `effects`. time_step is h.
  SimulationOptions options;
  int steps = 0;  ///< N
  /// Frame t + N is frame t, mirrored if there is a mirror, and moved by `displacement` [m] (every
  /// floating tree). Frames 0 ... N - 1 are the variables. Else frames 1 ... N are.
  bool periodic = false;
  Vector3 displacement = Vector3::Zero();
  std::optional<Mirror> mirror;
  VectorX start_q, start_v;       ///< frame 0 and the velocity there; not periodic
  std::optional<VectorX> goal_q;  ///< frame N; none: free
  VectorX goal_v;                 ///< nv: velocity at frame N, with goal_q
  /// Start and goal stand: their floating trees are raised or lowered, at each smoothing, until
  /// contacts carry their weight.
  bool settle = false;
  std::vector<Term> terms;
  /// nv: is a motor there? As motors_of gives it, less those that are to do nothing.
  std::vector<char> motors;

  double h() const { return options.time_step; }
};

/// nv: has the joint a motor? All but free bases do.
std::vector<char> motors_of(const Model& model);
/// Weights for kUnactuatedForce (nv): zero where there is a motor, else one over the weight of the
/// coordinate's tree [N], or that times `lever` [m] for torques; of a body on its own twice its
/// radius of gyration, if that is shorter.
VectorX unactuated_weights(const Model& model, const std::vector<char>& motors, double lever = 0.5);
/// The term that nothing pushes where no motor is, as a condition. Units: weights of trees.
Term unactuated_condition(const Model& model, const std::vector<char>& motors, double lever = 0.5);
/// g0 times the mass of all bodies [N].
double scene_weight(const Model& model);

/// Frames on a straight line between two configurations: steps + 1 of them.
std::vector<VectorX> straight_line(const Model& model, const VectorX& from, const VectorX& to,
                                   int steps);

/// @throws InputError where sizes or indices do not fit the model.
void check_problem(const Problem& problem);

// ---- The search.

/// The largest of a quantity over a motion, and its mean over the frames.
struct Spread {
  double max = 0.0, mean = 0.0;
};

/// How one iteration went.
struct Iteration {
  bool accepted = false;
  double cost = 0.0, decrease = 0.0;
  double step = 0.0;  ///< largest change of a coordinate [m, rad]
  double damping = 0.0;
  int trials = 0;
  double linearize_seconds = 0.0, factor_seconds = 0.0, trial_seconds = 0.0;
};

struct Stage;  // terms/evaluator.h

/// How smoothing falls: from far-reaching soft contacts, through which forces are found, to those
/// of the problem's own options.
struct Continuation {
  double start = 0.1;         ///< smoothing [m] of the first stage
  std::optional<double> end;  ///< of the last; none: that of the problem's options
  /// The smoothing [m] to go on from, where a run was stopped.
  std::optional<double> resume_at;
  double factor = 2.0;        ///< from stage to stage, at first
  double max_factor = 2.0;    ///< while stages need few iterations
  double hard_factor = 10.0;  ///< below 2e-9 m
  /// Compliance falls with smoothing [1/m], no lower than the problem's own: with stiff laws that
  /// reach far Newton's method overshoots into a wall.
  double compliance_per_metre = 10.0;
  /// Contacts exist up to so many times the smoothing, if that is more than the margin of the
  /// problem's options: what is to be pushed from afar has to be within it.
  double margin_per_smoothing = 0.0;
  /// Down to this smoothing [m] an overlap is recovered in one step, at any speed; from there to
  /// 1e-6 m both come to those of the problem's options.
  double quick_recovery_above = 3e-5;
  /// A stage starts from the line through the ends of the last two, where that is better.
  bool extrapolate = true;
  double limits_below = 1e-4;                      ///< joint limits act from this smoothing [m] on
  double penalty_start = 10.0, penalty_end = 1e4;  ///< of conditions, the latter from 1e-6 m on
  int rounds = 2;                                  ///< of minimization and multipliers a stage
  double multiplier_limit = 0.03;  ///< multipliers move only where conditions are this near
};

/// One accepted or refused Newton step, as told while it runs.
struct Progress {
  int iteration = 0;  ///< counted over all stages
  int stage = 0;
  double smoothing = 0.0;  ///< [m]
  double penalty = 0.0;
  double cost = 0.0;
  Spread unactuated;     ///< scene weights
  Spread violation;      ///< of all conditions
  double seconds = 0.0;  ///< since the start
  Iteration step;
};

enum class Outcome {
  kConverged,   ///< conditions hold to violation_tolerance at the last smoothing
  kInfeasible,  ///< the last stage ended with conditions farther off
  kIterations,  ///< max_iterations
  kStopped,     ///< by progress()
};
const char* outcome_name(Outcome outcome);

struct Result {
  Outcome outcome = Outcome::kInfeasible;
  std::vector<VectorX> q;              ///< frames 0 ... N
  std::vector<VectorX> v;              ///< their velocities, of frame 0 too
  std::vector<VectorX> applied_force;  ///< N
  double cost = 0.0;                   ///< conditions left out
  VectorX cost_by_term;
  Spread unactuated, violation;
  double smoothing = 0.0;     ///< of the last stage [m]
  SimulationOptions options;  ///< of the last stage
  int iterations = 0;         ///< Newton steps
  int stages = 0, refused_stages = 0;
  std::vector<Progress> history;
  double seconds = 0.0;
};

struct Settings {
  int threads = 0;            ///< 0: one a core
  int max_iterations = 600;   ///< Newton steps of all stages
  int stage_iterations = 40;  ///< of one minimization
  double tolerance = 1e-3;    ///< of the cost: a minimization ends where a step lowers it by less
  double violation_tolerance = 1e-5;  ///< of conditions, at the end
  Continuation continuation;
  DerivativeMethod derivatives = DerivativeMethod::kAnalytic;
  /// Called after every Newton step; false: stop, and return the motion as it is.
  std::function<bool(const Progress&)> progress;
  /// Called at the end of every stage with the motion so far, its history left out.
  std::function<void(const Result&)> stage_done;
};

/// Finds a motion. start: frames q_0 ... q_N to begin with (straight_line, an earlier result).
/// @throws InputError as check_problem, Frames.
Result optimize(const Problem& problem, const std::vector<VectorX>& start,
                const Settings& settings = {});

/// The stage of the continuation at a smoothing [m].
Stage stage_at(const Problem& problem, const Settings& settings, double smoothing);

// ---- Problem files: what is wanted of a motion, in YAML (docs/reference/optimization-format.md).

/// A problem as read from a file, with what it stands on.
struct ProblemFile {
  std::filesystem::path file, scene_file;
  std::string name;
  std::shared_ptr<const Scene> scene;  ///< whose model the problem points to
  Problem problem;
  Settings settings;           ///< `continuation`, iterations, tolerances as the file has them
  std::vector<VectorX> guess;  ///< frames 0 ... N to start from, noise left out
  double noise = 0.0;  ///< standard deviation of what seeds add to joint coordinates [rad, m]
};

/// steps: in place of the file's. @throws InputError naming file, line, element, what was expected
/// and what to do.
ProblemFile load_problem(const std::filesystem::path& file, std::optional<int> steps = {});

/// The guess with the noise of a seed, on all coordinates of joints that are no free bases; seed 0:
/// as it is. The same seed gives the same bits.
std::vector<VectorX> seeded_guess(const ProblemFile& file, std::uint64_t seed);

/// Is `name` matched by a pattern with '*' for any letters?
bool matches(const std::string& pattern, const std::string& name);

// ---- Verification of a motion: does a forward step from each frame reach the next?

/// What was found over all steps of a motion.
struct Verification {
  /// Largest difference of any coordinate [m, rad] between frame t + 1 and where step_forward leads
  /// from frame t under the force that the inverse recovered.
  double forward_check_max = 0.0;
  int forward_failures = 0;         ///< steps that could not be done, or were softened
  double unactuated_max = 0.0;      ///< forces where no motor is, as of unactuated_weights
  double unactuated_mean = 0.0;     ///< over the steps, of the largest in each
  double overlap_max = 0.0;         ///< [m]
  double cone_violation_max = 0.0;  ///< friction beyond mu times the normal force, over the weight
  /// How far a contact that carries more than kLoaded of the weight slides in a step [m]; of a pair
  /// that carried in the step before as well, it stands, and of one that did not, it lands.
  double stance_slip_max = 0.0, landing_slip_max = 0.0;
  double effort_max = 0.0;         ///< largest applied force over its effort limit
  double contact_force_max = 0.0;  ///< normal, over the weight
};

/// A contact is loaded that carries this share of the scene's weight.
inline constexpr double kLoaded = 0.05;

/// Needs q_{-1} for the velocity of frame 0: v_0 (nv). Frames are options.time_step apart.
Verification verify(const Model& model, const SimulationOptions& options,
                    const std::vector<char>& motors, const std::vector<VectorX>& q,
                    const VectorX& v_0);

/// The same of one step after the other, with what the inverse recovered there; in `out` worse
/// figures go before better ones.
class Verifier {
 public:
  Verifier(const Model& model, const SimulationOptions& options, const std::vector<char>& motors);
  /// A step from (q, v) to (q_next, v_next). Returns the recovered force's Inverse.
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
  VectorX unactuated_;                                       ///< nv: weights
  double weight_;                                            ///< [N]
  std::vector<std::pair<int, int>> loaded_, loaded_before_;  ///< pairs of geometries
  int steps_ = 0;
};

/// Forces of an inverse as a state's memory, which step_forward starts from: where a step has
/// several solutions it then finds that of the plan. h [s]; needs the workspace of that inverse.
std::vector<RememberedForce> memory_of(const Model& model, const VectorX& q,
                                       const Inverse& inverse);

// ---- Feedback along a motion: what to add to its forces where the robot is not where the plan
// says.
//
//   u = u_t - K_t x,    x = (q (-) q_t, v - v_t)
//
// K_t of the finite-horizon linear-quadratic regulator (Kwakernaak and Sivan, Linear Optimal
// Control Systems, 1972, section 6.4) for x_{t+1} = A_t x_t + B_t du, A and B from the derivatives
// of the step (engine/derivatives.h).

struct FeedbackSettings {
  double position_weight = 1.0;  ///< of x [1/rad, 1/m], squared in the cost
  double velocity_weight = 0.1;  ///< [s/rad, s/m]
  double effort_weight = 1.0;    ///< of forces over their effort limit, or over 100 N, N m
  /// Contacts as soft as at this smoothing [m]: at hard ones the linear model holds for no more
  /// than their gaps.
  double smoothing = 1e-4;
  int cycles = 8;  ///< of a periodic motion, until gains repeat
};

/// Gains of a motion: by step, nv x 2 nv; rows without a motor are zero.
struct Feedback {
  std::vector<MatrixX> gains;
  /// Steps whose derivatives could not be had: their gain is that of the step behind.
  int missing = 0;
};

/// @throws InputError as check_problem.
Feedback compute_feedback(const Problem& problem, const Settings& settings, const Result& result,
                          const FeedbackSettings& feedback);

/// A motion repeated: frames, velocities, forces and gains of so many cycles, mirrored and
/// displaced as the problem says. Of motions that are not periodic: as they are.
struct RepeatedMotion {
  std::vector<VectorX> q, v, applied_force;
  std::vector<MatrixX> gains;
};
RepeatedMotion repeated(const Problem& problem, const Result& result, const Feedback* feedback,
                        int cycles);

/// Gains as CSV: a row for each step and coordinate with a motor: step, v_index, then the columns
/// of dq and dv.
void write_feedback(const std::filesystem::path& file, const Model& model,
                    const std::vector<MatrixX>& gains);
/// @throws InputError naming file, line and column.
std::vector<MatrixX> read_feedback(const std::filesystem::path& file, const Model& model);

/// u at a state: from the plan's frame, velocity, force and gain (which may be empty), within
/// effort limits.
VectorX following_force(const Model& model, const VectorX& q_plan, const VectorX& v_plan,
                        const VectorX& u_plan, const MatrixX& gain, const VectorX& q,
                        const VectorX& v);  // Parameters: what it depends on, one by one

}  // namespace counterpoint::optimization
