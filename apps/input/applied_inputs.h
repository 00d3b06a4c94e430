// What acts in the steps of a simulation, from a command's options: a file, random forces, or both.
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
  std::string file;  ///< CSV of what acts; empty: none
  double random_scale = 0.0, random_wrench_scale = 0.0;
  std::uint64_t seed = 0;
  FollowArguments follow;
};

/// --random-inputs, --random-wrenches, --seed.
void add_random_inputs(Command& command, InputArguments& arguments);

class AppliedInputs {
 public:
  /// @throws InputError as InputSchedule does.
  AppliedInputs(const InputArguments& arguments, const Simulator& simulator);

  /// The columns that a trajectory needs beside the applied forces.
  InputColumns columns(const Model& model) const;
  /// The motion that is followed; null: none.
  const Follower* follower() const { return follower_ ? &*follower_ : nullptr; }
  /// When something else acts [s]: controlled steps end there.
  double next_change(double time) const;
  /// Sets the simulator's input for the step from its state; asked for in rising time.
  void set(Simulator& simulator);

 private:
  double slack_;  ///< [s]: a round-off in the time never decides whether a row of inputs holds
  std::optional<InputSchedule> schedule_;
  std::optional<Follower> follower_;
  RandomForces random_;
};

/// --duration, --timestep.
void add_times(Command& command, std::optional<double>& duration, std::optional<double>& time_step);

/// Time step and duration [s] given on a command line in place of the scene's.
/// @throws InputError for steps that are not positive, durations below 0, 1e9 steps and more.
void override_times(const std::optional<double>& duration, const std::optional<double>& time_step,
                    SimulationOptions& options);

}  // namespace counterpoint::apps
