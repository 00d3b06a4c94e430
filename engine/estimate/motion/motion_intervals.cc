#include "counterpoint/engine/estimate/motion/motion_intervals.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/estimate/motion/motion_result.h"

namespace counterpoint::estimation {
namespace {

/// Standard deviation of the time of an impact within its interval [rows]. With it, 90 to 100 % of
/// simulated impacts of a quadruped, a humanoid, an arm and a cube lie in the 95 % intervals.
constexpr double kTiming = 0.15;

/// Force of the same pair in another list; zero if it is not there.
Vector3 force_of(const std::vector<ContactEstimate>& pairs, const ContactEstimate& wanted) {
  for (const ContactEstimate& pair : pairs)
    if (pair.geometry_a == wanted.geometry_a && pair.geometry_b == wanted.geometry_b)
      return pair.force;
  return Vector3::Zero();
}

VectorX change(const VectorX& a, const VectorX& b) { return (b - a).cwiseAbs(); }

/// Root of the sum of squares, by element.
MatrixX added(const MatrixX& a, const MatrixX& b) {
  return (a.cwiseAbs2() + b.cwiseAbs2()).cwiseSqrt();
}

}  // namespace

void widen_by_smoothing(const MotionProblem& problem, const ContinuationResult& found,
                        MotionEstimate& out) {
  if (found.softer.q.empty()) return;
  const Model& model = problem.model;
  const auto forces_at = [&](const MotionPoint& point, double smoothing) {
    MotionEstimate forces = empty_estimate(model, out.time, out.sums);
    const SimulationOptions options = stage_options(problem, smoothing);
    InstantModel instant(problem, model);
    for (int t = 1; t + 1 < problem.frames(); ++t) {
      set_inverse(model, instant.invert(point, options, t), t, forces);
      set_sums(model, t, nullptr, forces);
    }
    return forces;
  };
  const MotionEstimate hard = forces_at(found.hardest, found.smoothing);
  const MotionEstimate soft = forces_at(found.softer, found.softer_smoothing);
  const double share = 1.0 / (std::sqrt(found.softer_smoothing / found.smoothing) - 1.0);
  out.force_deviation = added(out.force_deviation, share * (soft.force - hard.force));
  out.sum_deviation = added(out.sum_deviation, share * (soft.sum_force - hard.sum_force));
  for (std::size_t t = 0; t < out.contacts.size(); ++t)
    for (ContactEstimate& pair : out.contacts[t]) {
      const Vector3 left =
          share * (force_of(soft.contacts[t], pair) - force_of(hard.contacts[t], pair));
      pair.deviation = added(pair.deviation, left);
    }
}

void widen_by_timing(MotionEstimate& out) {
  const Eigen::Index last = out.force.cols() - 1;
  const auto widen = [&](const MatrixX& force, MatrixX& deviation) {
    for (Eigen::Index t = 1; t < last; ++t) {
      VectorX most = VectorX::Zero(force.rows());
      if (t > 1) most = change(force.col(t - 1), force.col(t));
      if (t + 1 < last) most = most.cwiseMax(change(force.col(t), force.col(t + 1)));
      deviation.col(t) = added(deviation.col(t), kTiming * most);
    }
  };
  widen(out.force, out.force_deviation);
  widen(out.sum_force, out.sum_deviation);
  for (std::size_t t = 1; t + 1 < out.contacts.size(); ++t)
    for (ContactEstimate& pair : out.contacts[t]) {
      Vector3 most = Vector3::Zero();
      if (t > 1) most = change(force_of(out.contacts[t - 1], pair), pair.force);
      if (t + 2 < out.contacts.size())
        most = most.cwiseMax(change(force_of(out.contacts[t + 1], pair), pair.force));
      pair.deviation = added(pair.deviation, kTiming * most);
    }
}

void widen_by_residuals(MotionEstimate& out) {
  for (Eigen::Index t = 1; t + 1 < out.cost_ratio.size(); ++t) {
    const double factor = std::sqrt(std::max(1.0, out.cost_ratio.segment<3>(t - 1).maxCoeff()));
    out.force_deviation.col(t) *= factor;
    out.sum_deviation.col(t) *= factor;
    for (ContactEstimate& pair : out.contacts[static_cast<std::size_t>(t)])
      pair.deviation *= factor;
  }
}

}  // namespace counterpoint::estimation
