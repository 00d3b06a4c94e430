// Bounds on the effect of round-off on the inverse. A velocity is known to one unit in the last
// place, u = 1.1e-16. The law amplifies this by its slope, 1 / r at a closing contact: relative to
// an impulse of size v / alpha that is u alpha / r = u / eps, 1e-8 at eps = 1e-8. No algorithm can
// return more from v as doubles; the theorems of forward_inverse_test.cc hold up to these bounds.
#pragma once

#include "contact/random_problem.h"
#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact::testing {

inline constexpr double kUnit = 0.5 * std::numeric_limits<double>::epsilon();

/// Bound on |df| of each row for a velocity error dy: |G| dy plus the round-off of the law.
inline Rows law_rounding(const Law& law, const Rows& y, const Rows& dy) {
  const Evaluation at = evaluate(law, y);
  constexpr double kOperations = 16.0;  // in the law, from y to f
  return at.hessian.cwiseAbs() * (dy + kOperations * kUnit * y.cwiseAbs()) +
         kOperations * kUnit * at.impulse.cwiseAbs();
}

/// Bound on the error of J'f(J w + b) per velocity, from the round-off of w and of the sums in y
/// and J'f.
inline VectorX pushed_rounding(const Problem& problem, const VectorX& w) {
  const MatrixX jacobian = dense_jacobian(problem);
  const MatrixX size = jacobian.cwiseAbs();
  const VectorX terms = size * w.cwiseAbs();
  VectorX y, f, df(problem.num_rows());
  compute_constraint_velocity(problem, w, y);
  compute_impulse(problem, w, f);
  const double additions = static_cast<double>(w.size()) + 2.0;
  for (int c = 0; c < problem.num_constraints(); ++c) {
    const Law& law = problem.law(c);
    const int row = problem.first_row(c), n = law.rows;
    Rows dy(n);
    for (int r = 0; r < n; ++r)
      dy[r] = kUnit * additions * (terms[row + r] + std::abs(law.bias[r]));
    df.segment(row, n) = law_rounding(law, y.segment(row, n), dy);
  }
  return size.transpose() * (df + kUnit * additions * f.cwiseAbs());
}

/// Largest |M(w - w*) - J'f| that the solver accepts at the round-off floor, in the norm of
/// inv(diag M) [sqrt(J)]: four times the round-off bound (README.md, When a solve ends).
inline double motion_rounding(const Problem& problem, const VectorX& w) {
  const VectorX free = problem.free_velocity();
  const MatrixX mass = dense_mass(problem);
  const double operations = static_cast<double>(w.size()) + 2.0;
  const VectorX rounding = pushed_rounding(problem, w) +
                           kUnit * operations * mass.cwiseAbs() * (w.cwiseAbs() + free.cwiseAbs());
  return 4.0 * std::sqrt(rounding.cwiseAbs2().cwiseQuotient(mass.diagonal()).sum());
}

struct Cost {
  double value = 0.0;     ///< 1/2 |w - w*|_M^2 + sum of the potentials [J]
  double rounding = 0.0;  ///< bound on the round-off of `value` [J]
};

/// Evaluates the cost and bounds its round-off. That of w - w* and y enters through the
/// derivatives, momentum and impulse; that of the potentials through their terms k log g and g (r g
/// / 2 + lambda), which cancel when the cost is small.
inline Cost cost_of(const Problem& problem, const VectorX& w) {
  const VectorX free = problem.free_velocity(), difference = w - free;
  const MatrixX mass = dense_mass(problem);
  const VectorX momentum = mass * difference;
  const double operations = static_cast<double>(w.size()) + 16.0;
  Cost out;
  out.value = 0.5 * difference.dot(momentum);
  out.rounding = (mass.cwiseAbs() * difference.cwiseAbs())
                     .dot(w.cwiseAbs() + free.cwiseAbs() + difference.cwiseAbs());
  VectorX y, f;
  compute_constraint_velocity(problem, w, y);
  compute_impulse(problem, w, f);
  const VectorX terms = dense_jacobian(problem).cwiseAbs() * w.cwiseAbs();
  for (int c = 0; c < problem.num_constraints(); ++c) {
    const Law& law = problem.law(c);
    const int row = problem.first_row(c);
    out.value += potential(law, y.data() + row);
    double reach = 0.0;  // bound on the eigenvalues' magnitude [m/s]
    for (int r = 0; r < law.rows; ++r) {
      const double mu = r == 0 || law.type != LawType::kFrictionCone ? 1.0 : law.friction[r - 1];
      out.rounding += std::abs(f[row + r]) * (terms[row + r] + std::abs(law.bias[r]));
      reach += mu * std::abs(y[row + r]);
    }
    const bool dry = law.type == LawType::kDryFriction;
    const double rho = normal_regularizer(law);
    // Largest and smallest g for |lambda| <= reach.
    reach += dry ? rho * law.bound : 0.0;
    const double s = std::sqrt(reach * reach + 4.0 * rho * law.smoothing);
    const double largest = (s + reach) / (2.0 * rho);
    if (law.smoothing > 0.0) {
      const double smallest = law.smoothing / (rho * largest);
      out.rounding += law.smoothing * (std::abs(std::log(largest)) + std::abs(std::log(smallest)));
    }
    // Dry friction is a difference of two laws, each as large as this where y < 0.
    const double g = dry && y[row] < 0.0 ? largest : f.segment(row, law.rows).norm();
    out.rounding += 2.0 * g * reach;
  }
  out.rounding *= operations * kUnit;
  return out;
}

}  // namespace counterpoint::contact::testing
