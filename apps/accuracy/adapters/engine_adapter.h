// Adapter of an engine: advances a scene from one state to a later one, with this engine at some
// setting or with another engine.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::apps::accuracy {

/// Thrown where a measurement is interrupted by the caller.
struct Stopped {};

/// Result of advancing from one state to another.
struct Passage {
  State end;             ///< final state in the coordinates of the scene's model, with its time
  double seconds = 0.0;  ///< processor time of this thread spent in steps
  long steps = 0;
  std::string failure;  ///< why the end was not reached; empty: it was
};

/// One engine at one setting on one scene. To measure another engine, derive from this class and
/// add it to a Family (families.h).
class EngineAdapter {
 public:
  virtual ~EngineAdapter() = default;
  /// Advances from `start` by `duration` [s] without applied forces (servos keep the model's
  /// targets), independent of earlier calls. @throws InputError, peers::NotExpressible where the
  /// engine cannot simulate this scene at all; a step that fails is reported as a Passage with
  /// `failure`.
  virtual Passage advance(const State& start, double duration) = 0;
  /// `stop` is called before every step; advance throws Stopped where it returns true.
  void stop_when(std::function<bool()> stop) { stop_ = std::move(stop); }

 protected:
  void check_stop() const {
    if (stop_ && stop_()) throw Stopped();
  }

 private:
  std::function<bool()> stop_;
};

/// Setting of this engine: options of the step and tolerances of the solver.
struct EngineSetting {
  SimulationOptions options;
  contact::Settings solver;
};

/// Adapter of this engine. With options.step_control it takes controlled steps, and Passage::steps
/// counts every step computed; otherwise `duration` of advance must be a whole number of time
/// steps, to 1e-6 of one. The scene must outlive it. @throws InputError if it is not.
std::unique_ptr<EngineAdapter> counterpoint_adapter(const Scene& scene,
                                                    const EngineSetting& setting);

/// This engine's semi-implicit steps with the contact law of 2011
/// (apps/accuracy/kinetic_energy/kinetic_energy.h) instead of its own; friction is convex whatever
/// the setting says. Slow; for comparison.
std::unique_ptr<EngineAdapter> kinetic_energy_adapter(const Scene& scene,
                                                      const EngineSetting& setting);

/// Number of time steps in `duration`. @throws InputError unless it is a whole number, 1 or more.
long whole_steps(double duration, double time_step);

}  // namespace counterpoint::apps::accuracy
