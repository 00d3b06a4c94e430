#include "counterpoint/engine/optimize/retarget.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/newton/newton.h"
#include "counterpoint/engine/optimize/reference.h"

namespace counterpoint::optimization {
namespace {

/// Limit of Gauss-Newton steps, and decrease of the cost, relative to it, at which the fit ends.
constexpr int kMostSteps = 500;
constexpr double kDone = 1e-5;

/// Moves a floating body to where the terms want it in a frame: to their orientation, or the one
/// that brings three of its points or more nearest to their places (Umeyama 1991).
void place(const Problem& fit, int index, int frame, VectorX& q) {
  const Body& body = fit.model->body(index);
  auto turn = q.segment<4>(body.q_index + 3);
  std::vector<Vector3> points, places;
  bool turned = false;
  for (const Term& term : fit.terms) {
    if (term.body != index || term.targets.empty() || !term.known_at(frame)) continue;
    if (term.quantity == Quantity::kOrientation) turn = term.target_at(frame);
    turned = turned || term.quantity == Quantity::kOrientation;
    if (term.quantity != Quantity::kPosition) continue;
    points.push_back(term.point);
    places.emplace_back(term.target_at(frame));
  }
  if (points.empty()) return;
  const auto count = static_cast<Eigen::Index>(points.size());
  const Eigen::Map<const Eigen::Matrix3Xd> from(points[0].data(), 3, count);
  const Eigen::Map<const Eigen::Matrix3Xd> to(places[0].data(), 3, count);
  if (count >= 3 && !turned) {
    const Quaternion best(Matrix3(Eigen::umeyama(from, to, false).topLeftCorner<3, 3>()));
    turn << best.w(), best.x(), best.y(), best.z();
  }
  q.segment<3>(body.q_index) =
      to.rowwise().mean() - quaternion_of(turn) * Vector3(from.rowwise().mean());
}

/// First frames of the fit: those of a configuration to follow, else the start, its floating bodies
/// where terms want them, or where they were in the frame before.
std::vector<VectorX> first_frames(const Problem& fit) {
  const Model& model = *fit.model;
  for (const Term& term : fit.terms)
    if (term.quantity == Quantity::kConfiguration && !term.targets.empty()) return term.targets;
  std::vector<VectorX> frames;
  for (int t = 0; t <= fit.steps; ++t) {
    VectorX& q = frames.emplace_back(t == 0 ? fit.start_q : frames.back());
    for (int i = 1; i < model.num_bodies(); ++i)
      if (model.body(i).joint_type == JointType::kFloating) place(fit, i, t, q);
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
    for (int t = 0; t <= fit.steps; ++t)
      if (term.known_at(t)) counts[at] += term.weight.squaredNorm();
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
