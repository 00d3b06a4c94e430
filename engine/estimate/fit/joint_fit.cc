#include "counterpoint/engine/estimate/fit/joint_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "counterpoint/engine/estimate/fit/fit_spread.h"
#include "counterpoint/engine/estimate/motion/motion_continuation.h"

namespace counterpoint::estimation {
namespace {

/// Largest step of a configuration coordinate [m, rad], and of a parameter as a fraction of its
/// range.
constexpr double kLongestStep = 0.3, kLongestChange = 0.2;

}  // namespace

JointFit::JointFit(std::vector<MotionProblem> problems, const std::vector<MotionPoint>& start,
                   std::vector<SharedParameter> parameters, int threads)
    : parameters_(std::move(parameters)) {
  const auto count = static_cast<Eigen::Index>(parameters_.size());
  for (VectorX* x : {&scene_, &lower_, &upper_, &prior_}) x->resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const SharedParameter& p = parameters_[static_cast<std::size_t>(i)];
    const auto coordinate = [&](double value) { return p.logarithmic ? std::log(value) : value; };
    scene_[i] = coordinate(p.scene);
    lower_[i] = coordinate(p.lower);
    upper_[i] = coordinate(p.upper);
    prior_[i] = fitting::prior_weight(p.deviation, p.scene, p.logarithmic, upper_[i] - lower_[i]);
  }
  x_ = scene_;
  for (std::size_t i = 0; i < problems.size(); ++i) {
    problems_.push_back(std::make_unique<MotionProblem>(std::move(problems[i])));
    fits_.push_back(std::make_unique<MotionFit>(*problems_.back(), start[i], threads));
    fits_.back()->free_parameters(true);
  }
}

VectorX JointFit::values() const {
  VectorX out(x_.size());
  for (Eigen::Index i = 0; i < x_.size(); ++i) out[i] = is_logarithmic(i) ? std::exp(x_[i]) : x_[i];
  return out;
}

/// Derivatives of the values with respect to the coordinates.
VectorX JointFit::slopes() const {
  VectorX out = values();
  for (Eigen::Index i = 0; i < x_.size(); ++i)
    if (!is_logarithmic(i)) out[i] = 1.0;
  return out;
}

std::vector<MotionPoint> JointFit::points() const {
  std::vector<MotionPoint> out;
  for (const auto& fit : fits_) out.push_back(fit->point());
  return out;
}

double JointFit::prior_cost() const { return 0.5 * prior_.dot((x_ - scene_).cwiseAbs2()); }

void JointFit::begin(double smoothing, double loss_scale, const std::vector<MotionPoint>& points) {
  for (Eigen::Index i = 0; i < x_.size(); ++i) {
    const double at = parameters_[static_cast<std::size_t>(i)].scene + points[0].parameters[i];
    x_[i] = is_logarithmic(i) ? std::log(at) : at;
  }
  damping_.begin();
  cost_ = prior_cost();
  for (std::size_t i = 0; i < fits_.size(); ++i) {
    MotionProblem& problem = *problems_[i];
    problem.loss_scale = problem.force_loss_scale = loss_scale;
    fits_[i]->begin(stage_options(problem, smoothing), points[i]);
    cost_ += fits_[i]->cost();
  }
}

/// Eliminates the frames of each motion. Returns false if a motion's equations are not positive
/// definite.
bool JointFit::reduce(double mu) {
  const VectorX slope = slopes();
  const Eigen::Index count = x_.size();
  schur_ = prior_.asDiagonal();
  scatter_ = MatrixX::Zero(count, count);
  gradient_ = prior_.cwiseProduct(x_ - scene_);
  by_motion_.resize(count, static_cast<Eigen::Index>(fits_.size()));
  Eigen::Index next = 0;
  for (const auto& fit : fits_) {
    MotionSystem& system = fit->system();
    if (!system.reduce(mu, fit->pool())) return false;
    const VectorX own = slope.cwiseProduct(system.reduced_gradient());
    const MatrixX schur = slope.asDiagonal() * system.schur() * slope.asDiagonal();
    schur_ += schur;
    by_motion_.col(next++) = schur.diagonal();
    scatter_ += own * own.transpose();
    gradient_ += own;
  }
  return true;
}

