// Block Cholesky factorization of the normal equations of a window of frames, from the oldest to
// the newest, one front per frame: changes of new frames leave the fronts of old ones valid.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/motion/motion_problem.h"
#include "counterpoint/engine/estimate/motion/motion_system.h"

namespace counterpoint::estimation {

inline std::size_t index_of(int i) { return static_cast<std::size_t>(i); }

/// Quadratic form of three frames and the parameters after all earlier frames are eliminated:
/// 1/2 x' information x + gradient' x, where x is the difference from `at`.
struct WindowFront {
  MatrixX information;  ///< (3 nv + parameters) squared; only the lower triangle is used
  VectorX gradient;
  MotionPoint at;  ///< linearization point: three frames, and the parameters
};

class WindowFronts {
 public:
  /// Number of frames that an instant's rows depend on; a front contains all of them but the first.
  static constexpr int kSeen = MotionSystem::kWidth + 1;

  WindowFronts(const Model& model, int window, int parameters);

  /// Sets the information of a front to zero; its point must be set afterwards.
  void clear(int frame);
  WindowFront& front(int frame) { return fronts_[static_cast<std::size_t>(frame)]; }
  /// Adds the rows of an instant to a front. The instant's first frame is `frame` - `before` (0, 1
  /// or 2); its columns for frames before the front are dropped.
  void add(int frame, const InstantEquations& equations, int before);
  /// Moves the linearization point of a front to the frames of `point` from `frame` on.
  void move(int frame, const MotionPoint& point);

  /// Eliminates a frame whose front is at `point`, after adding the rows `added` (or null) and
  /// `damping` times the diagonal. The Schur complement becomes front `frame` + 1. Returns false if
  /// the frame's diagonal block is not positive definite.
  bool eliminate(int frame, const InstantEquations* added, double damping,
                 const MotionPoint& point);
  /// Computes the step of the parameters once all `frames` are eliminated. Returns false as above.
  bool solve_parameters(int frames, double damping, VectorX& step) const;
  /// Back substitution: returns the optimal difference (nv) of a frame from its point at
  /// elimination, given the later frames and parameters at `point`.
  VectorX substitute(int frame, const MotionPoint& point) const;
  /// The same for given steps of the three later frames and of the parameters.
  VectorX substitute(int frame, const MatrixX& steps, const VectorX& parameters) const;
  const VectorX& eliminated_at(int frame) const {
    return panels_[static_cast<std::size_t>(frame)].at;
  }

  /// Value of the quadratic form of a front at a point.
  double cost(int frame, const MotionPoint& point) const;

  /// Drops frame 0 with its front and panel, and shifts all others by one.
  void drop_first();

 private:
  struct Panel {
    MatrixX factor;  ///< nv + 3 nv + parameters rows: Cholesky factor of the frame's block, and the
                     ///< rows below it
    VectorX y;       ///< nv
    VectorX at;      ///< the frame's configuration at elimination
  };
  VectorX difference(int frame, const MotionPoint& point) const;

  const Model& model_;
  int nv_, parameters_;
  std::vector<WindowFront> fronts_;
  std::vector<Panel> panels_;
  MatrixX work_;
  VectorX work_gradient_;
};

}  // namespace counterpoint::estimation
