// The frames of a motion as an optimization sees them: which are variables, and what is before
// the first and after the last.
#pragma once

#include <vector>

#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

/// Where a frame comes from: its slot among the variables, -1 if it is fixed; an image of that slot
/// under the problem's mirror?
struct FrameSource {
  int slot = -1;
  bool mirrored = false;
};

/// Frames -1 ... N of one problem (periodic: -1 ... N), of which some are variables.
class Frames {
 public:
  /// frames: q_0 ... q_N (periodic: q_0 ... q_{N-1} are enough), nq each. Start and goal are put in
  /// place. @throws InputError where their number or size is wrong.
  Frames(const Problem& problem, const std::vector<VectorX>& frames);

  int num_slots() const { return static_cast<int>(slots_.size()); }
  /// Instants of terms: frames for which there may be any, 0 ... N - 1, and N if not periodic.
  int num_instants() const { return problem_->periodic ? problem_->steps : problem_->steps + 1; }
  FrameSource source(int frame) const;
  /// q of a frame, -1 ... N (nq).
  VectorX at(int frame) const;
  /// q_0 ... q_N.
  std::vector<VectorX> all() const;

  /// The fixed frames of a start and goal raised by so much [m] (settle.h).
  void set_start(const VectorX& q);
  void set_goal(const VectorX& q);

  /// q (+) step, of all variables; step: nv x slots.
  void move(const MatrixX& step);
  const std::vector<VectorX>& variables() const { return slots_; }
  void set_variables(std::vector<VectorX> q) { slots_ = std::move(q); }
  /// Of a periodic motion: q a period later (sign 1) or earlier (-1).
  VectorX image(const VectorX& q, double sign) const;

 private:
  const Problem* problem_;
  std::vector<VectorX> slots_;
  VectorX start_, before_start_;  ///< frames 0 and -1
  VectorX goal_, before_goal_;    ///< frames N and N - 1
};

}  // namespace counterpoint::optimization
