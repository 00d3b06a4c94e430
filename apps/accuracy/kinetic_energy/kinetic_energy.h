// The 2011 formulation (Todorov, "A convex, smooth and invertible contact model for trajectory
// optimization", ICRA 2011), in contact space, for cones of any dimension and the other laws too:
//
//   minimize over f   1/2 f'(A + R) f + f'(c + b) + k barrier(f in its sets)
//                     + sum_i q(v_N,i - v_min,i),         v = c + A f,  v_min = -gap / h
//
//   q(s) = -k_q log s  for s >= s0, continued quadratically below (value, slope, curvature match)
//
// R grows with the gap: that is its force at a distance. Its stationarity says that f is the law of
// contact/problem.h at
//   y = v + A grad q(v_N - v_min) + b,
// so that the inverse is closed form where A is known, on penetrating trajectories too. Differences
// from the spectral law: the velocity bound costs a second barrier, which couples contacts through
// A in the inverse, and amplifies what the inverse makes of the rounding of v by A q''.
#pragma once

#include <vector>

#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

struct KineticEnergyProblem {
  MatrixX A;  ///< rows x rows, symmetric positive semidefinite [1/kg]
  /// Rows in the order of A. Any type and dimension, but not `coulomb`: that has no cost to
  /// minimize. A bias (De Saxce's shift of the last velocity, say: `lagged`) is seen by the law,
  /// not by the velocity bound.
  std::vector<Law> laws;
  /// One a law, gap / h [m/s]: the contact may close no faster. Used for kUnilateral and
  /// kFrictionCone only; the others have no bound.
  std::vector<double> gap_speed;
  double velocity_smoothing = 1e-6;  ///< k_q [N m], positive
  double continuation_speed = 1e-7;  ///< s0 [m/s], positive: below it q is quadratic
};

/// Regularizer at a gap: r (1 + (gap / range)^2), gap > 0. `range` [m] is the reach of the force at
/// a distance.
double distant_regularizer(double regularizer, double gap, double range);

struct KineticEnergyResult {
  VectorX f;  ///< [N s]; to the bit what the inverse makes of v
  VectorX v;  ///< [m/s]; forward: c + A f but for the residual, which 1 / r would amplify in f
  VectorX c;  ///< [m/s]; inverse: v - A f
  Status status = Status::kConverged;
  int iterations = 0;
  /// |w - L'f| over (|w|^2 + sum_i |L_i'f_i|^2)^1/2 with A = L L', v = c + L w.
  double residual = 0.0;
};

/// Newton's method on the dual, kept on the path of falling smoothing and regularizer: a convex
/// problem in w and in p = -grad q, whose line search needs derivatives only. Dense: meant for
/// comparison, not for scenes. Errors are in the status: kNotFinite for NaN, kInvalidLaw for sizes
/// and laws that make no sense.
KineticEnergyResult solve_kinetic_energy(const KineticEnergyProblem& problem, const VectorX& c,
                                         const Settings& settings);

/// f and c from v: closed form.
KineticEnergyResult invert_kinetic_energy(const KineticEnergyProblem& problem, const VectorX& v);

}  // namespace counterpoint::contact
