#include "counterpoint/engine/optimize/retarget.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/newton/newton.h"

namespace counterpoint::optimization {
namespace {

/// Limit of Gauss-Newton steps, and decrease of the cost, relative to it, at which the fit ends.
constexpr int kMostSteps = 500;
constexpr double kDone = 1e-5;

/// First frames of the fit: those of a configuration to follow, else the start, its floating bodies
/// where terms want them.
std::vector<VectorX> first_frames(const Problem& fit) {
  const Model& model = *fit.model;
  std::vector<VectorX> frames(static_cast<std::size_t>(fit.steps) + 1, fit.start_q);
  for (const Term& term : fit.terms) {
    if (term.targets.empty()) continue;
    if (term.quantity == Quantity::kConfiguration) return term.targets;
    const Body& body = model.body(term.body);
    if (body.joint_type != JointType::kFloating) continue;
    for (std::size_t t = 0; t < frames.size(); ++t) {
      if (term.quantity == Quantity::kPosition)
        frames[t].segment<3>(body.q_index) = term.targets[t] - term.point;
      if (term.quantity == Quantity::kOrientation)
        frames[t].segment<4>(body.q_index + 3) = term.targets[t];
    }
  }
  return frames;
}

std::vector<FitError> errors_of(const Problem& fit, const Newton& newton) {
  const VectorX costs = newton.cost_by_term();
  std::vector<FitError> errors;
  VectorX sums = VectorX::Zero(costs.size()), counts = sums;
  for (std::size_t i = 0; i < fit.terms.size(); ++i) {
    const Term& term = fit.terms[i];
    if (term.targets.empty()) continue;
    const auto known = std::find_if(errors.begin(), errors.end(), [&](const FitError& e) {
      return e.name == term.name && e.quantity == term.quantity;
    });
    const Eigen::Index at = known - errors.begin();
    if (known == errors.end()) errors.push_back({term.name, term.quantity});
    sums[at] += 2.0 * costs[static_cast<Eigen::Index>(i)];
    counts[at] += (fit.steps + 1) * term.weight.squaredNorm();
  }
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    errors[i].rms = counts[at] > 0.0 ? std::sqrt(sums[at] / counts[at]) : 0.0;
  }
  return errors;
}

}  // namespace

Fit fit_motion(ProblemFile& file) {
  if (file.retargeting == nullptr)
    throw InputError(file.file.string() + ": the key 'retarget' is missing; see `optimize`");
  const Problem& fit = file.retargeting->fit;
  Newton newton(fit, first_frames(fit), 1);
  Stage stage;
  stage.options = fit.options;
  newton.begin(stage);
  Fit out;
  for (bool going = true; going && out.iterations < kMostSteps; ++out.iterations) {
    const double before = newton.cost();
    const Iteration step = newton.iterate();
    going = step.accepted && step.decrease > kDone * before;
  }
  if (out.iterations == kMostSteps)
    throw InputError(file.file.string() +
                     ": retarget: the fit of the motion does not converge; "
                     "weigh accelerations and a posture");
  out.q = newton.frames().all();
  out.errors = errors_of(fit, newton);
  Problem& problem = file.problem;
  for (const std::size_t i : file.retargeting->followers) problem.terms[i].targets = out.q;
  file.guess = out.q;
  problem.start_q = out.q.front();
  configuration_difference(*problem.model, out.q[0], out.q[1], problem.start_v);
  problem.start_v /= problem.h();
  return out;
}

VectorX rms_deviation(const Model& model, const std::vector<VectorX>& from,
                      const std::vector<VectorX>& to) {
  VectorX sum = VectorX::Zero(model.nv()), difference = sum;
  for (std::size_t t = 0; t < from.size(); ++t) {
    configuration_difference(model, from[t], to[t], difference);
    sum += difference.cwiseAbs2();
  }
  return (sum / static_cast<double>(from.size())).cwiseSqrt();
}

}  // namespace counterpoint::optimization
