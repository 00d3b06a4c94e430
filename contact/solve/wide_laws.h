// The laws of an island, widened, with their derivatives (mixed_system.h).
#pragma once

#include <vector>

#include "counterpoint/contact/laws/cone_lanes.h"
#include "counterpoint/contact/laws/cones.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solve/island_system.h"

namespace counterpoint::contact {

/// Linear algebra of one widened law (Real: double) or of four (Four).
template <class Real_, int kMost>
struct Widened {
  using Real = Real_;
  static constexpr int kMostRows = kMost;
  /// Regularizers of the first row and of friction, before and after widening [1/kg].
  Real rho{}, rho_T{}, sigma{}, sigma_T{};
  Real scale[kMost] = {};  ///< D
  Real e[kMost] = {};      ///< unit vector along the friction part of x; e[0] unused
  Real error[kMost] = {};  ///< F_sigma(x) - phi
  ConeMap<Real> A, B;      ///< A = -F_sigma'(x), B = inv(1 - (sigma - rho) A)

  /// Computes B from A by block elimination.
  COUNTERPOINT_INTO_EACH void invert() {
    const Real d = sigma - rho, d_T = sigma_T - rho_T;
    const Real normal = 1.0 / (1.0 - d * A.normal);
    const Real lower = d * A.radial_normal, upper = d_T * A.normal_radial;
    B.radial = 1.0 / ((1.0 - d_T * A.radial) - (lower * normal) * upper);
    const Real both = normal * B.radial;
    B.normal = normal + normal * (upper * (lower * both));
    B.across = 1.0 / (1.0 - d_T * A.across);
    B.radial_normal = lower * both;
    B.normal_radial = upper * both;
  }
  /// Computes B A.
  COUNTERPOINT_INTO_EACH void product(ConeMap<Real>& out) const {
    out.normal = B.normal * A.normal + B.normal_radial * A.radial_normal;
    out.radial = B.radial * A.radial + B.radial_normal * A.normal_radial;
    out.across = B.across * A.across;
    out.radial_normal = B.radial_normal * A.normal + B.radial * A.radial_normal;
    out.normal_radial = B.normal * A.normal_radial + B.normal_radial * A.radial;
  }
};

/// One law of any type, and its place among the rows of the island.
struct WideLaw : Widened<double, kMaxRows> {
  /// sigma_of_normal: sigma of the normal row [1/kg]; that of friction follows from it.
  WideLaw(const IslandSystem::Constraint& c, double sigma_of_normal);
  /// Sets other sigmas [1/kg], not below rho and rho_T.
  void widen(double normal, double friction);

  /// Replaces x by F_sigma(x) at a smoothing larger by `extra_smoothing` [J]; A and e are those at
  /// x.
  void evaluate(double extra_smoothing, double* x);
  /// Same, without A and e: sweeps visit contacts often and need no slopes, which cost four
  /// divisions.
  void impulse(double extra_smoothing, double* x) const;
  double wide(int r) const { return r > 0 ? sigma_T : sigma; }
  /// Returns what widening added to the regularizer of a row [1/kg].
  double widening(int r) const { return r > 0 ? sigma_T - rho_T : sigma - rho; }
  /// Adds sigma |error|^2 [J].
  void add_square(double& sum) const {
    for (int r = 0; r < rows; ++r) sum += wide(r) * error[r] * error[r];
  }
  /// Computes the impulse f [N s] of scaled impulses phi, a linear map; both are `rows` long and
  /// may be the same array.
  void unscale(const double* phi, double* f) const {
    for (int r = 0; r < rows; ++r) f[r] = scale[r] * phi[r];
    lean_impulse(*law, f);
  }
  void gather(const double* from, double* to) const { std::copy_n(from + row, rows, to); }
  void scatter(double value, int r, double* to) const { to[row + r] = value; }
  /// Writes f of scaled impulses phi by rows.
  void scatter_impulse(const double* phi, double* to) const { unscale(phi, to + row); }
  void scatter_hessian(const ConeMap<double>& G, double* to) const {
    write_hessian(*law, G, e, to + hessian);
  }

  const Law* law;
  int row, rows, hessian;

 private:
  void find(double extra_smoothing, double* x, double* direction, ConeMap<double>& slopes) const;
};

/// Four contacts of three rows.
template <template <class> class Cone>
struct alignas(kFourBytes) WideFour : Widened<Four, ConeFour::kRows> {
  static constexpr int rows = ConeFour::kRows;
  const ConeFour* cones;

  WideFour(const ConeFour& c, double sigma_share);
  COUNTERPOINT_INTO_EACH void add_square(Four& sum) const {
    sum += cones->live *
           (sigma * (error[0] * error[0]) + sigma_T * (error[1] * error[1] + error[2] * error[2]));
  }
  COUNTERPOINT_INTO_EACH void evaluate(double extra_smoothing, Four* x) {
    const ConeLaw<Four> law{sigma, sigma_T, cones->slip, cones->k + extra_smoothing};
    evaluate_cone<Cone>(law, rows, x, e, A);
  }
  COUNTERPOINT_INTO_EACH void gather(const double* from, Four* to) const {
    cones->gather(from, to);
  }
  COUNTERPOINT_INTO_EACH void scatter(const Four& value, int r, double* to) const {
    cones->scatter(value, r, to);
  }
  COUNTERPOINT_INTO_EACH void scatter_impulse(const Four* phi, double* to) const {
    for (int r = 0; r < rows; ++r) scatter(scale[r] * phi[r], r, to);
  }
  COUNTERPOINT_INTO_EACH void scatter_hessian(const ConeMap<Four>& G, double* to) const {
    cones->scatter_hessian(G, e, to);
  }
};

/// All laws of an island. Arrays are by rows of the island.
class WideLaws {
 public:
  void reserve(const IslandSystem& system);
  /// Takes the laws as they are; sigma_share as in MixedSystem::begin.
  void begin(const IslandSystem& system, double sigma_share);

  /// Computes phi = F_sigma(D y) with `extra_smoothing` [J] added to the smoothing of every law.
  void impulses(const double* y, double extra_smoothing, double* phi);
  /// Computes the errors of phi at y, and A; returns the sum of sigma |error|^2 [J].
  double evaluate(const double* y, const double* phi, double extra_smoothing);
  /// Computes G = D B A D, and B.
  void hessians(double* hessian);
  /// Computes rhs = D B error.
  void right_side(double* rhs) const;
  /// Computes dphi = B (error - A D dy).
  void step(const double* dy, double* dphi) const;
  /// Laws that are not evaluated four at a time.
  const std::vector<WideLaw>& single() const { return single_; }

 private:
  std::vector<WideFour<CoulombCone>> coulomb_;
  std::vector<WideFour<ConvexCone>> convex_;
  std::vector<WideLaw> single_;
};

}  // namespace counterpoint::contact
