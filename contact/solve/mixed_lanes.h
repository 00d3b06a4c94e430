// Contacts of three rows in the mixed method (mixed_system.h), evaluated four at a time.
#pragma once

#include <vector>

#include "counterpoint/contact/laws/cone_lanes.h"

namespace counterpoint::contact {

/// Four contacts, one array per quantity.
struct MixedFour {
  double sigma[4], sigma_T[4];
  double error[3][4];  ///< F_sigma(x) - phi
  double t[2][4];      ///< unit vector along the friction part of x
  /// A = -F' and B = inv(1 - (sigma - rho) A) in the directions (normal, along t), and across t as
  /// a multiple of the identity. normal_radial is zero for exact friction.
  struct Operator {
    double normal[4], radial[4], across[4], radial_normal[4], normal_radial[4];
  };
  Operator A, B;
};

/// Contacts of an island with the same friction.
class MixedLanes {
 public:
  void reserve(int num_constraints);
  /// Takes the contacts with their present laws; sigma_share as in MixedSystem::begin.
  void begin(const ConeLanes& lanes, double sigma_share);
  int count() const { return lanes_ != nullptr ? lanes_->count() : 0; }

  /// Computes phi = F_sigma(D y), by rows; extra_smoothing: smoothing added to every law [J].
  void impulses(const double* y, double extra_smoothing, double* phi);
  /// Computes the errors of phi at y, and A; returns the sum of sigma |error|^2 [J].
  double evaluate(const double* y, const double* phi, double extra_smoothing);
  /// Computes G = D B A D, and B.
  void hessians(double* hessian);
  /// Computes rhs = D B error, by rows.
  void right_side(double* rhs);
  /// Computes dphi = B (error - A D dy), by rows.
  void step(const double* dy, double* dphi);

 private:
  const ConeLanes* lanes_ = nullptr;
  std::vector<MixedFour> fours_;
};

}  // namespace counterpoint::contact
