// The 2011 formulation forward (kinetic_energy.h). With A = L L' and w = L'f the problem reads:
// minimize 1/2 |w|^2 + sum q(c_N + L_N w - v_min) + (R and barriers of f). Its dual, over p = -grad
// q > 0 and u = w - L_N'p, is convex and has no constraint but the domain of a logarithm:
//
//   minimize  1/2 |w|^2 + sum_i l_i(y_i) + sum_j (p_j (c_N,j - v_min,j) + q*(-p_j)),
//   w = u + L_N'p,  y = c + b + L u
//
// with the potentials l of contact/problem.h. Stationarity in u gives w = L'f(y); in p it says that
// c_N - v_min + L_N w is the speed s(p) at which q' = -p. In the variables (w, p) the gradient in p
// would contain A_N'f, whose round-off stopped the refinement at 1e-7 in tests where conflicting
// constraints make f large.
#pragma once

#include "accuracy/kinetic_energy/kinetic_energy.h"

namespace counterpoint::contact {

/// The velocity bound of one normal row: p = -q'(s) and its inverse s(p).
struct VelocityBound {
  int law, row;
  double free = 0.0;  // c_N - v_min
  double k, s0;

  double impulse(double s) const { return s >= s0 ? k / s : (2.0 - s / s0) * (k / s0); }
  double stiffness(double s) const { return s >= s0 ? k / (s * s) : k / (s0 * s0); }  // q''
  double speed(double p) const { return p <= k / s0 ? k / p : s0 * (2.0 - p * s0 / k); }
  double softness(double p) const { return p <= k / s0 ? k / (p * p) : s0 * s0 / k; }  // -ds/dp
};

/// Velocity bounds of the contacts, at the target's smoothing.
std::vector<VelocityBound> velocity_bounds(const KineticEnergyProblem& problem);

/// Computes y = v + A grad q + b and f = f(y) for all rows (the inverse).
void kinetic_energy_impulse(const KineticEnergyProblem& problem, const VectorX& v, VectorX& y,
                            VectorX& f);

/// Forward solution of one problem for one c; both must outlive it.
class KineticEnergyNewton {
 public:
  KineticEnergyNewton(const KineticEnergyProblem& problem, const VectorX& c,
                      const Settings& settings);
  void solve(KineticEnergyResult& out);

 private:
  bool set_path(double kappa);  // false if all laws are at their targets
  void evaluate_here();
  bool compute_step();
  double relative_step() const;
  bool advance();
  bool minimize(double accuracy, int max_steps);
  double longest_step() const;
  void add_bounds();
  void follow_path();
  void refine(KineticEnergyResult& out);
  double residual(const VectorX& w, VectorX& v, VectorX& y, VectorX& f) const;
  double roundoff(const VectorX& w, const VectorX& v, const VectorX& y) const;

  const KineticEnergyProblem& problem_;
  const VectorX& c_;
  const Settings& settings_;
  MatrixX L_, normal_;     // L and its rows with a velocity bound, L_N
  std::vector<Law> laws_;  // widened for the current point of the path
  std::vector<VelocityBound> bounds_;
  std::vector<double> inverse_mass_;
  double speed_ = 0.0;  // largest speed among the free rows [m/s]
  double share_ = 0.0;  // least scale of the residual (solver.h, Report)
  int rank_ = 0;
  VectorX x_, w_;  // (u, p); w
  VectorX free_;   // c + b
  VectorX y_, f_, gradient_, step_, y_step_, w_step_;
  MatrixX hessian_;                // Hessian of the cost
  std::vector<double> curvature_;  // Hessians of the laws, concatenated
  int iterations_ = 0;
};

}  // namespace counterpoint::contact