/// Computes the step of the coordinates within their bounds. Returns false if there is none.
bool JointFit::solve(VectorX& step) {
  if (!reduce(damping_.value())) return false;
  const Eigen::Index count = x_.size();
  // Fix a parameter that would leave its range at the bound, and solve for the others again.
  MatrixX A = schur_;
  VectorX b = -gradient_;
  for (Eigen::Index round = 0; round <= count; ++round) {
    const Eigen::LDLT<MatrixX> factor(A);
    if (factor.info() != Eigen::Success || !factor.isPositive()) return false;
    step = factor.solve(b);
    Eigen::Index out = -1;
    for (Eigen::Index i = 0; i < count && out < 0; ++i) {
      const double end = x_[i] + step[i];
      if (end < lower_[i] - 1e-12 || end > upper_[i] + 1e-12) out = i;
    }
    if (out < 0) break;
    const double end = std::clamp(x_[out] + step[out], lower_[out], upper_[out]);
    const double to = end - x_[out];
    b -= to * A.col(out);
    A.row(out).setZero();
    A.col(out).setZero();
    A(out, out) = 1.0;
    b[out] = to;
  }
  return step.allFinite();
}

/// Takes the step if it lowers the cost, and adapts the damping.
bool JointFit::try_step(const VectorX& step) {
  const VectorX before = x_, now = values();
  double share = 1.0;
  for (Eigen::Index i = 0; i < x_.size(); ++i)
    share = std::min(
        share, kLongestChange * (upper_[i] - lower_[i]) / std::max(std::abs(step[i]), 1e-300));
  const VectorX linear = slopes().cwiseProduct(step);
  double expected = 0.0;
  std::vector<MatrixX> frames;
  for (const auto& fit : fits_) {
    frames.push_back(fit->system().frames_step(linear));
    const double longest = frames.back().cwiseAbs().maxCoeff();
    share = std::min(share, kLongestStep / std::max(longest, 1e-300));
    expected += fit->system().expected_decrease(damping_.value(), frames.back(), linear);
  }
  x_ += share * step;
  const VectorX change = values() - now;
  double cost = prior_cost();
  for (std::size_t i = 0; i < fits_.size(); ++i)
    cost += fits_[i]->move(share * frames[i], change, 1.0);
  const double decrease = cost_ - cost;
  if (!(decrease > 0.0)) {
    x_ = before;
    for (const auto& fit : fits_) fit->withdraw();
    damping_.reject();
    return false;
  }
  damping_.accept(decrease, expected);
  cost_ = cost;
  return true;
}

int JointFit::minimize(int most, double tolerance, const std::function<bool()>& stop) {
  VectorX step;
  Descent descent(tolerance);
  for (int steps = 0; steps < most; ++steps) {
    if (stop && stop()) return steps;
    const double before = cost_;
    for (const auto& fit : fits_) fit->linearize();
    bool accepted = false;
    for (int trial = 0; damping_.allows(trial) && !accepted; ++trial) {
      if (solve(step))
        accepted = try_step(step);
      else
        damping_.strengthen();
    }
    if (!accepted || descent.ends(before, cost_)) return steps + 1;
  }
  return most;
}

JointFit::Information JointFit::information() {
  for (const auto& fit : fits_) fit->linearize();
  for (double mu = 0.0; !reduce(mu); mu = optimization::Damping::stronger(mu))
    if (optimization::Damping::exhausted(mu))
      throw std::runtime_error("the recorded motions have no finite forces in this scene");
  return {schur_, scatter_, by_motion_, prior_, upper_ - lower_};
}

}  // namespace counterpoint::estimation
