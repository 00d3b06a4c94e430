// A scene that is stepped by any of the engines and read in Counterpoint's terms, so that a case is
// written once.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"
#include "peers/mujoco_settings.h"

namespace counterpoint::apps {

enum class Engine { kCounterpoint, kMujocoDefault, kMujocoBest };

/// Names: "Counterpoint", "MuJoCo default", "MuJoCo best".
const char* engine_name(Engine engine);

/// Figures of a step.
struct StepMetrics {
  long iterations = 0;           ///< solver iterations
  double max_penetration = 0.0;  ///< at the start of the step [m]
  std::string failure;           ///< empty: the step succeeded
};

/// Forces during a step, on geometry B and body B, in W [N]; valid until the next step.
struct Forces {
  const std::vector<ContactForce>& contacts;
  const std::vector<ClosureForce>& closures;
  /// Largest applied force of the inverse less that of the step, and the largest force [N, N m].
  /// Engines without an inverse of their step have no numbers here.
  double inverse_error = std::numeric_limits<double>::quiet_NaN();
  double largest = std::numeric_limits<double>::quiet_NaN();
};

class Runner {
 public:
  virtual ~Runner() = default;
  virtual const Scene& scene() const = 0;
  const Model& model() const { return scene().model; }
  const SimulationOptions& options() const { return scene().options; }
  virtual void set_time_step(double h) = 0;  ///< [s]
  virtual const State& state() const = 0;    ///< in the coordinates of the model
  virtual Input& input() = 0;                ///< kept until changed; zero at first
  virtual void reset() = 0;                  ///< returns to the scene's start
  virtual StepMetrics step() = 0;            ///< if it fails, the state is unchanged
  virtual Forces forces() = 0;               ///< forces of the last step
};

/// Runs the scene on Counterpoint, or with `peer` on MuJoCo with these settings.
/// @throws peers::NotExpressible if the engine lacks what the scene needs, or is not there.
std::unique_ptr<Runner> make_runner(Scene scene, const std::optional<peers::MujocoSettings>& peer);

}  // namespace counterpoint::apps
