// Engines whose steps are timed, each along its own trajectory of the same scene.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/model/scene.h"
#include "measure/turns.h"
#include "tables.h"

namespace counterpoint::apps {

/// One engine on one scene.
class Runner {
 public:
  virtual ~Runner() = default;
  virtual const char* name() const = 0;
  /// Returns to the start.
  virtual void reset() = 0;
  /// Takes `count` steps and does nothing else. @throws std::runtime_error if a step fails.
  virtual void steps(int count) = 0;
  /// Runs the whole trajectory once and records its quality, and the data that the inverse needs if
  /// `inverse`. Returns the number of steps done: fewer than `count` if one failed or after `limit`
  /// seconds.
  virtual int record(int count, bool inverse, double limit) = 0;
  /// Computes the inverse dynamics of the recorded steps begin ... begin + count - 1.
  virtual void inverses(int begin, int count) = 0;
  virtual double inverse_error() const = 0;
  virtual std::size_t memory() const = 0;
  double penetration = 0.0;  ///< deepest overlap of the trajectory [m]
  long iterations = 0;       ///< solver iterations over the trajectory
  std::string failure;       ///< why a trajectory was shorter than requested; empty: it was not

 protected:
  /// Resets the state and the figures before a trajectory is recorded.
  void forget() {
    reset();
    penetration = 0.0;
    iterations = 0;
  }
};

using Runners = std::vector<std::unique_ptr<Runner>>;
/// Work on steps begin ... begin + count - 1 of a runner.
using Work = std::function<void(Runner&, int begin, int count)>;

std::unique_ptr<Runner> our_runner(const Scene& scene);

/// Times one step of each runner; in every round all run the trajectory in turns of a few steps.
Timing time_rounds(const Runners& runners, int steps, int rounds, const Work& work);

struct Wanted {
  std::string table = "steps", label;
  int steps = 0, rounds = 0;
  bool inverse = true;  ///< time the inverse as well
  double limit = 1e9;   ///< a trajectory ends after an engine has used this time [s]
};

/// Compares our engine and MuJoCo on one scene. A failure of the scene is printed; other scenes go
/// on.
void try_scene(const Scene& scene, const Wanted& wanted, PeerTable& table);

/// Number of steps in the scene's duration or the longest duration allowed by the options,
/// whichever is less.
int steps_of(const Scene& scene, const PeerOptions& options);

/// A URDF dropped from 0.1 m above the ground, without restitution, which MuJoCo does not model.
Scene dropped(const std::filesystem::path& urdf);

}  // namespace counterpoint::apps
