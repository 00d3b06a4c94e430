// Normal equations of a motion estimate: a band of frames, bordered by parameters.
#pragma once

#include <vector>

#include "counterpoint/engine/optimize/newton/block_cholesky.h"

namespace counterpoint::estimation {

/// J'J and J'r of the rows of one instant, by the frames t - 2 ... t + 1 that they depend on.
struct InstantEquations {
  MatrixX gram;      ///< 4 nv x 4 nv; of the diagonal blocks, the lower triangle counts
  VectorX gradient;  ///< 4 nv
  MatrixX border;    ///< 4 nv x parameters
  MatrixX corner;    ///< parameters x parameters
  VectorX corner_gradient;

  void set_zero(int nv, int parameters);
};

class MotionSystem {
 public:
  /// Frames that an instant's rows depend on, but its own.
  static constexpr int kWidth = 3;

  MotionSystem(int frames, int nv, int parameters);

  void set_zero();
  /// Adds the rows of instant t; frames outside the motion have no rows.
  void add(int t, const InstantEquations& equations);
  /// Adds a prior on parameter `index`: its weight squared, and that times its deviation.
  void add_prior(int index, double weight2, double deviation);

  /// Factors J'J + mu diag(J'J). False if that is not positive definite.
  bool factor(double mu, optimization::ThreadPool& pool);
  /// The step -(J'J + mu diag) \ J'r of frames (nv x frames) and of parameters. Needs factor().
  void solve(MatrixX& frames, VectorX& parameters) const;

  /// The same in two halves, for systems that share their parameters: factors the frames alone and
  /// eliminates them, which leaves schur() and reduced_gradient() of the parameters.
  bool reduce(double mu, optimization::ThreadPool& pool);
  const MatrixX& schur() const { return schur_; }
  const VectorX& reduced_gradient() const { return reduced_gradient_; }
  /// The step of the frames (nv x frames) where the parameters make this one. Needs reduce().
  MatrixX frames_step(const VectorX& parameters) const;

  const MatrixX& gradient() const { return gradient_; }
  const VectorX& parameter_gradient() const { return parameter_gradient_; }
  /// The decrease of the cost that a linear model expects of a step.
  double expected_decrease(double mu, const MatrixX& frames, const VectorX& parameters) const;
  const optimization::BlockCholesky& band() const { return band_; }

  /// Covariance of the parameters, and what the frames' covariance gains by them: frames move with
  /// the parameters by -`gain`. Needs factor().
  MatrixX parameter_covariance() const { return inverse_schur_; }
  const std::vector<MatrixX>& gain() const { return gain_; }

 private:
  int nv_, parameters_;
  optimization::BlockCholesky band_;
  MatrixX gradient_, shift_;     ///< nv x frames
  MatrixX own_step_;             ///< nv x frames: the step where parameters stay
  std::vector<MatrixX> border_;  ///< one a parameter: nv x frames
  std::vector<MatrixX> gain_;    ///< one a parameter: the band's inverse times border_
  MatrixX corner_, schur_, inverse_schur_;
  VectorX parameter_gradient_, reduced_gradient_;
};

}  // namespace counterpoint::estimation
