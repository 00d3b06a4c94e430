// Contacts with three rows, the most common ones, evaluated four at a time. They use the functions
// of a single contact (coulomb.h, cone.h), so the bits are the same; the inverse relies on that.
#pragma once

#include <vector>

#include "counterpoint/contact/lanes/vector_lanes.h"
#include "counterpoint/contact/laws/cone.h"
#include "counterpoint/contact/laws/coulomb.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// Four contacts, one array per quantity. Where fewer are left, the others are copies of the first
/// one: they are computed and stored like it and are left out only of sums.
struct ConeFour {
  int row[4] = {};      ///< first row in the island
  int hessian[4] = {};  ///< start of G in the island's Hessians
  double live[4] = {};  ///< 1, or 0 for a copy
  double rho[4] = {}, slip[4] = {}, k[4] = {};
  double mu[2][4] = {};
  double inverse_mass[4] = {};
};

/// Contacts of an island with the same friction: regularized Coulomb or convex.
class ConeLanes {
 public:
  explicit ConeLanes(bool coulomb) : coulomb_(coulomb) {}
  void clear();
  void reserve(size_t count) { fours_.reserve((count + 3) / 4); }
  /// Returns whether the law belongs here.
  bool takes(const Law& law) const {
    return law.type == LawType::kFrictionCone && law.coulomb == coulomb_ && law.rows == 3 &&
           !leans(law);
  }
  void add(const Law& law, double inverse_mass, int row, int hessian);
  int count() const { return count_; }
  bool coulomb() const { return coulomb_; }
  const std::vector<ConeFour>& fours() const { return fours_; }

  /// Computes the impulses f at the velocities y, both by rows of the island.
  void impulses(const double* y, double* f) const;
  /// Computes the Hessians G at y.
  void hessians(const double* y, double* hessian) const;
  /// Returns the sum of the slopes (problem.h) at y along dy.
  Slope slope(const double* y, const double* dy) const;

 private:
  bool coulomb_;
  int count_ = 0;
  std::vector<ConeFour> fours_;
};

/// Contacts of an island with either kind of friction.
class FrictionLanes {
 public:
  void clear() {
    coulomb_.clear();
    convex_.clear();
  }
  /// Reserves memory for `count` contacts of each kind, since softening changes the kind.
  void reserve(size_t count) {
    coulomb_.reserve(count);
    convex_.reserve(count);
  }
  /// Returns false if the law is of neither kind.
  bool add(const Law& law, double inverse_mass, int row, int hessian);
  const ConeLanes& coulomb() const { return coulomb_; }
  const ConeLanes& convex() const { return convex_; }

  /// The same sums and arrays as in ConeLanes, over both kinds.
  void impulses(const double* y, double* f) const {
    coulomb_.impulses(y, f);
    convex_.impulses(y, f);
  }
  void hessians(const double* y, double* hessian) const {
    coulomb_.hessians(y, hessian);
    convex_.hessians(y, hessian);
  }
  void add_slope(const double* y, const double* dy, Slope& sum) const;

 private:
  ConeLanes coulomb_{true}, convex_{false};
};

/// Three rows of each of four contacts, gathered from the rows of an island.
struct ThreeRows {
  Four row[3];
};
COUNTERPOINT_INTO_EACH void gather(const double* from, const int* first, ThreeRows& to) {
  for (int r = 0; r < 3; ++r) {
    const double* at = from + r;
    to.row[r] = Four{at[first[0]], at[first[1]], at[first[2]], at[first[3]]};
  }
}
COUNTERPOINT_INTO_EACH void scatter(const Four& from, const int* first, double* to) {
  double values[4];
  store(from, values);
  for (int i = 0; i < 4; ++i) to[first[i]] = values[i];
}

/// Slopes in (normal, along t), and across t as a multiple of the identity.
struct SlopeFour {
  Four normal, radial, across, radial_normal, normal_radial{};
};
COUNTERPOINT_INTO_EACH void slopes_of(const CoulombAt<Four>& cone, SlopeFour& to) {
  to = {cone.n_slope, cone.p_slope, cone.b, -cone.p_by_n * cone.n_slope, Four{}};
}
COUNTERPOINT_INTO_EACH void slopes_of(const ConvexAt<Four>& cone, SlopeFour& to) {
  to = {cone.mean, cone.mean, cone.b, cone.difference, cone.difference};
}
/// Writes G = D H D to its place in `hessian`, where H has these slopes and t is the direction of
/// z_T.
COUNTERPOINT_INTO_EACH void scatter_hessian(const ConeFour& c, const SlopeFour& slope,
                                            const Four* t, double* hessian) {
  Four mu[2];
  for (int i = 0; i < 2; ++i) load(c.mu[i], mu[i]);
  scatter(slope.normal, c.hessian, hessian);
  const Four more = slope.radial - slope.across;
  for (int i = 0; i < 2; ++i) {
    scatter(mu[i] * (slope.normal_radial * t[i]), c.hessian, hessian + i + 1);
    scatter(mu[i] * (slope.radial_normal * t[i]), c.hessian, hessian + 3 * (i + 1));
    for (int j = 0; j < 2; ++j) {
      Four g = more * (t[i] * t[j]);
      if (i == j) g += slope.across;
      scatter((mu[i] * mu[j]) * g, c.hessian, hessian + 3 * (i + 1) + j + 1);
    }
  }
}

}  // namespace counterpoint::contact
