#include "follow.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "command_line/command_line.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/feedback.h"
#include "input/motion.h"

namespace counterpoint::apps {

void add_follow(Command& command, FollowArguments& arguments) {
  Option& follow = command.add("--follow FILE", arguments.motion,
                               "Table of a motion with its forces, as `optimize --output` writes "
                               "it: starts there and plays them");
  command.add("--feedback FILE", arguments.feedback,
              "With --follow: gains, as `optimize --feedback` writes them", needs(follow));
  command.add("--perturb", arguments.perturb,
              "With --follow: the start is off by this [rad, m] at every motor, and by ten times "
              "that a second; --seed",
              needs(follow), not_negative, seldom);
}

Follower::Follower(const FollowArguments& arguments, const Model& model)
    : arguments_(arguments), motion_(read_motion(arguments.motion, model)) {
  if (motion_.applied_force.size() == 0)
    throw InputError(arguments.motion +
                     ": a motion to follow needs its applied forces: columns as "
                     "`optimize --output` writes them");
  time_step_ = (motion_.time.back() - motion_.time.front()) / motion_.num_steps();
  for (int k = 0; k < motion_.num_steps(); ++k) {
    const double h =
        motion_.time[static_cast<std::size_t>(k) + 1] - motion_.time[static_cast<std::size_t>(k)];
    if (std::abs(h - time_step_) > 1e-6 * time_step_)
      throw InputError(
          fmt::format("{}: steps of one length are expected; one is {} s, their mean "
                      "{} s",
                      arguments.motion, h, time_step_));
  }
  if (arguments.feedback.empty()) return;
  gains_ = optimization::read_feedback(arguments.feedback, model);
  if (static_cast<int>(gains_.size()) != motion_.num_steps())
    throw InputError(
        fmt::format("{}: gains of {} steps for a motion of {}: write both by one "
                    "`optimize --output --feedback`",
                    arguments.feedback, gains_.size(), motion_.num_steps()));
}

State Follower::start(const Model& model, std::uint64_t seed) const {
  State state{motion_.time.front(), motion_.q.col(0), motion_.v.col(0)};
  if (arguments_.perturb == 0.0) return state;
  std::mt19937_64 generator(seed);
  const auto noise = [&] {  // sum of 12 uniforms: the same bits in every standard library
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(generator() >> 11) * 0x1.0p-53;
    return sum;
  };
  VectorX change = VectorX::Zero(model.nv());
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k) {
      const double x = noise(), y = noise();
      if (model.joint(i - 1).actuated) change[k] = arguments_.perturb * x;
      state.v[k] += 10.0 * arguments_.perturb * y;
    }
  }
  integrate_configuration(model, state.q, change, 1.0, state.q);
  return state;
}

void Follower::set(Simulator& simulator) {
  const Model& model = simulator.model();
  const State& state = simulator.state();
  const auto k = static_cast<int>(std::lround((state.time - motion_.time.front()) / time_step_));
  simulator.input().applied_force = VectorX::Zero(model.nv());
  if (k < 0 || k >= motion_.num_steps()) return;
  const MatrixX none;
  simulator.input().applied_force = optimization::following_force(
      model, motion_.q.col(k), motion_.v.col(k), motion_.applied_force.col(k),
      gains_.empty() ? none : gains_[static_cast<std::size_t>(k)], state.q, state.v);
  VectorX off(model.nv());
  configuration_difference(model, motion_.q.col(k), state.q, off);
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (!model.joint(i - 1).actuated) continue;
    error_max_ = std::max(
        error_max_, off.segment(body.v_index, joint_nv(body.joint_type)).lpNorm<Eigen::Infinity>());
  }
}

}  // namespace counterpoint::apps
