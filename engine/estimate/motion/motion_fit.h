// Gauss-Newton with Levenberg-Marquardt damping for a motion estimate at one stage of its
// continuation.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "counterpoint/engine/estimate/motion/instant_model.h"
#include "counterpoint/engine/estimate/motion/motion_system.h"
#include "counterpoint/engine/optimize/newton/damping.h"

namespace counterpoint::estimation {

/// Stopping rule of a minimization: three steps in a row lower the cost by less than `tolerance` of
/// it (a single one may be a pause), or one step by less than a hundredth of that.
class Descent {
 public:
  explicit Descent(double tolerance) : tolerance_(tolerance) {}

  bool ends(double before, double cost) {
    const double decrease = before - cost, small = tolerance_ * cost;
    in_a_row_ = decrease < small ? in_a_row_ + 1 : 0;
    return in_a_row_ >= 3 || decrease < 0.01 * tolerance_ * cost;
  }

 private:
  double tolerance_;
  int in_a_row_ = 0;
};

class MotionFit {
 public:
  /// threads: 0 for one per core; the result does not depend on it. The problem must outlive this.
  MotionFit(const MotionProblem& problem, MotionPoint start, int threads);

  /// Restarts with these laws, from `point`.
  void begin(const SimulationOptions& options, const MotionPoint& point);
  /// Frees or fixes the parameters (fixed at first); constants of sensors are always free.
  void free_parameters(bool free) { parameters_free_ = free; }
  /// Minimizes until Descent ends, or for `most` steps. `stop` is called before each step. Returns
  /// the number of steps.
  int minimize(int most, double tolerance, const std::function<bool()>& stop = {});
  /// Sets a function that minimize() calls after every step that lowers the cost.
  void watch(std::function<void()> watch) { watch_ = std::move(watch); }

  const MotionPoint& point() const { return point_; }
  /// Cost at the point; infinite if inverse dynamics fails.
  double cost() const { return cost_; }
  /// Mean square of the measurement residuals over their variance: at frame t, and over all frames.
  double measurement_ratio(int t) const;
  double measurement_ratio() const;
  const std::vector<Instant>& instants() const { return instants_; }
  const SimulationOptions& options() const { return options_; }
  /// The model with the current parameters.
  const Model& model() const { return model_; }
  contact::ThreadPool& pool() { return pool_; }
  /// Normal equations at the point, factored with the least damping that makes them positive
  /// definite.
  /// @throws std::runtime_error where forces at the point are not finite.
  MotionSystem& linearized();

  // ---- For joint fits with shared parameters (joint_fit.h).

  /// Builds the normal equations at the point in system(), without factoring them.
  void linearize();
  MotionSystem& system() { return system_; }
  /// Moves by this fraction of a step and returns the cost; withdraw() undoes it.
  double move(const MatrixX& frames, const VectorX& parameters, double share);
  void withdraw();

 private:
  /// Ratio of frame t; -1 if nothing was measured.
  double measurement_ratio(int t, SensorRows& sensors) const;
  double evaluate();
  void apply_parameters();
  bool try_step(const MatrixX& frames, const VectorX& parameters);

  const MotionProblem* problem_;
  contact::ThreadPool pool_;
  SimulationOptions options_;
  Model model_;
  MotionPoint point_, before_;
  double cost_before_ = 0.0;
  std::vector<std::unique_ptr<InstantModel>> models_;  ///< one per thread
  std::vector<Instant> instants_;
  std::vector<InstantEquations> equations_;  ///< for a batch of instants
  MotionSystem system_;
  bool parameters_free_ = false;
  double cost_ = 0.0;
  optimization::Damping damping_;
  std::function<void()> watch_;
};

}  // namespace counterpoint::estimation
