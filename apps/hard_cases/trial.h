// A hard case: a scene, what is known about its motion, what is measured.
#pragma once

#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "report/chart.h"
#include "runner.h"
#include "view/clip.h"

namespace counterpoint::apps {

/// g of the scenes of hard cases [m/s^2].
inline constexpr double kCaseGravity = 9.81;

/// One figure against what is known about it: lower <= measured <= upper.
struct Check {
  std::string quantity, unit;
  double measured = 0.0;
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  std::string known;   ///< the answer or bound, as text
  std::string source;  ///< where it comes from
  bool passed() const { return measured >= lower && measured <= upper; }
};

/// Which step failed, when, and the solver's status.
class StepFailure : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A case is not to be gone on with.
class Stopped : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What a case does its work with, and what it leaves behind.
class Trial {
 public:
  /// `allowed`: seconds of wall time, after which a step fails.
  Trial(std::filesystem::path scenes, Engine engine,
        double allowed = std::numeric_limits<double>::infinity())
      : scenes_(std::move(scenes)), engine_(engine), allowed_(allowed) {}

  /// The scene NAME.yaml, to be run by the engine of the trial; valid as long as the trial.
  /// @throws InputError as load_scene does, peers::NotExpressible as make_runner does.
  Runner& load(const std::string& name);

  /// Lets go of what was loaded; figures and chart stay.
  void unload() { runners_.clear(); }

  /// Asked before every step; a step throws Stopped where it says so. Empty: never.
  void stop_when(std::function<bool()> wanted) { stop_wanted_ = std::move(wanted); }

  /// Where the last good state goes if a step fails (docs/reference/trajectory-format.md); empty:
  /// nowhere.
  void keep_state_in(std::filesystem::path file) { state_file_ = std::move(file); }

  /// Where a replay of what is loaded first goes, up to a reset; empty: nowhere.
  void keep_replay_in(std::filesystem::path file) { replay_file_ = std::move(file); }
  /// Writes it; before unload. False if there is none. @throws InputError.
  bool write_replay();

  /// One step. @throws StepFailure, Stopped.
  void step(Runner& sim);
  /// One step, and the forces within it.
  Forces step_and_recover(Runner& sim);
  /// Steps for that long [s]; after each, `after(sim)`.
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

  /// Largest drift [m] within that long [s] of free bodies, called `what`, that are left alone;
  /// drawn over time.
  double left_alone(Runner& sim, double seconds, const std::string& what);

  void equal(const std::string& quantity, const std::string& unit, double measured, double known,
             double tolerance, const std::string& source);
  void at_most(const std::string& quantity, const std::string& unit, double measured, double bound,
               const std::string& source);
  void at_least(const std::string& quantity, const std::string& unit, double measured, double bound,
                const std::string& source);

  Chart chart;
  std::vector<Check> checks;
  std::string remark;  ///< said beside the figures: what the law gives and why
  long steps = 0, iterations = 0, iterations_max = 0;
  double max_penetration = 0.0;  ///< [m]

 private:
  std::filesystem::path scenes_;
  Engine engine_;
  double allowed_;  ///< [s]
  std::function<bool()> stop_wanted_;
  std::filesystem::path state_file_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::vector<std::unique_ptr<Runner>> runners_;
  std::filesystem::path replay_file_;
  std::string replay_scene_;
  std::unique_ptr<view::ClipRecorder> recorder_;  ///< of the first of runners_
  State recorded_;                                ///< the last state that it has
};

/// A case on one engine.
struct Run {
  Engine engine = Engine::kCounterpoint;
  Trial trial;
  std::string failure;  ///< why it did not come to its end
  std::string lacking;  ///< why the engine cannot run it at all
  double wall_seconds = 0.0;
  bool replay = false;  ///< one was written

  bool passed() const;
  double iterations_mean() const;
};

struct HardCase {
  std::string name;
  std::string hard;   ///< what makes it hard, one sentence
  std::string scene;  ///< file under data/scenes/hard, without .yaml; several: "a, b"
  std::function<void(Trial&)> run;
  bool slow = false;                    ///< not among the tests
  const char* known_failure = nullptr;  ///< why it is known to fail, as measured
};

/// A case on Counterpoint, and on the peers.
struct Result {
  HardCase hard_case;
  Run ours;
  std::vector<Run> peers;
};

// By theme, one file each.
std::vector<HardCase> friction_cases();
std::vector<HardCase> stacking_cases();
std::vector<HardCase> masonry_cases();
std::vector<HardCase> impact_cases();
std::vector<HardCase> spin_cases();
std::vector<HardCase> linkage_cases();
std::vector<HardCase> scale_cases();
std::vector<HardCase> pile_cases();

/// What a case reads off the state of a runner, by name.
class View {
 public:
  explicit View(const Runner& sim);
  /// From the state as it is now.
  void look();

  /// Body index of a link. @throws InputError.
  int body(const std::string& link) const;
  Pose pose(const std::string& link) const;  ///< X_WF of a link
  Pose geometry_pose(int geometry) const { return dynamics_.geometry_pose(geometry); }  ///< X_WG
  Vector3 position(const std::string& link) const { return pose(link).translation; }
  Vector3 center(int body) const;    ///< of mass, in W
  Vector3 velocity(int body) const;  ///< of the centre of mass, in W
  Vector3 spin(int body) const { return motion(body).angular_velocity; }
  double kinetic() const;
  double potential() const;
  double energy() const { return kinetic() + potential(); }
  double energy_with_springs() const;
  /// What changes of energy are measured by: the kinetic energy now, and the weight (of at least
  /// 1 m/s^2) raised by 1 m [J].
  double energy_scale() const;
  Force momentum() const;  ///< about the world's origin

 private:
  /// Of a frame that is fixed to the body.
  FrameMotion motion(int body) const {
    return dynamics_.frame(frame_of_[static_cast<std::size_t>(body)]);
  }
  /// Of its centre of mass, seen from that frame's origin, in W [m].
  Vector3 center_arm(int body) const;

  const Runner& sim_;
  Dynamics dynamics_;
  std::vector<int> frame_of_;  ///< by body, of Model::frames()
};

/// Sum of the contact forces on body `b` from body `a` [N], in W; body 0: the world.
Vector3 force_between(const Model& model, const Forces& forces, int a, int b);

/// First coordinate of the free body `link` in q and v. @throws InputError.
int q_of(const Model& model, const std::string& link);
int v_of(const Model& model, const std::string& link);

/// Largest difference of the positions of free bodies between two configurations [m].
double drift(const Model& model, const VectorX& q, const VectorX& q_start);

}  // namespace counterpoint::apps
