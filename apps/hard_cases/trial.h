// A hard case: a scene, known facts about its motion, and the measured quantities.
#pragma once

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "counterpoint/engine/clocks.h"
#include "counterpoint/engine/dynamics.h"
#include "report/chart.h"
#include "report/total_energy.h"
#include "runner.h"
#include "view/clip.h"

namespace counterpoint::apps {

/// Gravity of the scenes of hard cases [m/s^2].
inline constexpr double kCaseGravity = 9.81;

/// A measured figure and its bounds: lower <= measured <= upper.
struct Check {
  std::string quantity, unit;
  double measured = 0.0;
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  std::string known;   ///< the answer or bound, as text
  std::string source;  ///< source of the answer or bound
  bool passed() const { return measured >= lower && measured <= upper; }
  template <class Archive>
  void serialize(Archive& a) {
    a(quantity, unit, measured, lower, upper, known, source);
  }
};

/// Measurements of a case on one engine.
struct Figures {
  Chart chart;
  std::vector<Check> checks;
  std::string remark;  ///< remark beside the figures: result of the law and its reason
  long steps = 0, iterations = 0, iterations_max = 0;
  double max_penetration = 0.0;  ///< [m]
  double iterations_mean() const;
  template <class Archive>
  void serialize(Archive& a) {
    a(chart, checks, remark, steps, iterations, iterations_max, max_penetration);
  }
};

/// Thrown if a step fails; tells the step, its time and the solver's status.
class StepFailure : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Thrown if a case is interrupted.
class Stopped : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Context of a case, and its results.
class Trial : public Figures {
 public:
  /// `peer`: runs on MuJoCo with these settings. `allowed`: wall time [s] after which a step fails.
  Trial(std::filesystem::path scenes, std::optional<peers::MujocoSettings> peer, double allowed)
      : scenes_(std::move(scenes)), peer_(peer), allowed_(allowed) {}

  /// Loads the scene NAME.yaml for the engine of the trial; valid as long as the trial. @throws
  /// InputError as load_scene does, peers::NotExpressible as make_runner does.
  Runner& load(const std::string& name);

  /// `wanted` is called before every step; a step throws Stopped where it returns true. Empty:
  /// never.
  void stop_when(std::function<bool()> wanted) { stop_wanted_ = std::move(wanted); }

  /// File for the last good state if a step fails (docs/reference/trajectory-format.md); empty:
  /// none.
  void keep_state_in(std::filesystem::path file) { state_file_ = std::move(file); }

  /// File for a replay of the first loaded scene up to a reset; empty: none.
  void keep_replay_in(std::filesystem::path file) { replay_file_ = std::move(file); }
  /// Writes the replay. False if there is none. @throws InputError
  bool write_replay();

  /// Takes one step. @throws StepFailure, Stopped
  void step(Runner& sim);
  /// Takes one step and returns the forces during it.
  Forces step_and_recover(Runner& sim);
  /// Steps for `seconds` and calls after(sim) after each step.
  template <class After>
  void run(Runner& sim, double seconds, After after) {
    const long count = std::lround(seconds / sim.options().time_step);
    for (long i = 0; i < count; ++i) {
      step(sim);
      after(sim);
    }
  }
  void run(Runner& sim, double seconds) {
    run(sim, seconds, [](const Runner&) {});
  }

  /// Names the y axis of the chart, its bounds and its curves.
  void plot(const std::string& y_label, std::vector<Level> levels = {},
            const std::vector<std::string>& curves = {""});
  /// Adds a point at the current time to a curve.
  void draw(const Runner& sim, double y, std::size_t curve = 0) {
    chart.curves[curve].add(sim.state().time, y);
  }

  /// Largest drift [m] within `seconds` of undisturbed free bodies, named `what` in the chart over
  /// time.
  double left_alone(Runner& sim, double seconds, const std::string& what);

  void equal(const std::string& quantity, const std::string& unit, double measured, double known,
             double tolerance, const std::string& source);
  void at_most(const std::string& quantity, const std::string& unit, double measured, double bound,
               const std::string& source);
  void at_least(const std::string& quantity, const std::string& unit, double measured, double bound,
                const std::string& source);

