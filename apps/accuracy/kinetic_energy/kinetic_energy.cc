#include "accuracy/kinetic_energy/kinetic_energy.h"

#include <algorithm>
#include <cmath>

#include "accuracy/kinetic_energy/kinetic_energy_newton.h"
#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {
namespace {

bool bounded(const Law& law) {
  return law.type == LawType::kUnilateral || law.type == LawType::kFrictionCone;
}

bool valid(const KineticEnergyProblem& problem, const VectorX& c) {
  Eigen::Index rows = 0;
  for (const Law& law : problem.laws) {
    if (law.coulomb || !is_valid(law)) return false;
    rows += law.rows;
  }
  return problem.velocity_smoothing > 0.0 && problem.continuation_speed > 0.0 &&
         problem.gap_speed.size() == problem.laws.size() && problem.A.rows() == rows &&
         problem.A.cols() == rows && c.size() == rows;
}

bool finite(const KineticEnergyProblem& problem, const VectorX& c) {
  bool all = problem.A.allFinite() && c.allFinite();
  all = all && std::isfinite(problem.velocity_smoothing + problem.continuation_speed);
  for (const Law& law : problem.laws) all = all && is_finite(law);
  for (const double speed : problem.gap_speed) all = all && std::isfinite(speed);
  return all;
}

}  // namespace

std::vector<VelocityBound> velocity_bounds(const KineticEnergyProblem& problem) {
  std::vector<VelocityBound> bounds;
  int row = 0;
  for (size_t i = 0; i < problem.laws.size(); ++i) {
    if (bounded(problem.laws[i])) {
      bounds.push_back(
          {static_cast<int>(i), row, 0.0, problem.velocity_smoothing, problem.continuation_speed});
    }
    row += problem.laws[i].rows;
  }
  return bounds;
}

void kinetic_energy_impulse(const KineticEnergyProblem& problem, const VectorX& v, VectorX& y,
                            VectorX& f) {
  y = v;
  for (const VelocityBound& bound : velocity_bounds(problem)) {
    const double p = bound.impulse(v[bound.row] + problem.gap_speed[bound.law]);
    y -= problem.A.col(bound.row) * p;
  }
  f.resize(v.size());
  int row = 0;
  for (const Law& law : problem.laws) {
    for (int r = 0; r < law.rows; ++r) y[row + r] += law.bias[r];
    impulse(law, y.data() + row, f.data() + row);
    row += law.rows;
  }
}

double distant_regularizer(double regularizer, double gap, double range) {
  const double share = std::max(0.0, gap) / range;
  return regularizer * (1.0 + share * share);
}

KineticEnergyResult solve_kinetic_energy(const KineticEnergyProblem& problem, const VectorX& c,
                                         const Settings& settings) {
  KineticEnergyResult out;
  out.f.setZero(c.size());
  out.v = out.c = c;
  if (!finite(problem, c)) {
    out.status = Status::kNotFinite;
  } else if (!valid(problem, c)) {
    out.status = Status::kInvalidLaw;
  } else if (!problem.laws.empty()) {
    KineticEnergyNewton(problem, c, settings).solve(out);
  }
  return out;
}

KineticEnergyResult invert_kinetic_energy(const KineticEnergyProblem& problem, const VectorX& v) {
  KineticEnergyResult out;
  VectorX y;
  kinetic_energy_impulse(problem, v, y, out.f);
  out.v = v;
  out.c = v - problem.A * out.f;
  return out;
}

}  // namespace counterpoint::contact
