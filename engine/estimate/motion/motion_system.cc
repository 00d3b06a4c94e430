#include "counterpoint/engine/estimate/motion/motion_system.h"

#include <Eigen/Cholesky>

namespace counterpoint::estimation {
namespace {

/// Lower bound of the damped diagonal, for coordinates without weight.
constexpr double kLeastDiagonal = 1e-9;

double dot(const MatrixX& a, const MatrixX& b) { return a.cwiseProduct(b).sum(); }

}  // namespace

void InstantEquations::set_zero(int nv, int parameters) {
  const int rows = (MotionSystem::kWidth + 1) * nv;
  gram.setZero(rows, rows);
  gradient.setZero(rows);
  border.setZero(rows, parameters);
  corner.setZero(parameters, parameters);
  corner_gradient.setZero(parameters);
}

MotionSystem::MotionSystem(int frames, int nv, int parameters)
    : nv_(nv),
      parameters_(parameters),
      band_(frames, nv, false, kWidth),
      border_(static_cast<std::size_t>(parameters), MatrixX::Zero(nv, frames)),
      gain_(border_) {
  gradient_.resize(nv, frames);
  shift_.resize(nv, frames);
  set_zero();
}

void MotionSystem::set_zero() {
  band_.set_zero();
  gradient_.setZero();
  for (MatrixX& column : border_) column.setZero();
  corner_.setZero(parameters_, parameters_);
  parameter_gradient_.setZero(parameters_);
}

void MotionSystem::add(int t, const InstantEquations& equations) {
  for (int a = 0; a <= kWidth; ++a) {
    const int frame = t - 2 + a;
    if (frame < 0 || frame >= band_.num_blocks()) continue;
    gradient_.col(frame) += equations.gradient.segment(a * nv_, nv_);
    for (int k = 0; k < parameters_; ++k)
      border_[static_cast<std::size_t>(k)].col(frame) += equations.border.block(a * nv_, k, nv_, 1);
    for (int b = 0; b <= a; ++b) {
      const int other = t - 2 + b;
      if (other >= 0) band_.block(frame, other) += equations.gram.block(a * nv_, b * nv_, nv_, nv_);
    }
  }
  corner_ += equations.corner;
  parameter_gradient_ += equations.corner_gradient;
}

void MotionSystem::add_prior(int index, double weight2, double deviation) {
  corner_(index, index) += weight2;
  parameter_gradient_[index] += weight2 * deviation;
}

bool MotionSystem::reduce(double mu, contact::ThreadPool& pool) {
  for (int i = 0; i < band_.num_blocks(); ++i)
    shift_.col(i) = band_.block(i, i).diagonal().cwiseMax(kLeastDiagonal);
  if (!band_.factor(mu, shift_, pool)) return false;
  own_step_ = -gradient_;
  band_.solve(own_step_, pool);
  schur_ = corner_;
  schur_.diagonal() += mu * corner_.diagonal();
  reduced_gradient_ = parameter_gradient_;
  for (int k = 0; k < parameters_; ++k) {
    const MatrixX& border = border_[static_cast<std::size_t>(k)];
    MatrixX& column = gain_[static_cast<std::size_t>(k)];
    column = border;
    band_.solve(column, pool);
    for (int j = 0; j < parameters_; ++j)
      schur_(j, k) -= dot(border_[static_cast<std::size_t>(j)], column);
    reduced_gradient_[k] += dot(border, own_step_);
  }
  schur_ = (0.5 * (schur_ + schur_.transpose())).eval();
  return true;
}

bool MotionSystem::factor(double mu, contact::ThreadPool& pool) {
  if (!reduce(mu, pool)) return false;
  if (parameters_ == 0) return true;
  const Eigen::LLT<MatrixX> factor(schur_);
  if (factor.info() != Eigen::Success) return false;
  inverse_schur_ = factor.solve(MatrixX::Identity(parameters_, parameters_));
  return true;
}

MatrixX MotionSystem::frames_step(const VectorX& parameters) const {
  MatrixX frames = own_step_;
  for (int k = 0; k < parameters_; ++k)
    frames -= parameters[k] * gain_[static_cast<std::size_t>(k)];
  return frames;
}

void MotionSystem::solve(MatrixX& frames, VectorX& parameters) const {
  parameters = VectorX::Zero(parameters_);
  if (parameters_ > 0) parameters = -inverse_schur_ * reduced_gradient_;
  frames = frames_step(parameters);
}

double MotionSystem::expected_decrease(double mu, const MatrixX& frames,
                                       const VectorX& parameters) const {
  const double damped = dot(shift_.cwiseProduct(frames), frames) +
                        corner_.diagonal().cwiseProduct(parameters).dot(parameters);
  return 0.5 * (mu * damped - dot(gradient_, frames) - parameter_gradient_.dot(parameters));
}

}  // namespace counterpoint::estimation