 private:
  std::filesystem::path scenes_;
  std::optional<peers::MujocoSettings> peer_;
  double allowed_;  ///< [s]
  std::function<bool()> stop_wanted_;
  std::filesystem::path state_file_;
  double start_ = wall_seconds();
  std::vector<std::unique_ptr<Runner>> runners_;
  std::filesystem::path replay_file_;
  std::string replay_scene_;
  std::unique_ptr<view::ClipRecorder> recorder_;  ///< recorder of the first of runners_
  State recorded_;                                ///< last recorded state
};

/// Result of a case on one engine.
struct Run {
  Engine engine = Engine::kCounterpoint;
  Figures figures = {};
  std::string failure = {};  ///< why it did not reach its end
  std::string lacking = {};  ///< why the engine cannot run it at all
  std::string setting = {};  ///< settings of another engine, in words
  int tried = 0;             ///< settings that a search ran to choose them; 0: no search
  double wall_seconds = 0.0;
  bool replay = false;  ///< a replay was written

  bool passed() const;
  bool reached_end() const { return failure.empty() && lacking.empty(); }
  template <class Archive>
  void serialize(Archive& a) {
    a(engine, figures, failure, lacking, setting, tried, wall_seconds, replay);
  }
};

struct HardCase {
  std::string name;
  std::string hard;  ///< why the case is hard, one sentence
  std::function<void(Trial&)> run;
  bool slow = false;  ///< left out of the tests
  /// File under data/scenes/hard, without .yaml; several: "a, b". Empty: the name of the case.
  std::string scene = {};
  const char* known_failure = nullptr;  ///< reason for a known failure, as measured
};

/// Results of a case on Counterpoint and on the other engines.
struct Result {
  HardCase hard_case;
  std::vector<Run> runs;  ///< ours first
  const Run& ours() const { return runs.front(); }
};

// Cases by theme, one file each.
std::vector<HardCase> friction_cases();
std::vector<HardCase> stacking_cases();
std::vector<HardCase> masonry_cases();
std::vector<HardCase> impact_cases();
std::vector<HardCase> spin_cases();
std::vector<HardCase> linkage_cases();
std::vector<HardCase> scale_cases();
std::vector<HardCase> pile_cases();
std::vector<HardCase> hollow_cases();
std::vector<HardCase> published_cases();

/// Quantities derived from the state of a runner, by name.
class View {
 public:
  explicit View(const Runner& sim);
  /// Updates to the current state.
  void look();

  /// Body index of a link. @throws InputError.
  int body(const std::string& link) const;
  Pose pose(const std::string& link) const;  ///< X_WF of a link
  Pose geometry_pose(int geometry) const { return dynamics_.geometry_pose(geometry); }  ///< X_WG
  Vector3 position(const std::string& link) const { return pose(link).translation; }
  Vector3 center(int body) const;    ///< centre of mass, in W
  Vector3 velocity(int body) const;  ///< velocity of the centre of mass, in W
  Vector3 spin(int body) const { return motion(body).angular_velocity; }
  double kinetic() const;
  double potential() const;
  double energy() const { return kinetic() + potential(); }
  /// Also the springs of joints and soft surfaces [J].
  double energy_with_springs();
  /// Scale of energy changes: the current kinetic energy plus the weight (at least 1 m/s^2) raised
  /// by 1 m [J].
  double energy_scale() const;
  Force momentum() const;  ///< about the world's origin

 private:
  /// Motion of a frame that is fixed to the body.
  FrameMotion motion(int body) const {
    return dynamics_.frame(frame_of_[static_cast<std::size_t>(body)]);
  }
  /// Vector from that frame's origin to the centre of mass, in W [m].
  Vector3 center_arm(int body) const;

  const Runner& sim_;
  Dynamics dynamics_;
  SurfaceSprings surfaces_;
  std::vector<int> frame_of_;  ///< index into Model::frames() by body
};

/// Change of the mechanical energy over that at the start, divided by a scale.
struct EnergyChange {
  double gain = 0.0;  ///< largest, not below 0
  double off = 0.0;   ///< largest magnitude
};

/// Steps a scene for its duration and draws the energy change. after(): called after each step.
EnergyChange watch_energy(Trial& trial, Runner& sim, View& view, double scale,
                          const std::function<void()>& after = {}, std::size_t curve = 0);

/// Largest gap of the closures [m or rad, the larger].
double closures_open(const Model& model, const VectorX& q);

/// Sum of the contact forces on body `b` from body `a` [N], in W; body 0: the world.
Vector3 force_between(const Model& model, const Forces& forces, int a, int b);

/// First coordinate of the free body `link` in q and v. @throws InputError.
int q_of(const Model& model, const std::string& link);
int v_of(const Model& model, const std::string& link);

/// Largest difference of the positions of free bodies between two configurations [m].
double drift(const Model& model, const VectorX& q, const VectorX& q_start);

}  // namespace counterpoint::apps
