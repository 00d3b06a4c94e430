// Normal equations of a motion estimate: a block band of frames, bordered by parameters.
#pragma once

#include <vector>

#include "counterpoint/engine/optimize/newton/block_cholesky.h"

namespace counterpoint::estimation {

/// J'J and J'r of the residuals at instant t, over the frames t - 2 ... t + 1 that they depend on.
struct InstantEquations {
  MatrixX gram;      ///< 4 nv x 4 nv; of diagonal blocks only the lower triangle is used
  VectorX gradient;  ///< 4 nv
  MatrixX border;    ///< 4 nv x parameters
  MatrixX corner;    ///< parameters x parameters
  VectorX corner_gradient;

  void set_zero(int nv, int parameters);
};

class MotionSystem {
 public:
  /// Bandwidth: number of other frames that an instant's residuals depend on.
  static constexpr int kWidth = 3;

  MotionSystem(int frames, int nv, int parameters);

  void set_zero();
  /// Adds the residuals of instant t; blocks of frames outside the motion are dropped.
  void add(int t, const InstantEquations& equations);
  /// Adds a prior on parameter `index`: squared weight, and deviation from the prior mean.
  void add_prior(int index, double weight2, double deviation);

  /// Factors J'J + mu diag(J'J). Returns false if it is not positive definite.
  bool factor(double mu, contact::ThreadPool& pool);
  /// Computes the step -(J'J + mu diag) \ J'r of frames (nv x frames) and parameters. Needs
  /// factor().
  void solve(MatrixX& frames, VectorX& parameters) const;

  /// First half of factor(), for systems that share their parameters: eliminates the frames, which
  /// leaves schur() and reduced_gradient() of the parameters.
  bool reduce(double mu, contact::ThreadPool& pool);
  const MatrixX& schur() const { return schur_; }
  const VectorX& reduced_gradient() const { return reduced_gradient_; }
  /// Step of the frames (nv x frames) for a given step of the parameters. Needs reduce().
  MatrixX frames_step(const VectorX& parameters) const;

  const MatrixX& gradient() const { return gradient_; }
  const VectorX& parameter_gradient() const { return parameter_gradient_; }
  /// Decrease of the cost that the linear model predicts for a step.
  double expected_decrease(double mu, const MatrixX& frames, const VectorX& parameters) const;
  const optimization::BlockCholesky& band() const { return band_; }

  /// Covariance of the parameters, and the gain by which it adds to that of frames: a parameter
  /// step p moves the frames by -`gain` p. Needs factor().
  MatrixX parameter_covariance() const { return inverse_schur_; }
  const std::vector<MatrixX>& gain() const { return gain_; }

 private:
  int nv_, parameters_;
  optimization::BlockCholesky band_;
  MatrixX gradient_, shift_;     ///< nv x frames
  MatrixX own_step_;             ///< nv x frames: the step for fixed parameters
  std::vector<MatrixX> border_;  ///< one per parameter: nv x frames
  std::vector<MatrixX> gain_;    ///< one per parameter: inverse of the band times border_
  MatrixX corner_, schur_, inverse_schur_;
  VectorX parameter_gradient_, reduced_gradient_;
};

}  // namespace counterpoint::estimation
