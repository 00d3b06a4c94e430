#include "counterpoint/engine/dynamics/euler_top.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace counterpoint {

JacobiFunctions jacobi_functions(double u, double m1) {
  // For m1 = 1 - m below round-off use the functions of m = 1.
  if (m1 < std::numeric_limits<double>::epsilon()) {
    const double sech = 1.0 / std::cosh(u);
    return {std::tanh(u), sech, sech};
  }
  // c converges quadratically: for any such m1 it is negligible well before the last level.
  constexpr int kLevels = 12;
  constexpr double kLast = 1e-8;  // the next c is about the square of this one
  double a = 1.0, b = std::sqrt(m1);
  double ratio[kLevels];
  int n = 0;
  double scale = 1.0;
  while (n < kLevels) {
    const double c = 0.5 * (a - b), mean = 0.5 * (a + b);
    b = std::sqrt(a * b);
    a = mean;
    scale *= 2.0;
    ratio[n++] = c / a;
    if (c <= kLast * a) break;
  }
  double phi = scale * a * u;
  while (n > 0) phi = 0.5 * (phi + std::asin(ratio[--n] * std::sin(phi)));
  const double sn = std::sin(phi), cn = std::cos(phi);
  return {sn, cn, std::sqrt(m1 + (1.0 - m1) * cn * cn)};
}

Vector3 EulerTop::advance(const Vector3& omega, double h) const {
  const auto& [I, axes] = principal_;
  // A sphere keeps its angular velocity exactly. The spin of a rod about its own axis is
  // irrelevant.
  if (I[0] == I[2] || !(I[0] > 0.0)) return omega;
  const Vector3 L = I.cwiseProduct(axes.transpose() * omega);
  // Returns L^2 - 2 E I_i. The angular momentum moves around the axis of the largest moment if the
  // value of the middle axis is positive, else around that of the smallest moment. L is a multiple
  // of dn along that axis (a), of sn along the middle axis, and of cn along the third (c).
  const auto excess = [&L, &I = I](int i) {
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) sum += L[k] * L[k] * (1.0 - I[i] / I[k]);
    return sum;
  };
  const double middle = excess(1);
  const int a = middle >= 0.0 ? 0 : 2, c = 2 - a;
  const double extreme = std::abs(excess(a));
  const double rate2 = std::abs(I[c] - I[1]) * extreme / (I[0] * I[1] * I[2]);
  if (!(rate2 > 0.0)) return omega;  // turns about a principal axis
  const double rate = std::sqrt(rate2);
  const double m1 =
      std::min(1.0, (I[2] - I[0]) * std::abs(middle) / (std::abs(I[c] - I[1]) * extreme));
  const auto [sn, cn, dn] = jacobi_functions(rate * h, m1);
  // 1 - m sn0^2 sn^2, written as a sum of positive terms.
  const double D = L[c] * L[c] * (I[2] - I[0]) / (I[c] * extreme) +
                   L[1] * L[1] * std::abs(I[1] - I[a]) / (I[1] * extreme) * cn * cn;
  // Coefficients of sn / rate, from Euler's equations at the start.
  const Vector3 dL = L.cross(L.cwiseQuotient(I)) / rate;
  Vector3 next;
  next[a] = (L[a] * cn + dL[a] * sn * dn) / D;
  next[1] = (L[1] * cn * dn + dL[1] * sn) / D;
  next[c] = (L[c] * dn + dL[c] * sn * cn) / D;
  return axes * next.cwiseQuotient(I);
}

}  // namespace counterpoint
