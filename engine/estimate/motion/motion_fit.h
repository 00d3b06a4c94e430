// Gauss-Newton on a motion estimate at one stage of its continuation, with steps limited by
// Levenberg-Marquardt damping.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "counterpoint/engine/estimate/motion/instant_model.h"
#include "counterpoint/engine/estimate/motion/motion_system.h"
#include "counterpoint/engine/optimize/newton/damping.h"

namespace counterpoint::estimation {

/// Whether a minimization goes on: until three steps in a row lower the cost by less than
/// `tolerance` of it, since one of several may be a pause, or one by a hundredth of that.
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
  /// threads: 0 for one a core. The result does not depend on it. The problem must outlive this.
  MotionFit(const MotionProblem& problem, MotionPoint start, int threads);

  /// Goes on with these laws, from `point`.
  void begin(const SimulationOptions& options, const MotionPoint& point);
  /// Parameters stay as they are, or move as the frames do (at first they stay); constants of
  /// sensors always move.
  void free_parameters(bool free) { parameters_free_ = free; }
  /// Minimizes until three steps in a row lower the cost by less than `tolerance` of it. Number of
  /// steps. `stop` is asked before each.
  int minimize(int most, double tolerance, const std::function<bool()>& stop = {});

  const MotionPoint& point() const { return point_; }
  /// Infinite where an inverse has no answer.
  double cost() const { return cost_; }
  /// Mean square of the measurements' residuals over their variance: at frame t, and of all frames.
  double measurement_ratio(int t) const;
  double measurement_ratio() const;
  const std::vector<Instant>& instants() const { return instants_; }
  const SimulationOptions& options() const { return options_; }
  /// The model with the parameters as they are.
  const Model& model() const { return model_; }
  optimization::ThreadPool& pool() { return pool_; }
  /// Normal equations at the point, factored with the least damping that allows it.
  /// @throws std::runtime_error where forces at the point are not finite.
  MotionSystem& linearized();

  // ---- For fits that share their parameters (joint_fit.h).

  /// Normal equations at the point, into system(): not factored.
  void linearize();
  MotionSystem& system() { return system_; }
  /// Goes this share of a step; the cost there. withdraw() goes back.
  double move(const MatrixX& frames, const VectorX& parameters, double share);
  void withdraw();

 private:
  /// The ratio of frame t; -1 where nothing was measured.
  double measurement_ratio(int t, SensorRows& sensors) const;
  double evaluate();
  void apply_parameters();
  bool try_step(const MatrixX& frames, const VectorX& parameters);

  const MotionProblem* problem_;
  optimization::ThreadPool pool_;
  SimulationOptions options_;
  Model model_;
  MotionPoint point_, before_;
  double cost_before_ = 0.0;
  std::vector<std::unique_ptr<InstantModel>> models_;  ///< one a thread
  std::vector<Instant> instants_;
  std::vector<InstantEquations> equations_;  ///< a batch of instants
  MotionSystem system_;
  bool parameters_free_ = false;
  double cost_ = 0.0;
  optimization::Damping damping_;
};

}  // namespace counterpoint::estimation
