// Motion estimate over a sliding window of the newest rows. Each new row shifts the window; the
// oldest frame is marginalized, which leaves a quadratic prior on the others.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/engine/estimate/follow/window_fronts.h"
#include "counterpoint/engine/estimate/motion/instant_model.h"

namespace counterpoint::estimation {

struct WindowOptions {
  int frames = 30;       ///< number of frames of the window, 6 or more
  int steps = 2;         ///< Gauss-Newton steps per row
  double newest = 1e-2;  ///< smoothing of the contact law at the newest frame [m]
  double oldest = 1e-3;  ///< the same at frames of age `hardening` or more [m]
  int hardening = 10;    ///< rows over which a frame's law hardens from `newest` to `oldest`
  int changing = 10;     ///< rows over which a frame's terms change, `hardening` or more
  double still = 1e-5;   ///< frames that moved less keep their linearization [m, rad]
  int threads = 1;       ///< 0: one per core
};

/// One recorded row.
struct WindowRow {
  VectorX q;       ///< nq
  VectorX weight;  ///< nv: MotionProblem::position_weight
  VectorX force;   ///< nv: measured joint forces [N, N m]
};

class MotionWindow {
 public:
  /// problem: laws, weights and parameters; its frames are dropped.
  MotionWindow(MotionProblem problem, const WindowOptions& options);
  ~MotionWindow();

  /// Adds a row; if the window is full, the oldest frame is marginalized.
  void push(const WindowRow& row);
  /// Sets the measured acceleration of frame t (nv) [m/s^2, rad/s^2].
  void set_acceleration(int t, const VectorX& acceleration);
  /// Finds the motion of the first rows: laws start soft at all frames and harden to those of the
  /// frames' ages.
  void begin();
  /// Takes the configured number of Gauss-Newton steps. `age` is added to the ages of all frames in
  /// the choice of their laws (used at the end of a recording).
  void improve(int age = 0);

  int frames() const { return problem_.frames(); }
  const MotionProblem& problem() const { return problem_; }
  const MotionPoint& point() const { return point_; }
  const Model& model() const { return model_; }
  /// Inverse dynamics at frame t, 1 ... frames() - 2, under the law of its age. Valid until the
  /// next call.
  const Inverse& invert(int t);
  /// Number of instants differentiated so far.
  long differentiated() const { return differentiated_; }

 private:
  const SimulationOptions& options_of(int t) const;
  void drop_first();
  int age_of(int t) const;
  void linearize(int first);
  bool factor(int first, int undamped, double damping);
  double cost(int first);
  bool step(int first, int most);
  int first_moved(int most) const;
  void follow_behind(int first);
  void apply_parameters();

  WindowOptions options_;
  MotionProblem problem_;
  contact::ThreadPool pool_;
  Model model_;
  std::vector<SimulationOptions> laws_;  ///< indexed by age
  int age_ = 0;                          ///< added to all ages
  MotionPoint point_;
  std::vector<std::unique_ptr<InstantModel>> models_;  ///< one per thread
  std::vector<Instant> instants_;
  std::vector<InstantEquations> equations_;
  WindowFronts fronts_;
  std::vector<double> moved_;  ///< distance of each frame from its linearization point [m, rad]
  MatrixX steps_;              ///< nv x frames
  VectorX parameter_step_;
  bool begins_ = true;  ///< no frame has been dropped yet
  int valid_ = 0;       ///< fronts up to this one are undamped
  double damping_ = 0.0;
  long differentiated_ = 0;
};

}  // namespace counterpoint::estimation
