// Gauss-Newton for several motions with shared parameters. The normal equations have arrow
// structure: one block per motion, and a corner that is the sum of their Schur complements on the
// parameters.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "counterpoint/engine/estimate/motion/motion_fit.h"

namespace counterpoint::estimation {

/// A parameter shared by all motions. Its coordinate in the fit is its value or the logarithm of
/// it.
struct SharedParameter {
  double scene = 0.0;  ///< value in the scene
  double lower = 0.0, upper = 0.0;
  bool logarithmic = false;
  std::optional<double> deviation = {};  ///< standard deviation of the prior; none: the range
};

class JointFit {
 public:
  /// problems: their parameters are the shared ones, in this order, with zero prior weights. The
  /// prior mean of a coordinate is the scene's value. threads: as for MotionFit.
  JointFit(std::vector<MotionProblem> problems, const std::vector<MotionPoint>& start,
           std::vector<SharedParameter> parameters, int threads);

  /// Restarts at this smoothing [m] from `points`, one per motion. loss_scale: of MotionProblem,
  /// for positions and forces [standard deviations]; 0: squares.
  void begin(double smoothing, double loss_scale, const std::vector<MotionPoint>& points);
  /// Minimizes like MotionFit::minimize.
  int minimize(int most, double tolerance, const std::function<bool()>& stop = {});

  double cost() const { return cost_; }
  std::vector<MotionPoint> points() const;
  VectorX values() const;
  const VectorX& coordinates() const { return x_; }
  /// Mean square of a motion's measurement residuals over their variance.
  double measurement_ratio(std::size_t motion) const { return fits_[motion]->measurement_ratio(); }
  std::size_t size() const { return fits_.size(); }

  /// Information of the recordings about the coordinates at the current point.
  struct Information {
    MatrixX hessian;    ///< Schur complement of all motions, with the priors
    MatrixX scatter;    ///< sum over motions of g g', g the gradient of one motion
    MatrixX by_motion;  ///< diagonal of the Schur complement of each motion
    VectorX prior;      ///< part of the priors in the Hessian's diagonal
    VectorX range;      ///< range of each coordinate
  };
  Information information();

 private:
  bool reduce(double mu);
  bool solve(VectorX& step);
  bool try_step(const VectorX& step);
  double prior_cost() const;
  VectorX slopes() const;
  bool is_logarithmic(Eigen::Index i) const {
    return parameters_[static_cast<std::size_t>(i)].logarithmic;
  }

  std::vector<std::unique_ptr<MotionProblem>> problems_;
  std::vector<std::unique_ptr<MotionFit>> fits_;
  std::vector<SharedParameter> parameters_;
  VectorX x_, scene_, lower_, upper_, prior_;  ///< coordinates, and squared weights of the priors
  MatrixX schur_, scatter_, by_motion_;
  VectorX gradient_;
  double cost_ = 0.0;
  optimization::Damping damping_;
};

}  // namespace counterpoint::estimation
