// Gauss-Newton with Levenberg-Marquardt damping on the frames of a motion, at one stage of the
// continuation; conditions are imposed by an augmented Lagrangian.
//
//   (J'J + mu (D + B)) step = -J'r,   D = diag J'J
//
// B is zero, or with Continuation::contact_damping penalizes relative changes of contact forces. A
// contact with little load has small slopes, and steps within D cross its gap, where its force
// grows by orders of magnitude.
// mu follows the ratio of actual to predicted decrease (Nielsen, "Damping parameter in Marquardt's
// method", 1999). A condition c = 0 adds rho / 2 |c + lambda|^2 to the cost; near
// feasibility lambda += c (Hestenes 1969, Powell 1969). lambda is the multiplier over rho.
//
// A free duration adds s = log h to the unknowns, a border of the system, which is eliminated last:
// within its bounds the model is then a parabola over s alone. The entry of s on the diagonal has
// r' d^2r/ds^2, too: J'J alone is half of the Hessian of T^2 by log T, and a step that minimized
// that model would go twice as far as it should.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/contact/thread_pool.h"
#include "counterpoint/engine/optimize/newton/block_cholesky.h"
#include "counterpoint/engine/optimize/newton/damping.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/engine/optimize/terms/evaluator.h"

namespace counterpoint::optimization {

class Newton {
 public:
  /// num_threads: 0 for one per core. The result does not depend on it.
  Newton(const Problem& problem, const std::vector<VectorX>& frames, int num_threads);

  Frames& frames() { return frames_; }
  const Frames& frames() const { return frames_; }

  /// Restarts at a stage. scale: rescale lambda so that rho lambda is kept when the penalty
  /// changes.
  void begin(const Stage& stage, bool scale = true);
  /// Cost of the current motion; infinite if inverse dynamics fails.
  double cost() const { return cost_; }
  /// Takes one iteration: linearizes, and tries at most `most_trials` steps until one lowers the
  /// cost. The frames may have been changed since the last one. Does not allocate after the first
  /// iteration.
  Iteration iterate(int most_trials = Damping::kMaxTrials);

  /// Violation of all conditions over the instants.
  Spread violation() const;
  /// The same for kUnactuatedForce only, in weights of the trees.
  Spread unactuated() const;
  /// Adds the violations to lambda if all are below `limit`; otherwise halves lambda.
  void update_multipliers(double limit);
  /// Cost of each term.
  VectorX cost_by_term() const;
  const std::vector<InstantValues>& values() const { return values_; }

  std::vector<VectorX> multipliers() const { return multipliers_; }
  void set_multipliers(std::vector<VectorX> multipliers) { multipliers_ = std::move(multipliers); }
  /// Restores the penalty that restored multipliers refer to.
  void restore_penalty(double penalty) { stage_.penalty = penalty; }
  void set_damping(double mu) { damping_.set(mu); }
  void set_least_damping(double mu) { damping_.set_least(mu); }
  double damping() const { return damping_.value(); }
  /// Fills J'J and J'r, and sets the cost; public for tests.
  void linearize();
  const BlockCholesky& system() const { return system_; }
  const MatrixX& gradient() const { return gradient_; }
  /// Derivative of the cost by log h; 0 if the duration is fixed.
  double time_gradient() const { return time_gradient_; }
  /// J' dr/ds (nv x slots) and |dr/ds|^2 with s = log h; 0 if the duration is fixed.
  const MatrixX& border() const { return border_; }
  double time_gram() const { return time_gram_; }

 private:
  double evaluate(std::vector<InstantValues>& values);
  static double cost_of(const std::vector<InstantValues>& values);
  void assemble();
  void add_to_system(int instant);
  void add_fixed_frames(int instant, NormalEquations& normal);
  bool solve();
  double expected_decrease() const;
  void add_metric(double scale);
  double try_step(double bound, Iteration& iteration);

  const Problem* problem_;
  Layout layout_;
  Frames frames_;
  Stage stage_;
  contact::ThreadPool pool_;
  std::vector<std::unique_ptr<Evaluator>> evaluators_;  ///< one per thread
  std::vector<InstantValues> values_, trial_values_;    ///< one per instant
  std::vector<NormalEquations> normal_;                 ///< one per instant
  std::vector<VectorX> multipliers_;                    ///< one per instant: lambda by row
  BlockCholesky system_;
  MatrixX gradient_, shift_, step_;  ///< nv x slots
  MatrixX border_, column_;          ///< nv x slots: column of log h, and its solution
  // Sums for s = log h, |dr/ds|^2, r' dr/ds and r' d^2r/ds^2; the Hessian, its shift and the step.
  double time_gram_ = 0.0, time_gradient_ = 0.0, time_curvature_ = 0.0;
  double time_hessian_ = 0.0, time_shift_ = 0.0, time_step_ = 0.0;
  VectorX moved_, moved_frame_, moved_rows_;  ///< scratch of add_fixed_frames
  MatrixX metric_;                            ///< nv x nv
  Variables kept_;                            ///< before a trial
  double cost_ = 0.0;
  Damping damping_;
};

}  // namespace counterpoint::optimization
