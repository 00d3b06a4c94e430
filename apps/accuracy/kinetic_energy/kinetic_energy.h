// The 2011 formulation (Todorov, "A convex, smooth and invertible contact model for trajectory
// optimization", ICRA 2011) in contact space, for cones of any dimension and all other laws:
//
//   minimize over f   1/2 f'(A + R) f + f'(c + b) + k barrier(f in its sets)
//                     + sum_i q(v_N,i - v_min,i),         v = c + A f,  v_min = -gap / h
//
//   q(s) = -k_q log s  for s >= s0, continued quadratically below (value, slope, curvature match)
//
// R grows with the gap, which gives forces at a distance. Stationarity says that f is the law of
// contact/problem.h at
//   y = v + A grad q(v_N - v_min) + b,
// so the inverse has a closed form where A is known, on penetrating trajectories too. Compared with
// the spectral law, the velocity bound costs a second barrier, couples the contacts through A in
// the inverse, and amplifies the round-off of v by A q'' in the inverse.
#pragma once

#include <vector>

#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

struct KineticEnergyProblem {
  MatrixX A;  ///< rows x rows, symmetric positive semidefinite [1/kg]
  /// Laws in the order of the rows of A, of any type and dimension except `coulomb`, which
  /// minimizes no cost. The bias (for example De Saxce's shift at the last velocity, `lagged`)
  /// enters the law, not the velocity bound.
  std::vector<Law> laws;
  /// gap / h of each law [m/s]: the largest closing speed. Used for kUnilateral and kFrictionCone
  /// only; the others have no bound.
  std::vector<double> gap_speed;
  double velocity_smoothing = 1e-6;  ///< k_q [N m], positive
  double continuation_speed = 1e-7;  ///< s0 [m/s], positive: below it q is quadratic
};

/// Regularizer at a positive gap: r (1 + (gap / range)^2). `range` [m] is the reach of the force at
/// a distance.
double distant_regularizer(double regularizer, double gap, double range);

struct KineticEnergyResult {
  VectorX f;  ///< [N s]; bitwise equal to the impulse that the inverse computes from v
  VectorX v;  ///< [m/s]; forward: c + A f up to the residual, which 1 / r would amplify in f
  VectorX c;  ///< [m/s]; inverse: v - A f
  Status status = Status::kConverged;
  int iterations = 0;
  /// |w - L'f| over (|w|^2 + sum_i |L_i'f_i|^2)^1/2 with A = L L', v = c + L w.
  double residual = 0.0;
};

/// Newton's method on the dual, along a path of decreasing smoothing and regularizer: a convex
/// problem in w and p = -grad q, whose line search needs derivatives only. Dense; meant for
/// comparison, not for scenes. Errors are returned in the status: kNotFinite for NaN, kInvalidLaw
/// for invalid sizes or laws.
KineticEnergyResult solve_kinetic_energy(const KineticEnergyProblem& problem, const VectorX& c,
                                         const Settings& settings);

/// Computes f and c from v, in closed form.
KineticEnergyResult invert_kinetic_energy(const KineticEnergyProblem& problem, const VectorX& v);

}  // namespace counterpoint::contact
