// Vectors of four doubles, for functions marked COUNTERPOINT_WIDE. Without AVX the compiler splits
// each operation into two halves, with the same bits.
#pragma once

#include <cmath>
#include <cstring>
#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "counterpoint/contact/lanes/wide.h"

namespace counterpoint::contact {

/// Structures with members of type Four are declared alignas(kFourBytes), with these members first:
/// the version of a function for wide registers expects this alignment, the rest of the program
/// does not know it.
inline constexpr int kFourBytes = 32;
using Four = double __attribute__((vector_size(kFourBytes)));
using Two = double __attribute__((vector_size(16)));

/// Rounds `count` up to a multiple of four.
constexpr int in_fours(int count) { return (count + 3) & ~3; }

// Loads and stores copy bytes: addresses need no alignment.
COUNTERPOINT_INTO_EACH void load(const double* from, Four& to) {
  std::memcpy(&to, from, sizeof to);
}
COUNTERPOINT_INTO_EACH void load(const double* from, Two& to) { std::memcpy(&to, from, sizeof to); }
COUNTERPOINT_INTO_EACH void store(const Four& from, double* to) {
  std::memcpy(to, &from, sizeof from);
}
COUNTERPOINT_INTO_EACH void store(const Two& from, double* to) {
  std::memcpy(to, &from, sizeof from);
}
COUNTERPOINT_INTO_EACH void load(const double* from, double& to) { to = *from; }
COUNTERPOINT_INTO_EACH void store(const double& from, double* to) { *to = from; }

/// Column of both parts: six doubles are four and two, three are two and one.
template <class Top, class Bottom>
struct Parts {
  Top top;
  Bottom bottom;
  static constexpr int kTop = sizeof(Top) / sizeof(double);
};
using Six = Parts<Four, Two>;
using Three = Parts<Two, double>;
template <class Top, class Bottom>
COUNTERPOINT_INTO_EACH void load(const double* from, Parts<Top, Bottom>& to) {
  load(from, to.top);
  load(from + to.kTop, to.bottom);
}
template <class Top, class Bottom>
COUNTERPOINT_INTO_EACH void store(const Parts<Top, Bottom>& from, double* to) {
  store(from.top, to);
  store(from.bottom, to + from.kTop);
}

/// Computes the square root; of four doubles in halves, which take no longer than a whole, because
/// the wide instruction cannot be named in a function that is compiled twice.
COUNTERPOINT_INTO_EACH void square_root(double x, double& out) { out = std::sqrt(x); }
COUNTERPOINT_INTO_EACH void square_root(const Four& x, Four& out) {
  double values[4];
  store(x, values);
#if defined(__SSE2__)
  for (int i = 0; i < 4; i += 2) _mm_storeu_pd(values + i, _mm_sqrt_pd(_mm_loadu_pd(values + i)));
#else
  for (double& value : values) value = std::sqrt(value);
#endif
  load(values, out);
}

/// Computes out = A x for a 6 x 6 matrix, column-major without padding.
COUNTERPOINT_INTO_EACH void multiply_six(const double* a, const double* x, double* out) {
  Six column[6], sum;
  for (int j = 0; j < 6; ++j) load(a + 6 * j, column[j]);
  sum.top =
      (column[0].top * x[0] + column[1].top * x[1]) + (column[2].top * x[2] + column[3].top * x[3]);
  sum.bottom = (column[0].bottom * x[0] + column[1].bottom * x[1]) +
               (column[2].bottom * x[2] + column[3].bottom * x[3]);
  for (int j = 4; j < 6; ++j) {
    sum.top += column[j].top * x[j];
    sum.bottom += column[j].bottom * x[j];
  }
  store(sum, out);
}

/// Computes sum += a b.
template <class Lanes>
COUNTERPOINT_INTO_EACH void add_product(const Lanes& a, double b, Lanes& sum) {
  sum += a * b;
}
template <class Top, class Bottom>
COUNTERPOINT_INTO_EACH void add_product(const Parts<Top, Bottom>& a, double b,
                                        Parts<Top, Bottom>& sum) {
  sum.top += a.top * b;
  sum.bottom += a.bottom * b;
}

}  // namespace counterpoint::contact
