// Numbers with their derivatives by N parameters: a formula evaluated with them gives both.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace counterpoint::contact {

template <int N>
struct Dual {
  using Derivatives = Eigen::Matrix<double, N, 1>;
  double value = 0.0;
  Derivatives by = Derivatives::Zero();

  Dual() = default;
  Dual(double constant) : value(constant) {}  // NOLINT: implicit, since formulas have constants
  Dual(double x, const Derivatives& derivatives) : value(x), by(derivatives) {}

  friend Dual operator-(const Dual& x) { return {-x.value, -x.by}; }
  friend Dual operator+(const Dual& x, const Dual& y) { return {x.value + y.value, x.by + y.by}; }
  friend Dual operator-(const Dual& x, const Dual& y) { return {x.value - y.value, x.by - y.by}; }
  friend Dual operator*(const Dual& x, const Dual& y) {
    return {x.value * y.value, x.by * y.value + x.value * y.by};
  }
  friend Dual operator*(double x, const Dual& y) { return {x * y.value, x * y.by}; }
  friend Dual operator*(const Dual& x, double y) { return y * x; }
  friend Dual operator/(const Dual& x, const Dual& y) {
    const double ratio = x.value / y.value;
    return {ratio, (x.by - ratio * y.by) / y.value};
  }
  Dual& operator+=(const Dual& x) { return *this = *this + x; }
  Dual& operator-=(const Dual& x) { return *this = *this - x; }
  friend auto operator<=>(const Dual& x, const Dual& y) { return x.value <=> y.value; }

  /// At zero, where the root has no derivative, that of `out` is zero.
  friend void square_root(const Dual& x, Dual& out) {
    const double root = std::sqrt(x.value);
    out = {root, root > 0.0 ? Derivatives(x.by / (2.0 * root)) : Derivatives::Zero()};
  }
};

}  // namespace counterpoint::contact
