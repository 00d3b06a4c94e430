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

/// The unknowns of a problem.
struct Variables {
  std::vector<VectorX> q;  ///< one per slot
  double time_step = 0.0;  ///< h [s]; constant unless Problem::duration is set
};

/// Frames -1 ... N of a problem, some of which are variables.
class Frames {
 public:
  /// frames: q_0 ... q_N (periodic: q_0 ... q_{N-1} suffice), nq each. Fixed frames are replaced by
  /// start and goal. @throws InputError if their number or size is wrong.
  Frames(const Problem& problem, const std::vector<VectorX>& frames);

  int num_slots() const { return static_cast<int>(variables_.q.size()); }
  double time_step() const { return variables_.time_step; }
  /// Number of instants that may have terms: frames 0 ... N - 1, and N if not periodic.
  int num_instants() const { return problem_->periodic ? problem_->steps : problem_->steps + 1; }
  FrameSource source(int frame) const;
  /// Writes the configuration (nq) of a frame, -1 ... N. Does not allocate if q has that size.
  void read(int frame, VectorX& q) const;
  VectorX at(int frame) const {
    VectorX q;
    read(frame, q);
    return q;
  }
  /// q_0 ... q_N.
  std::vector<VectorX> all() const;

  /// Sets the fixed frames at the start (0 and -1) or at the goal (N and N - 1), for example to
  /// settled poses (settle.h). v: velocity of frame 0; default: the problem's.
  void set_start(const VectorX& q) { set_start(q, problem_->start_v); }
  void set_start(const VectorX& q, const VectorX& v);
  void set_goal(const VectorX& q);

  /// Moves all frames that are variables by a step (nv x slots), and h by a factor exp(log_time) as
  /// far as the bounds of the duration allow.
  void move(const MatrixX& step, double log_time = 0.0);
  const Variables& variables() const { return variables_; }
  /// Replaces all variables. Does not allocate if their sizes stay the same.
  void set_variables(const Variables& variables);
  /// Writes the derivative of a frame by log h (nv) in its tangent space, if it has one: those
  /// before a fixed start and a fixed goal follow from the velocity there.
  bool moves_with_time(int frame, VectorX& out) const;
  /// Image of q one period later (sign 1) or earlier (-1) in a periodic motion.
  VectorX image(const VectorX& q, double sign) const {
    VectorX out;
    write_image(q, sign, out);
    return out;
  }

 private:
  void write_image(const VectorX& q, double sign, VectorX& out) const;
  void set_time_step(double h);

  const Problem* problem_;
  int first_ = 0;  ///< frame of the first variable
  Variables variables_;
  VectorX start_, start_v_, before_start_;  ///< frame 0, its velocity, and frame -1
  VectorX goal_, before_goal_;              ///< frames N and N - 1
};

}  // namespace counterpoint::optimization
