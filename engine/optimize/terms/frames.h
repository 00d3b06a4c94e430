// The frames of a motion: variables, fixed frames, and periodic images.
#pragma once

#include <vector>

#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

/// Source of a frame: its slot among the variables (-1 if fixed), and whether it is an image of
/// that slot under the problem's mirror.
struct FrameSource {
  int slot = -1;
  bool mirrored = false;
};

/// Frames -1 ... N of a problem, some of which are variables.
class Frames {
 public:
  /// frames: q_0 ... q_N (periodic: q_0 ... q_{N-1} suffice), nq each. Fixed frames are replaced by
  /// start and goal. @throws InputError if their number or size is wrong.
  Frames(const Problem& problem, const std::vector<VectorX>& frames);

  int num_slots() const { return static_cast<int>(slots_.size()); }
  /// Number of instants that may have terms: frames 0 ... N - 1, and N if not periodic.
  int num_instants() const { return problem_->periodic ? problem_->steps : problem_->steps + 1; }
  FrameSource source(int frame) const;
  /// Configuration (nq) of a frame, -1 ... N.
  VectorX at(int frame) const;
  /// q_0 ... q_N.
  std::vector<VectorX> all() const;

  /// Sets the fixed frames at the start (0 and -1) or at the goal (N and N - 1), for example to
  /// settled poses (settle.h).
  void set_start(const VectorX& q);
  void set_goal(const VectorX& q);

  /// Moves all variables by a step (nv x slots).
  void move(const MatrixX& step);
  const std::vector<VectorX>& variables() const { return slots_; }
  void set_variables(std::vector<VectorX> q) { slots_ = std::move(q); }
  /// Image of q one period later (sign 1) or earlier (-1) in a periodic motion.
  VectorX image(const VectorX& q, double sign) const;

 private:
  const Problem* problem_;
  std::vector<VectorX> slots_;
  VectorX start_, before_start_;  ///< frames 0 and -1
  VectorX goal_, before_goal_;    ///< frames N and N - 1
};

}  // namespace counterpoint::optimization
