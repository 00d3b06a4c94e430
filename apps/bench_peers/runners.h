// The engines that steps are timed with, each along its own trajectory of the same scene.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "counterpoint/model/scene.h"
#include "tables.h"

namespace counterpoint::apps {

/// One engine on one scene.
class Runner {
 public:
  virtual ~Runner() = default;
  virtual const char* name() const = 0;
  /// Back to the start.
  virtual void reset() = 0;
  /// Without anything between them. @throws std::runtime_error if a step fails.
  virtual void steps(int count) = 0;
  /// Goes through the whole trajectory once and keeps the quality, and what the inverse needs if
  /// that is wanted. Returns how many steps were done: fewer where one failed, or after `limit`
  /// seconds.
  virtual int record(int count, bool inverse, double limit) = 0;
  /// Inverse dynamics of recorded steps begin ... begin + count - 1.
  virtual void inverses(int begin, int count) = 0;
  virtual double inverse_error() const = 0;
  virtual std::size_t memory() const = 0;
  double penetration = 0.0;  ///< deepest overlap of the trajectory [m]
  long iterations = 0;       ///< of the solver, over the trajectory
  std::string failure;       ///< why a trajectory was shorter than asked for; empty: none was

 protected:
  /// Before a trajectory is recorded.
  void forget() {
    reset();
    penetration = 0.0;
    iterations = 0;
  }
};

using Runners = std::vector<std::unique_ptr<Runner>>;
/// Steps begin ... begin + count - 1 of a runner.
using Work = std::function<void(Runner&, int begin, int count)>;

std::unique_ptr<Runner> our_runner(const Scene& scene);

/// Seconds a step, by runner, of one trajectory gone through by all in turn, a few steps of each.
std::vector<double> one_round(const Runners& runners, int steps, const Work& work);

struct Wanted {
  std::string table = "steps", label;
  int steps = 0, rounds = 0;
  bool inverse = true;  ///< is it timed as well?
  double limit = 1e9;   ///< a trajectory ends once an engine has taken so long for it [s]
};

/// Ours and MuJoCo's on one scene. A failure of one scene is said, and the others go on.
void try_scene(const Scene& scene, const Wanted& wanted, PeerTable& table);

/// So many steps are the scene's duration, or the longest asked for.
int steps_of(const Scene& scene, const PeerOptions& options);

/// A URDF dropped from 0.1 m above the ground, without restitution, which MuJoCo has not.
Scene dropped(const std::filesystem::path& urdf);

}  // namespace counterpoint::apps
