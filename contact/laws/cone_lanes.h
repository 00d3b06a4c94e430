// Contacts with three rows, the most common ones, evaluated four at a time. They use the functions
// of a single contact (cones.h), so the bits are the same; the inverse relies on that.
#pragma once

#include <vector>

#include "counterpoint/contact/lanes/vector_lanes.h"
#include "counterpoint/contact/laws/cones.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// Four contacts. Where fewer are left, the others are copies of the first one: they are computed
/// and stored like it and are left out only of sums.
struct alignas(kFourBytes) ConeFour {
  static constexpr int kRows = 3;
  Four live{};  ///< 1, or 0 for a copy
  Four rho{}, rho_T{}, slip{}, k{}, inverse_mass{};
  Four scale[kRows] = {};  ///< D
  int row[4] = {};         ///< first row in the island
  int hessian[4] = {};     ///< start of G in the island's Hessians

  /// Reads three rows of each contact from the rows of an island.
  COUNTERPOINT_INTO_EACH void gather(const double* from, Four* to) const {
    for (int r = 0; r < kRows; ++r) {
      const double* at = from + r;
      to[r] = Four{at[row[0]], at[row[1]], at[row[2]], at[row[3]]};
    }
  }
  /// Same, multiplied by D.
  COUNTERPOINT_INTO_EACH void gather_scaled(const double* from, Four* to) const {
    gather(from, to);
    for (int r = 1; r < kRows; ++r) to[r] = scale[r] * to[r];
  }
  /// Writes row r of each contact.
  COUNTERPOINT_INTO_EACH void scatter(const Four& from, int r, double* to) const {
    for (int i = 0; i < 4; ++i) to[row[i] + r] = from[i];
  }
  /// Writes G = D A D, where e is the direction of A.
  COUNTERPOINT_INTO_EACH void scatter_hessian(const ConeMap<Four>& A, const Four* e,
                                              double* to) const {
    for (int i = 0; i < kRows; ++i) {
      for (int j = 0; j < kRows; ++j) {
        Four entry;
        A.entry(i, j, e, entry);
        entry = (scale[i] * scale[j]) * entry;
        for (int l = 0; l < 4; ++l) to[hessian[l] + kRows * i + j] = entry[l];
      }
    }
  }
};

/// Contacts of an island with three rows and an upright cone.
class FrictionLanes {
 public:
  void clear();
  /// Reserves memory for `count` contacts of each kind, since softening changes the kind.
  void reserve(size_t count);
  /// Returns false if the law does not belong here.
  bool add(const Law& law, double inverse_mass, int row, int hessian);
  const std::vector<ConeFour>& coulomb() const { return coulomb_.fours; }
  const std::vector<ConeFour>& convex() const { return convex_.fours; }

  /// Computes the impulses f at the velocities y, both by rows of the island.
  void impulses(const double* y, double* f) const;
  /// Computes the Hessians G at y.
  void hessians(const double* y, double* hessian) const;
  /// Adds the slopes (problem.h) at y along dy.
  void add_slope(const double* y, const double* dy, Slope& sum) const;

 private:
  struct Kind {
    int count = 0;
    std::vector<ConeFour> fours;
  };
  Kind coulomb_, convex_;
};

/// Returns the sum over the lanes.
COUNTERPOINT_INTO_EACH double sum_lanes(const Four& x) { return (x[0] + x[1]) + (x[2] + x[3]); }

}  // namespace counterpoint::contact
