// Contacts with friction of three rows, the common law, four at a time. The same functions as of
// one contact (coulomb.h, cone.h), so that the bits are the same, which the inverse relies on.
#pragma once

#include <vector>

#include "counterpoint/contact/laws/cone.h"
#include "counterpoint/contact/laws/coulomb.h"
#include "counterpoint/contact/linear/vector_lanes.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

/// Four contacts, number by number. Where fewer are left the others are copies of the first one:
/// they may be computed and stored like it, and only do not count in sums.
struct ConeFour {
  int row[4] = {};      ///< first local row
  int hessian[4] = {};  ///< start of G
  double live[4] = {};  ///< 1, or 0 for a copy
  double rho[4] = {}, slip[4] = {}, k[4] = {};
  double mu[2][4] = {};
  double inverse_mass[4] = {};
};

/// An island's contacts of one kind: with exact Coulomb friction, or with convex friction.
class ConeLanes {
 public:
  explicit ConeLanes(bool coulomb) : coulomb_(coulomb) {}
  void clear();
  void reserve(size_t count) { fours_.reserve((count + 3) / 4); }
  /// Does this law belong here?
  bool takes(const Law& law) const {
    return law.type == LawType::kFrictionCone && law.coulomb == coulomb_ && law.rows == 3 &&
           !leans(law);
  }
  void add(const Law& law, double inverse_mass, int row, int hessian);
  int count() const { return count_; }
  bool coulomb() const { return coulomb_; }
  const std::vector<ConeFour>& fours() const { return fours_; }

  /// Impulses f at the velocities y, both by rows of the island.
  void impulses(const double* y, double* f) const;
  /// G at y.
  void hessians(const double* y, double* hessian) const;
  /// Sum of the slopes (problem.h) at y along dy.
  Slope slope(const double* y, const double* dy) const;

 private:
  bool coulomb_;
  int count_ = 0;
  std::vector<ConeFour> fours_;
};

/// An island's contacts of both kinds.
class FrictionLanes {
 public:
  void clear() {
    coulomb_.clear();
    convex_.clear();
  }
  /// Room for so many contacts of either kind: softer laws change from one to the other.
  void reserve(size_t count) {
    coulomb_.reserve(count);
    convex_.reserve(count);
  }
  /// False if the law is of neither kind.
  bool add(const Law& law, double inverse_mass, int row, int hessian);
  const ConeLanes& coulomb() const { return coulomb_; }
  const ConeLanes& convex() const { return convex_; }

  /// As of ConeLanes.
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

/// Of three rows each, scattered among the rows of an island.
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

/// Slopes in (normal, along t), and the multiple of one across t.
struct SlopeFour {
  Four normal, radial, across, radial_normal, normal_radial{};
};
COUNTERPOINT_INTO_EACH void slopes_of(const CoulombAt<Four>& cone, SlopeFour& to) {
  to = {cone.n_slope, cone.p_slope, cone.b, -cone.p_by_n * cone.n_slope, Four{}};
}
COUNTERPOINT_INTO_EACH void slopes_of(const ConvexAt<Four>& cone, SlopeFour& to) {
  to = {cone.mean, cone.mean, cone.b, cone.difference, cone.difference};
}
/// G = D H D at its place in `hessian`, where H has these slopes.
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
