// Sine and cosine of one angle together, to the same bits on every machine and in vector registers:
// the arithmetic has no branches, so a loop over angles can be vectorized.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

namespace counterpoint {

/// Largest angle [rad] for this arithmetic; larger and non-finite ones use std::sin and std::cos.
inline constexpr double kMaxReducedAngle = 524288.0;

/// Computes sine and cosine of |x| <= kMaxReducedAngle to 1.1 units in the last place. The angle is
/// reduced by a multiple of pi / 2 in three pieces of 33 bits, whose products with the multiple are
/// exact (Cody, Waite 1980); then follow the minimax polynomials of fdlibm (Sun 1993).
__attribute__((always_inline)) inline void sin_cos_reduced(double x, double& sine, double& cosine) {
  constexpr double kTwoOverPi = 6.36619772367581382433e-01;
  constexpr double kHalfPi1 = 1.57079632673412561417e+00, kHalfPi2 = 6.07710050630396597660e-11,
                   kHalfPi3 = 2.02226624879595063154e-21;
  constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: the sum's last bits are the integer
  const double shifted = x * kTwoOverPi + kRound;
  const double n = shifted - kRound;
  std::int64_t quadrant = 0;
  std::memcpy(&quadrant, &shifted, sizeof quadrant);
  // The reduced angle is y + tail.
  const double first = x - n * kHalfPi1, piece = n * kHalfPi2, a = first - piece;
  const double b = n * kHalfPi3 - ((first - a) - piece);
  const double y = a - b, tail = (a - y) - b;
  const double z = y * y, v = z * y, w = z * z;
  const double s_poly = (8.33333333332248946124e-03 + z * -1.98412698298579493134e-04) +
                        w * (2.75573137070700676789e-06 +
                             z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10));
  const double s = y - ((z * (0.5 * tail - v * s_poly) - tail) - v * -1.66666666666666324348e-01);
  const double c_poly = z * (4.16666666666666019037e-02 +
                             z * (-1.38888888888741095749e-03 + z * 2.48015872894767294178e-05)) +
                        w * w *
                            (-2.75573143513906633035e-07 +
                             z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11));
  const double half = 0.5 * z, rest = 1.0 - half;
  const double c = rest + (((1.0 - rest) - half) + (z * c_poly - y * tail));
  const bool swapped = (quadrant & 1) != 0;
  const double sine_size = swapped ? c : s, cosine_size = swapped ? s : c;
  sine = (quadrant & 2) != 0 ? -sine_size : sine_size;
  cosine = ((quadrant + 1) & 2) != 0 ? -cosine_size : cosine_size;
}

/// Computes sine and cosine of x [rad].
inline void sin_cos(double x, double& sine, double& cosine) {
  if (std::abs(x) <= kMaxReducedAngle) {
    sin_cos_reduced(x, sine, cosine);
  } else {
    sine = std::sin(x);
    cosine = std::cos(x);
  }
}

}  // namespace counterpoint
