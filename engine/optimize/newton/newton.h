// Gauss-Newton on the frames of a motion, with steps limited by Levenberg-Marquardt damping, at one
// stage of the continuation; conditions by an augmented Lagrangian.
//
//   (J'J + mu D) step = -J'r,   D = diag J'J
//
// mu follows the ratio of the decrease found to that expected (Nielsen, "Damping parameter in
// Marquardt's method", 1999). A condition c = 0 counts rho / 2 |c + lambda|^2; once the motion is
// near it lambda += c (Hestenes 1969, Powell 1969), lambda being the multiplier over rho.
#pragma once

#include <memory>
#include <vector>

#include "counterpoint/engine/optimize/newton/block_cholesky.h"
#include "counterpoint/engine/optimize/newton/damping.h"
#include "counterpoint/engine/optimize/newton/thread_pool.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/engine/optimize/terms/evaluator.h"

namespace counterpoint::optimization {

class Newton {
 public:
  /// num_threads: 0 for one a core. The result does not depend on it.
  Newton(const Problem& problem, const std::vector<VectorX>& frames, int num_threads);

  Frames& frames() { return frames_; }
  const Frames& frames() const { return frames_; }

  /// Starts anew at a stage. scale: multipliers keep their force where the penalty changes.
  void begin(const Stage& stage, bool scale = true);
  /// Cost of the motion as it is; infinite where an inverse has no answer.
  double cost() const { return cost_; }
  /// One step: linearizes, and tries steps until one is better.
  Iteration iterate();

  /// |violation| of conditions over instants.
  Spread violation() const;
  /// The same of kUnactuatedForce alone: scene weights.
  Spread unactuated() const;
  /// lambda += violation where all are below `limit`; else lambda is halved.
  void update_multipliers(double limit);
  /// By term: its share of the cost.
  VectorX cost_by_term() const;
  const std::vector<InstantValues>& values() const { return values_; }

  std::vector<VectorX> multipliers() const { return multipliers_; }
  void set_multipliers(std::vector<VectorX> multipliers) { multipliers_ = std::move(multipliers); }
  /// The penalty that multipliers belong to, where they are put back.
  void restore_penalty(double penalty) { stage_.penalty = penalty; }
  void set_damping(double mu) { damping_.set(mu); }
  double damping() const { return damping_.value(); }
  /// J'J + as factored, for tests; linearize() fills it.
  void linearize();
  const BlockCholesky& system() const { return system_; }
  const MatrixX& gradient() const { return gradient_; }

 private:
  double evaluate(std::vector<InstantValues>& values);
  void assemble();
  void add_to_system(int instant);
  double try_step(double bound, Iteration& iteration);

  const Problem* problem_;
  Layout layout_;
  Frames frames_;
  Stage stage_;
  ThreadPool pool_;
  std::vector<std::unique_ptr<Evaluator>> evaluators_;  ///< by thread
  std::vector<InstantValues> values_, trial_values_;    ///< by instant
  std::vector<NormalEquations> normal_;                 ///< by instant
  std::vector<VectorX> multipliers_;                    ///< by instant: rows
  BlockCholesky system_;
  MatrixX gradient_, shift_, step_;  ///< nv x slots
  double cost_ = 0.0;
  Damping damping_;
};

}  // namespace counterpoint::optimization
