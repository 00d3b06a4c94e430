// The Jordan algebra of the second-order cone { x : x_0 >= |x_T| }: x = (x_0, x_T), n numbers.
//
// A spectral operator has the eigenvectors of a unit vector t: (1, t) and (1, -t) with eigenvalues
// `plus` and `minus`, and `across` on all that is orthogonal to both. Alizadeh and Goldfarb,
// "Second-order cone programming", 2003.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace counterpoint::contact {

struct Spectral {
  double plus = 0.0, minus = 0.0, across = 0.0;
};

inline double dot(const double* a, const double* b, int n) {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

/// |x_T|.
inline double radial_norm(const double* x, int n) { return std::sqrt(dot(x + 1, x + 1, n - 1)); }

/// lambda+ lambda-, without cancellation.
inline double determinant(const double* x, int n) {
  const double radial = radial_norm(x, n);
  return (x[0] - radial) * (x[0] + radial);
}

/// out = op x, with the eigenvectors of t (t[1] ... t[n-1]); out may not be x.
inline void apply(const Spectral& op, const double* t, const double* x, int n, double* out) {
  double radial = 0.0;
  for (int i = 1; i < n; ++i) radial += t[i] * x[i];
  const double mean = 0.5 * (op.plus + op.minus), half = 0.5 * (op.plus - op.minus);
  out[0] = mean * x[0] + half * radial;
  const double along = half * x[0] + (mean - op.across) * radial;
  for (int i = 1; i < n; ++i) out[i] = op.across * x[i] + along * t[i];
}

/// x o y; out is neither.
inline void jordan_product(const double* x, const double* y, int n, double* out) {
  out[0] = dot(x, y, n);
  for (int i = 1; i < n; ++i) out[i] = x[0] * y[i] + y[0] * x[i];
}

/// x with lambda o x = d; det: the determinant of lambda.
inline void jordan_divide(const double* lambda, double det, const double* d, int n, double* x) {
  x[0] = (lambda[0] * d[0] - dot(lambda + 1, d + 1, n - 1)) / det;
  for (int i = 1; i < n; ++i) x[i] = (d[i] - x[0] * lambda[i]) / lambda[0];
}

/// The longest step from x along d inside the cone.
inline double step_to_boundary(const double* x, const double* d, int n) {
  const double a = d[0] * d[0] - dot(d + 1, d + 1, n - 1);
  const double b = x[0] * d[0] - dot(x + 1, d + 1, n - 1);
  const double c = determinant(x, n);
  // Not negative but to round-off: the reverse Cauchy-Schwarz inequality of the cone.
  const double discriminant = std::max(0.0, b * b - a * c);
  const double denominator = std::sqrt(discriminant) - b;
  return denominator > 0.0 ? c / denominator : std::numeric_limits<double>::infinity();
}

}  // namespace counterpoint::contact
