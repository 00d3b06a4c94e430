// A motion that a simulation follows: its forces, and feedback on where the robot is.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "counterpoint/engine/motion_files.h"
#include "counterpoint/engine/simulator.h"

namespace counterpoint::apps {

class Command;

/// --follow, --feedback, --perturb of simulate.
struct FollowArguments {
  std::string motion;    ///< trajectory; empty: none
  std::string feedback;  ///< gains as `optimize --feedback` writes them; empty: forces alone
  /// Standard deviation of what is added to the first row's joint coordinates [rad, m] and, ten
  /// times that, to all velocities.
  double perturb = 0.0;
};

/// --follow, --feedback, --perturb.
void add_follow(Command& command, FollowArguments& arguments);

class Follower {
 public:
  /// @throws InputError as read_trajectory, read_feedback, and where the motion has no applied
  /// forces, or steps that are not all alike.
  Follower(const FollowArguments& arguments, const Model& model);

  double time_step() const { return time_step_; }  ///< [s]
  double duration() const { return time_step_ * motion_.num_steps(); }
  /// The first row, perturbed by a seed.
  State start(const Model& model, std::uint64_t seed) const;
  /// Sets the applied force for the step from the simulator's state; after the end none.
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
