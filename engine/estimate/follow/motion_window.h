// A motion estimate of the newest rows of a recording: each row that comes moves the window on, the
// oldest frame leaves, and what it said of the others stays as a quadratic prior.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/engine/estimate/follow/window_fronts.h"
#include "counterpoint/engine/estimate/motion/instant_model.h"

namespace counterpoint::estimation {

struct WindowOptions {
  int frames = 30;       ///< frames of the window, 6 or more
  int steps = 2;         ///< Gauss-Newton steps a row
  double newest = 1e-2;  ///< smoothing of the contact law at the newest frame [m]
  double oldest = 1e-3;  ///< the same at frames of age `hardening` and more [m]
  int hardening = 10;    ///< rows in which a frame's law hardens from one to the other
  int changing = 10;     ///< rows in which a frame's terms change, `hardening` or more
  double still = 1e-5;   ///< frames that moved less keep their linearization [m, rad]
  int threads = 1;       ///< 0: one a core
};

/// A row as it was recorded.
struct WindowRow {
  VectorX q;       ///< nq
  VectorX weight;  ///< nv: MotionProblem::position_weight
  VectorX force;   ///< nv: measured joint forces [N, N m]
};

class MotionWindow {
 public:
  /// The problem without any frame: laws, weights and parameters.
  MotionWindow(MotionProblem problem, const WindowOptions& options);
  ~MotionWindow();

  /// A row more; where the window is full its oldest frame leaves.
  void push(const WindowRow& row);
  /// Measured accelerations of frame t [m/s^2, rad/s^2].
  void set_acceleration(int t, const VectorX& acceleration);
  /// Once the first rows are there: finds their motion, from laws that are soft everywhere to those
  /// of their ages.
  void begin();
  /// Gauss-Newton steps, as many as the options say. `age`: so much older are frames than they are,
  /// as far as their laws go (the end of a recording).
  void improve(int age = 0);

  int frames() const { return problem_.frames(); }
  const MotionProblem& problem() const { return problem_; }
  const MotionPoint& point() const { return point_; }
  const Model& model() const { return model_; }
  /// The inverse at frame t, 1 ... frames() - 2, under the law of its age. Valid until the next
  /// call.
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
  optimization::ThreadPool pool_;
  Model model_;
  std::vector<SimulationOptions> laws_;  ///< by age
  int age_ = 0;                          ///< added to all ages
  MotionPoint point_;
  std::vector<std::unique_ptr<InstantModel>> models_;  ///< one a thread
  std::vector<Instant> instants_;
  std::vector<InstantEquations> equations_;
  WindowFronts fronts_;
  std::vector<double> moved_;  ///< by frame: from where it was linearized [m, rad]
  MatrixX steps_;              ///< nv x frames
  VectorX parameter_step_;
  bool begins_ = true;  ///< no frame has left
  int valid_ = 0;       ///< fronts up to this one have no damping
  double damping_ = 0.0;
  long differentiated_ = 0;
};

}  // namespace counterpoint::estimation
