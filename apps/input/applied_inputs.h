// Inputs applied in the steps of a simulation, from the options of a command: a file, a followed
// motion, random forces, or a combination.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "follow.h"
#include "inputs.h"

namespace counterpoint::apps {

class Command;

struct InputArguments {
  std::string file;  ///< CSV of inputs; empty: none
  double random_scale = 0.0, random_wrench_scale = 0.0;
  std::uint64_t seed = 0;
  FollowArguments follow;
};

/// Adds --random-inputs, --random-wrenches and --seed.
void add_random_inputs(Command& command, InputArguments& arguments);

class AppliedInputs {
 public:
  /// @throws InputError as InputSchedule and Follower do
  AppliedInputs(const InputArguments& arguments, const Simulator& simulator);

  /// Columns that a trajectory needs in addition to the applied forces.
  InputColumns columns(const Model& model) const;
  /// The motion that is followed, or null.
  const Follower* follower() const { return follower_ ? &*follower_ : nullptr; }
  /// Time of the next change of the inputs [s]; controlled steps end there.
  double next_change(double time) const;
  /// Sets the simulator's input for the step from its state; call it with increasing times.
  void set(Simulator& simulator);

 private:
  double slack_;  ///< [s]: tolerance in time, so that round-off never decides which row of inputs
                  ///< applies
  std::optional<InputSchedule> schedule_;
  std::optional<Follower> follower_;
  RandomForces random_;
};

/// Adds --duration and --timestep.
void add_times(Command& command, std::optional<double>& duration, std::optional<double>& time_step);

/// Replaces the scene's time step and duration [s] by values of the command line. @throws
/// InputError for steps that are not positive, durations below 0, and 1e9 or more steps.
void override_times(const std::optional<double>& duration, const std::optional<double>& time_step,
                    SimulationOptions& options);

}  // namespace counterpoint::apps
