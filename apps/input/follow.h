// A motion that a simulation follows: its forces, and feedback on the state of the robot.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::apps {

class Command;

/// Arguments of --follow, --feedback and --perturb of simulate.
struct FollowArguments {
  std::string motion;    ///< trajectory; empty: none
  std::string feedback;  ///< gains as `optimize --feedback` writes them; empty: no feedback
  /// Standard deviation of the noise added to the first row's joint coordinates [rad, m]; ten times
  /// this for all velocities.
  double perturb = 0.0;
};

/// Adds --follow, --feedback and --perturb.
void add_follow(Command& command, FollowArguments& arguments);

class Follower {
 public:
  /// @throws InputError as read_trajectory and read_feedback do, and if the motion has no applied
  /// forces or steps of different lengths.
  Follower(const FollowArguments& arguments, const Model& model);

  double time_step() const { return time_step_; }  ///< [s]
  double duration() const { return time_step_ * motion_.num_steps(); }
  /// State of the first row, perturbed with this seed.
  State start(const Model& model, std::uint64_t seed) const;
  /// Sets the applied force for the step from the simulator's state; zero after the end.
  void set(Simulator& simulator);
  /// Largest difference of a joint coordinate from the plan so far [rad, m].
  double error_max() const { return error_max_; }

 private:
  FollowArguments arguments_;
  Trajectory motion_;
  std::vector<MatrixX> gains_;
  double time_step_ = 0.0, error_max_ = 0.0;
};

}  // namespace counterpoint::apps
