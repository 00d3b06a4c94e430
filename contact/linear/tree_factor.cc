#include "counterpoint/contact/linear/tree_factor.h"

#include <cstddef>

#include "counterpoint/contact/lanes/vector_lanes.h"

namespace counterpoint::contact {
namespace {

// Returns whether all lanes are zero. The right side is zero for velocities beyond those of a
// Jacobian.
COUNTERPOINT_INTO_EACH bool is_zero(double x) { return x == 0.0; }
COUNTERPOINT_INTO_EACH bool is_zero(const Four& x) {
  return x[0] == 0.0 && x[1] == 0.0 && x[2] == 0.0 && x[3] == 0.0;
}

template <class Lanes>
COUNTERPOINT_INTO_EACH void solve(const int* parent, int n, const double* factors, double* x) {
  constexpr std::ptrdiff_t kWidth = sizeof(Lanes) / sizeof(double);
  Lanes own, other;
  for (int k = n - 1; k >= 0; --k) {
    const double* row = factors + static_cast<std::ptrdiff_t>(k) * n;
    load(x + kWidth * k, own);
    if (is_zero(own)) continue;
    for (int i = parent[k]; i >= 0; i = parent[i]) {
      load(x + kWidth * i, other);
      other -= own * row[i];
      store(other, x + kWidth * i);
    }
    store(own * row[k], x + kWidth * k);
  }
  for (int k = 0; k < n; ++k) {
    const double* row = factors + static_cast<std::ptrdiff_t>(k) * n;
    load(x + kWidth * k, own);
    for (int i = parent[k]; i >= 0; i = parent[i]) {
      load(x + kWidth * i, other);
      own -= other * row[i];
    }
    store(own, x + kWidth * k);
  }
}

}  // namespace

bool factor_tree(const int* parent, int n, double* m) {
  for (int k = n - 1; k >= 0; --k) {
    double* row = m + static_cast<std::ptrdiff_t>(k) * n;
    if (!(row[k] > 0.0)) return false;
    const double inverse = 1.0 / row[k];
    for (int i = parent[k]; i >= 0; i = parent[i]) {
      const double share = row[i] * inverse;
      double* other = m + static_cast<std::ptrdiff_t>(i) * n;
      for (int j = i; j >= 0; j = parent[j]) other[j] -= share * row[j];
      row[i] = share;
    }
    row[k] = inverse;
  }
  return true;
}

void solve_tree(const int* parent, int n, const double* factors, double* x) {
  solve<double>(parent, n, factors, x);
}

COUNTERPOINT_WIDE void solve_tree_four(const int* parent, int n, const double* factors, double* x) {
  solve<Four>(parent, n, factors, x);
}

}  // namespace counterpoint::contact
