// The 2011 formulation (Todorov, "A convex, smooth and invertible contact model for trajectory
// optimization", ICRA 2011), in contact space:
//
//   minimize over f   1/2 f'(A + R) f + f'c + k barrier(f in friction cones) + sum_i q(v_N,i -
//   v_min,i), v = c + A f,  v_min = -gap / h,  R growing with the gap: the force at a distance
//
//   q(s) = -k log s  for s >= s0, continued quadratically below (value, slope, curvature match at
//   s0)
//
// Its stationarity R f + (v + A grad q) + k grad barrier = 0 reads: f is the spectral law (law.h)
// at
//   y = v + A grad q(v_N - v_min),
// so that the inverse is closed form where A is known, on penetrating trajectories too. Differences
// from the spectral law: the velocity bound costs a second barrier, which couples contacts through
// A in the inverse.
#pragma once

#include <vector>

#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

struct KineticEnergyProblem {
  MatrixX A;               ///< 3n x 3n, symmetric positive semidefinite [1/kg]; rows normal, t1, t2
  std::vector<double> mu;  ///< n, positive
  std::vector<double> gap_speed;    ///< n, gap / h [m/s]: the contact may close no faster
  std::vector<double> regularizer;  ///< n, r [1/kg] of the friction rows; the normal row has mu^2 r
  double smoothing = 1e-6;          ///< k of the friction cones [N m]
  double velocity_smoothing = 1e-6;  ///< k of q [N m]
  double continuation_speed = 1e-7;  ///< s0 [m/s]: below it q is quadratic

  int num_contacts() const { return static_cast<int>(mu.size()); }
};

/// Regularizer at a gap: r (1 + (gap / range)^2), gap > 0. `range` [m] is the reach of the force at
/// a distance.
double distant_regularizer(double regularizer, double gap, double range);

struct KineticEnergyResult {
  VectorX f;  ///< 3n [N s]
  VectorX v;  ///< 3n, forward: c + A f [m/s]
  VectorX c;  ///< 3n, inverse: v - A f [m/s]
  Status status = Status::kConverged;
  int iterations = 0;
  double residual = 0.0;  ///< |f - law(y(f))| over |f|
};

/// Newton on f with falling k. Dense: meant for comparison, not for scenes.
KineticEnergyResult solve_kinetic_energy(const KineticEnergyProblem& problem, const VectorX& c,
                                         const Settings& settings);

/// f and c from v: closed form.
KineticEnergyResult invert_kinetic_energy(const KineticEnergyProblem& problem, const VectorX& v);

}  // namespace counterpoint::contact
