// Normal equations of a window of frames, eliminated from the oldest to the newest, one front a
// frame, so that a change of new frames leaves the fronts of old ones as they are.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/motion/motion_problem.h"
#include "counterpoint/engine/estimate/motion/motion_system.h"

namespace counterpoint::estimation {

inline std::size_t index_of(int i) { return static_cast<std::size_t>(i); }

/// Knowledge of three frames and of the parameters once all frames before are eliminated:
/// 1/2 x' information x + gradient' x, x being their difference from `at`.
struct WindowFront {
  MatrixX information;  ///< (3 nv + parameters) squared; the lower triangle counts
  VectorX gradient;
  MotionPoint at;  ///< the three frames, and the parameters
};

class WindowFronts {
 public:
  /// Frames that an instant's rows see, and of which a front knows all but the first.
  static constexpr int kSeen = MotionSystem::kWidth + 1;

  WindowFronts(const Model& model, int window, int parameters);

  /// A front without any information; its point is to be set.
  void clear(int frame);
  WindowFront& front(int frame) { return fronts_[static_cast<std::size_t>(frame)]; }
  /// Adds the rows of the instant whose first frame is `frame` - `before` (0, 1 or 2: frames before
  /// the front have no rows).
  void add(int frame, const InstantEquations& equations, int before);
  /// Expresses a front about the frames from `frame` on as they are at `point`.
  void move(int frame, const MotionPoint& point);

  /// Eliminates a frame, whose front is at `point`, with `added` rows of its own (or null), and
  /// `damping` times the diagonal. Front `frame` + 1 is what is left. False if the frame's own
  /// matrix is not positive definite.
  bool eliminate(int frame, const InstantEquations* added, double damping,
                 const MotionPoint& point);
  /// The parameters' step, once all `frames` are eliminated. False as above.
  bool solve_parameters(int frames, double damping, VectorX& step) const;
  /// The frame's place that fits those behind it and the parameters, as they are at `point`, as a
  /// difference from where it was when it was eliminated (nv).
  VectorX substitute(int frame, const MotionPoint& point) const;
  /// The same, where the steps of the three frames behind and of the parameters are known.
  VectorX substitute(int frame, const MatrixX& steps, const VectorX& parameters) const;
  const VectorX& eliminated_at(int frame) const {
    return panels_[static_cast<std::size_t>(frame)].at;
  }

  /// The quadratic form of a front at a point.
  double cost(int frame, const MotionPoint& point) const;

  /// Frame 0 leaves: its front and panel are forgotten, all others move up.
  void drop_first();

 private:
  struct Panel {
    MatrixX factor;  ///< nv + 3 nv + parameters rows: own Cholesky factor, others' rows
    VectorX y;       ///< nv
    VectorX at;      ///< the frame
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
