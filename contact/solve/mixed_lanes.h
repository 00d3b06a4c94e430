// What the mixed method computes of contacts of three rows (mixed_system.h), four at a time.
#pragma once

#include <vector>

#include "counterpoint/contact/laws/cone_lanes.h"

namespace counterpoint::contact {

/// Four contacts, number by number.
struct MixedFour {
  double sigma[4], sigma_T[4];
  double error[3][4];  ///< F_sigma(x) - phi
  double t[2][4];      ///< unit, friction part of x
  /// A = -F' and B = inv(1 - (sigma - rho) A), in (normal, along t), a multiple of one across t.
  /// normal_radial is zero where friction is exact.
  struct Operator {
    double normal[4], radial[4], across[4], radial_normal[4], normal_radial[4];
  };
  Operator A, B;
};

/// Of an island's contacts of one kind.
class MixedLanes {
 public:
  void reserve(int num_constraints);
  /// The contacts as they are now; sigma_share as in MixedSystem::begin.
  void begin(const ConeLanes& lanes, double sigma_share);
  int count() const { return lanes_ != nullptr ? lanes_->count() : 0; }

  /// F(D y), by rows.
  void impulses(const double* y, double center, double* phi);
  /// Errors of phi at y, and A; returns the sum of sigma |error|^2.
  double evaluate(const double* y, const double* phi, double center);
  /// G = D B A D, and B.
  void hessians(double* hessian);
  /// D B error, by rows.
  void right_side(double* rhs);
  /// dphi = B (error - A D dy), by rows.
  void step(const double* dy, double* dphi);

 private:
  const ConeLanes* lanes_ = nullptr;
  std::vector<MixedFour> fours_;
};

}  // namespace counterpoint::contact
