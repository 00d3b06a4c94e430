// Adapter of an engine: takes a scene from one state to a later one, by this engine at some setting
// or by another engine.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "counterpoint/engine/state.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::apps::accuracy {

/// Thrown where measuring is to end on its way.
struct Stopped {};

/// How it went from one state to another.
struct Passage {
  State end;             ///< in the coordinates of the scene's model, time included
  double seconds = 0.0;  ///< processor time of this thread, of stepping alone
  long steps = 0;
  std::string failure;  ///< why it did not come to its end; empty: it did
};

/// One engine at one setting on one scene. To measure another engine, write one of these and give
/// it to a Family (families.h).
class EngineAdapter {
 public:
  virtual ~EngineAdapter() = default;
  /// From `start` on for `duration` [s], under no applied forces (servos keep the model's targets),
  /// whatever was asked before. @throws InputError, peers::NotExpressible where it cannot move this
  /// scene at all; a step that fails is a Passage with `failure`.
  virtual Passage advance(const State& start, double duration) = 0;
  /// Asked before every step: where it is true, advance throws Stopped.
  void stop_when(std::function<bool()> stop) { stop_ = std::move(stop); }

 protected:
  void check_stop() const {
    if (stop_ && stop_()) throw Stopped();
  }

 private:
  std::function<bool()> stop_;
};

/// What this engine is told: how to step, and how exactly to solve.
struct EngineSetting {
  SimulationOptions options;
  contact::Settings solver;
};

/// This engine; by controlled steps where options.step_control is set, of which `steps` of a
/// passage counts all that were computed. The scene must outlive it. Else `duration` of advance
/// must be a whole number of time steps, to 1e-6 of one. @throws InputError if not.
std::unique_ptr<EngineAdapter> counterpoint_adapter(const Scene& scene,
                                                    const EngineSetting& setting);

/// This engine's semi-implicit steps with the contact law of 2011
/// (apps/accuracy/kinetic_energy/kinetic_energy.h) in place of its own; friction is convex whatever
/// the setting says. Slow; for comparison.
std::unique_ptr<EngineAdapter> kinetic_energy_adapter(const Scene& scene,
                                                      const EngineSetting& setting);

/// How many time steps make `duration`. @throws InputError unless it is a whole number, 1 or more.
long whole_steps(double duration, double time_step);

}  // namespace counterpoint::apps::accuracy
