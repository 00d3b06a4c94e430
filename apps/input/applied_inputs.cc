#include "applied_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "command_line/command_line.h"
#include "counterpoint/engine/dynamics.h"

namespace counterpoint::apps {

void add_random_inputs(Command& command, InputArguments& arguments) {
  command.add("--random-inputs", arguments.random_scale,
              "Random forces on actuated joints, new every 20 ms: uniform in +- this times the "
              "smaller of the effort limit and the weight carried (times 0.1 m where it turns)");
  command.add(
      "--random-wrenches", arguments.random_wrench_scale,
      "Random forces on free bodies: uniform in +- this times their weight (torque: times 0.1 m)");
  command.add("--seed", arguments.seed,
              "Seed of the random forces and of the noise of sensors; default 0");
}

void add_times(Command& command, std::optional<double>& duration,
               std::optional<double>& time_step) {
  command.add("--duration", duration, "Simulated time [s]; default: the scene's");
  command.add("--timestep", time_step, "Time step [s]; default: the scene's");
}

AppliedInputs::AppliedInputs(const InputArguments& arguments, const Simulator& simulator)
    : slack_(1e-6 * simulator.options().time_step),
      random_(simulator.model(), arguments.random_scale, arguments.random_wrench_scale,
              arguments.seed) {
  if (!arguments.file.empty()) schedule_.emplace(arguments.file, simulator.model());
  if (!arguments.follow.motion.empty()) follower_.emplace(arguments.follow, simulator.model());
}

InputColumns AppliedInputs::columns(const Model& model) const {
  InputColumns columns = InputColumns::of(model);
  if (schedule_) columns.links = schedule_->columns().links;
  return columns;
}

double AppliedInputs::next_change(double time) const {
  const double change = random_.next_change(time, slack_);
  return schedule_ ? std::min(change, schedule_->next_change(time, slack_)) : change;
}

void AppliedInputs::set(Simulator& simulator) {
  Input& input = simulator.input();
  const double time = simulator.state().time;
  input.applied_force.setZero();
  if (follower_) follower_->set(simulator);
  if (schedule_) schedule_->apply(simulator.model(), time, slack_, input);
  random_.add_to(time, slack_, input.applied_force);
  // Limits the forces here too, so that the trajectory records the forces that acted.
  if (const EffectSet on = simulator.options().effects; on.has(Effect::kEffortLimits))
    limit_applied_forces(simulator.model(), on, input.applied_force);
}

void override_times(const std::optional<double>& duration, const std::optional<double>& time_step,
                    SimulationOptions& options) {
  if (time_step) options.time_step = *time_step;
  if (duration) options.duration = *duration;
  if (!(options.time_step > 0.0) || !std::isfinite(options.time_step)) {
    throw InputError(fmt::format("time step {} s: expected a positive number", options.time_step));
  }
  if (!(options.duration >= 0.0) || !(options.duration / options.time_step < 1e9)) {
    throw InputError(fmt::format("duration {} s: expected 0 or more, and fewer than 1e9 steps",
                                 options.duration));
  }
}

}  // namespace counterpoint::apps
