// Newton's method of kinetic_energy_newton.h with the impulses as additional unknowns.
//
// The law f = f_rho(y) is also f = f_rho'(y + (R - R') f) for any larger rho': both say that y + R
// f and f are complementary up to smoothing. With rho' as large as the inverse mass the law bends
// over the whole range of the motion, and Newton does not creep along the edge of a cone of slope 1
// / rho. There is no cost function here: a step must reduce the residual, or the method gives up.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "accuracy/kinetic_energy/kinetic_energy_newton.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {
namespace {

constexpr int kMaxHalvings = 10;
constexpr double kSufficientDecrease = 1e-3;

// A law with its own regularizer and with the widened one.
struct WideLaw {
  Law law;
  Rows shift, weight;  // diagonals of R' - R and of R'

  WideLaw(const Law& narrow, double inverse_mass) : law(narrow) {
    const bool cone = law.type == LawType::kFrictionCone;
    const double rho = cone ? normal_regularizer(law) : law.regularizer;
    shift.setZero(law.rows);
    weight.setConstant(law.rows, rho);
    if (!cone && law.type != LawType::kUnilateral) return;  // others need no widening
    const double wide = std::max(rho, inverse_mass);
    law.regularizer *= wide / rho;
    for (int r = 0; r < law.rows; ++r) {
      const double mu = r == 0 ? 1.0 : law.friction[r - 1];
      shift[r] = mu > 0.0 ? (wide - rho) / (mu * mu) : 0.0;
      weight[r] = mu > 0.0 ? wide / (mu * mu) : 0.0;
    }
  }
  bool wide() const { return shift[0] > 0.0; }
};

}  // namespace

// Sum of the squared residuals of all equations at (x, f), each weighted as an energy.
double KineticEnergyNewton::mixed_error(const VectorX& x, const VectorX& f) {
  const VectorX p = x.tail(normal_.rows());
  const VectorX w = x.head(rank_) + normal_.transpose() * p, y = free_ + L_ * x.head(rank_);
  const VectorX speed = normal_ * w;
  double sum = (w - L_.transpose() * f).squaredNorm();
  int row = 0;
  for (size_t i = 0; i < laws_.size(); ++i) {
    const int n = laws_[i].rows;
    const WideLaw wide(laws_[i], inverse_mass_[i]);
    const Rows own = f.segment(row, n);
    const Rows error =
        impulse(wide.law, Rows(y.segment(row, n) - wide.shift.cwiseProduct(own))) - own;
    sum += error.cwiseAbs2().dot(wide.weight);
    row += n;
  }
  for (size_t j = 0; j < bounds_.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const double error = bounds_[j].free + speed[at] - bounds_[j].speed(p[at]);
    sum += error * error / inverse_mass_[bounds_[j].law];
  }
  return sum;
}

// Computes y, gradient and Hessian at x and f_. Returns the error.
double KineticEnergyNewton::evaluate_mixed() {
  w_ = x_.head(rank_) + normal_.transpose() * x_.tail(normal_.rows());
  y_ = free_ + L_ * x_.head(rank_);
  hessian_.topLeftCorner(rank_, rank_).setIdentity();
  correction_.resize(f_.size());
  curvature_.clear();
  int row = 0;
  for (size_t i = 0; i < laws_.size(); ++i) {
    const int n = laws_[i].rows;
    const WideLaw wide(laws_[i], inverse_mass_[i]);
    const Rows own = f_.segment(row, n);
    const Rows at = y_.segment(row, n) - wide.shift.cwiseProduct(own);
    Rows f(n);
    RowMatrix g(n, n);
    evaluate(wide.law, at.data(), f.data(), g.data());
    Rows correction = f - own;
    if (wide.wide()) {
      // f + df = f_wide - G (dy - shift df), solved for df.
      const MatrixX left = MatrixX::Identity(n, n) - g * wide.shift.asDiagonal();
      const Eigen::PartialPivLU<MatrixX> solver(left);
      correction = solver.solve(VectorX(correction));
      g = solver.solve(MatrixX(g));
      g = (0.5 * (g + g.transpose())).eval();
    }
    correction_.segment(row, n) = correction;
    const auto jacobian = L_.middleRows(row, n);
    hessian_.topLeftCorner(rank_, rank_) += jacobian.transpose() * (g * jacobian);
    curvature_.insert(curvature_.end(), g.data(), g.data() + n * n);
    row += n;
  }
  gradient_.head(rank_) = w_ - L_.transpose() * (f_ + correction_);
  add_bounds();
  return mixed_error(x_, f_);
}

bool KineticEnergyNewton::solve_mixed(double accuracy, int max_steps) {
  evaluate_here();
  for (int step = 0;; ++step) {
    const double error = evaluate_mixed();
    if (!compute_step()) return false;
    VectorX f_step = correction_;
    int row = 0;
    size_t at = 0;
    for (const Law& law : laws_) {
      const int n = law.rows;
      const Eigen::Map<const RowMatrix> g(curvature_.data() + at, n, n);
      f_step.segment(row, n) -= g * y_step_.segment(row, n);
      row += n;
      at += static_cast<size_t>(n) * n;
    }
    if (relative_step() <= accuracy && f_step.norm() <= accuracy * f_.norm()) return true;
    if (step == max_steps || iterations_ >= settings_.max_iterations) return false;
    ++iterations_;
    double alpha = std::min(1.0, longest_step());
    for (int halving = 0;; ++halving, alpha *= 0.5) {
      if (halving == kMaxHalvings) return false;
      if (mixed_error(x_ + alpha * step_, f_ + alpha * f_step) <=
          (1.0 - kSufficientDecrease * alpha) * error) {
        break;
      }
    }
    x_ += alpha * step_;
    f_ += alpha * f_step;
  }
}

}  // namespace counterpoint::contact
