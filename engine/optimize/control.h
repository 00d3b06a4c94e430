// Control with the optimizer in the loop: the plan is made anew many times a second from the
// present state, and never restarted (docs/guide/control.md).
//
//   ControlFile file = load_control("walk.yaml");
//   Planner planner(file.problem, file.planner);
//   planner.replan(time, q, v);
//   planner.force(time, q, v, u);
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::optimization {

// ---- The planner: receding horizon, with one smoothing and one penalty for ever.
//
// Conditions count penalty / 2 |c|^2; there are no multipliers. Each replan shifts the frames in
// time, holds the last one beyond the end, sets frame 0 and its velocity to the present state, and
// tries a fixed number of Gauss-Newton steps. Kurtz, Castro, Oncul and Lin, "Inverse Dynamics
// Trajectory Optimization for Contact-Implicit Model Predictive Control" (2023), section VI.

struct PlannerSettings {
  double smoothing = 1e-2;           ///< smoothing of the plan's contacts [m]
  double compliance_per_metre = 10;  ///< compliance over smoothing [1/m], as in Continuation
  double margin_per_smoothing = 0;   ///< see Continuation
  double penalty = 100.0;            ///< penalty of conditions
  int iterations = 2;                ///< Gauss-Newton steps that a replan tries
  int first_iterations = 50;         ///< the same for a plan from rest
  /// Time constant [s] of the estimate of a force that acts where there is no motor and that the
  /// plan does not know, such as friction that smoothed contacts lack; 0: no estimate.
  double disturbance_time = 0.0;
  int threads = 1;               ///< 0: one per core; the plan does not depend on it
  double contact_damping = 0.0;  ///< see Continuation
  double least_damping = 1e-6;   ///< relative to the diagonal, kept from replan to replan
  /// A plan whose mean violation exceeds this after a replan is made anew from rest.
  double lost_above = 10.0;
};

/// Gains of the joints' feedback towards the plan (nv each); zero without a motor. A run does not
/// use those of joints whose servo the world simulates.
struct FeedbackGains {
  VectorX stiffness;  ///< [N m/rad, N/m]
  VectorX damping;    ///< [N m s/rad, N s/m]
};

struct ReplanReport {
  double cost = 0.0;
  Spread
      violation;  ///< violation of the conditions; forces without a motor in weights of the trees
  int iterations = 0;
  bool restarted = false;  ///< the plan was lost and made anew
};

class Planner {
 public:
  /// The problem must not be periodic nor have a fixed goal; its model must outlive the planner.
  /// @throws InputError as check_problem.
  Planner(const Problem& problem, const PlannerSettings& settings);
  ~Planner();
  Planner(Planner&&) noexcept;
  Planner& operator=(Planner&&) noexcept;

  /// Plans from the state (q: nq, v: nv) at `time` [s]. The first call plans from rest. Does not
  /// allocate once its contacts have been met. The same calls give the same bits with any number of
  /// threads.
  ReplanReport replan(double time, const VectorX& q, const VectorX& v);
  /// The two halves of replan(): prepare() makes the next plan, adopt() takes it into use. While
  /// prepare() runs in a thread, others may call sample(), force() and frames() of the plan in use.
  ReplanReport prepare(double time, const VectorX& q, const VectorX& v);
  void adopt();
  /// Forgets the plan: the next replan() starts from rest.
  void forget();

  /// Frames 0 ... N of the plan; frame 0 is the state of the last replan.
  const std::vector<VectorX>& frames() const;
  /// Writes configuration (nq), velocity (nv) and applied force (nv) of the plan at a time [s];
  /// beyond its end, those of the last frame at rest.
  void sample(double time, VectorX& q, VectorX& v, VectorX& force) const;
  /// Writes the force [N, N m] (nv) at a state: the plan's, plus feedback towards it, within effort
  /// limits; zero without a motor.
  void force(double time, const FeedbackGains& gains, const VectorX& q, const VectorX& v,
             VectorX& out);
  const Problem& problem() const;
  double time() const;  ///< time of frame 0 [s]
  /// Changes the target of a term by its name, for commands such as a speed; it takes the place of
  /// one that is relative to the state or comes from a file.
  /// @throws InputError if no term has this name, or sizes differ.
  void set_target(const std::string& term, const VectorX& target);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// ---- Control problems in YAML: a problem file with the key `control`
// (docs/reference/optimization-format.md).

/// A force on a link during a time.
struct Push {
  int link = 0;                        ///< index into Model::frames of the world, see pushed_link
  Vector3 force = Vector3::Zero();     ///< at the centre of mass, in W [N]
  double start = 0.0, duration = 0.1;  ///< [s]
};
/// Index into Model::frames of a link that can be pushed. @throws InputError if there is no such
/// link, or it is fixed to the world.
int pushed_link(const Model& model, const std::string& name);

/// Demand on the run: a coordinate, or its mean rate, lies within a range.
struct SuccessTest {
  std::string name;  ///< coordinate, a column of a trajectory ("trunk.z")
  int q_index = 0;
  bool rate = false;    ///< mean change per second between `from` and the end [m/s, rad/s]
  bool always = false;  ///< at all times from `from` on, not only at the end
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  double from = 0.0;  ///< [s]
  /// Distance of a value from the middle of the range, if it has one, else from the range [m, rad].
  double error(double value) const;
  /// Largest error of a value that passes.
  double allowed() const;
};

/// Standard deviations of the perturbed start.
struct Perturbation {
  double position = 0.05;      ///< positions of joints [m, rad]
  double velocity = 0.2;       ///< velocities of joints [m/s, rad/s]
  double base_velocity = 0.1;  ///< velocities of floating joints [m/s, rad/s]
  VectorX extra;               ///< nv: of single coordinates, in place of these [m, rad]
};

struct ControlFile {
  ProblemFile file;
  /// The world's scene, which may have other contacts and ground than the plan's, with the same
  /// coordinates; default: that of the plan.
  std::shared_ptr<const Scene> world;
  PlannerSettings planner;
  FeedbackGains gains;
  double interval = 0.02;  ///< between replans [s]
  /// Plans are made in a thread of their own while the world goes on for WorldErrors::delay. The
  /// run is the same to the bit.
  bool own_thread = false;
  double plant_step = 1e-3;  ///< time step of the simulated world [s]
  double duration = 5.0;     ///< [s]
  std::vector<Push> pushes;
  std::vector<SuccessTest> success;
  Perturbation perturbation;
};

/// Simulates the scene of another file. @throws InputError as load_scene, or if its coordinates
/// differ from those of the plan.
void use_world(ControlFile& control, const std::filesystem::path& scene);

/// Columns of the servos' targets and of the pushes in a table of a run.
InputColumns input_columns(const ControlFile& control);

/// Loads a control problem. @throws InputError naming file, line, element and the expected value.
ControlFile load_control(const std::filesystem::path& file);

// ---- The loop: planner and simulated world.

/// Differences between the world and the measurements that the planner gets.
struct WorldErrors {
  double delay = 0.0;           ///< from a measurement to the use of its plan [s]
  double position_noise = 0.0;  ///< standard deviation of measured joint positions [rad, m]
  double velocity_noise = 0.0;  ///< standard deviation of measured velocities [rad/s, m/s]
};

struct ControlRun {
  State end;                           ///< last state of the world
  std::vector<double> replan_seconds;  ///< processor time of each replan
  double violation_mean = 0.0;         ///< mean over the replans
  int restarts = 0;
  bool stopped = false;        ///< ControlHooks::keep_on returned false
  Fault fault;                 ///< cause why a step of the world failed, if one did
  double world_seconds = 0.0;  ///< processor time of the plant
  double wall_seconds = 0.0;   ///< wall time of the run
  /// Per success test: whether it holds, and its error.
  std::vector<char> passed;
  std::vector<double> error;
  bool success() const;
};

/// Callbacks of a run; each may be empty.
struct ControlHooks {
  /// Called after a successful step of the world with its start, input, length [s] and end.
  std::function<void(const State& before, const Input&, double h, const State& after,
                     const StepReport&)>
      step;
  /// Called after each replan with its processor time [s].
  std::function<void(const Planner&, const ReplanReport&, double seconds)> replanned;
  std::function<bool(double time)>
      keep_on;  ///< returning false stops before the step at `time` [s]
};

/// Returns a copy of a scene with all masses and inertias, and all coefficients of friction,
/// multiplied by factors.
Scene scaled_world(const Scene& scene, double mass_factor, double friction_factor);

/// Returns the plain start of a run (nq): that of the problem, settled on the contacts of the world
/// if it stands.
VectorX control_start(const ControlFile& control, const Scene& world);

/// Runs the loop. Servos of the world's motors, if it has any, follow the plan, implicit in each of
/// its steps (servos.h); the plan's forces are added within the effort limits. world: a scene with
/// the model's bodies and coordinates; its masses and materials may differ. seed: of the perturbed
/// start and of noise; 0: the plain start.
ControlRun run_control(const ControlFile& control, const Scene& world, std::uint64_t seed,
                       const WorldErrors& errors, const ControlHooks& hooks = {});

}  // namespace counterpoint::optimization
