#include "counterpoint/engine/estimate/motion/pair_forces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace counterpoint::estimation {
namespace {

/// A contact is sliding if its friction exceeds this fraction of the limit.
constexpr double kSliding = 0.9;

using Pair = std::pair<int, int>;

/// Sums over the contacts of one pair.
struct Sums {
  ContactEstimate estimate;
  Vector3 weighted = Vector3::Zero(), plain = Vector3::Zero();
  Vector3 slip = Vector3::Zero();
  double friction = 0.0;  ///< sum of the friction limits [N]
  int count = 0;
};

/// Sets the pair forces of a step in the order of `pairs`; zero for pairs no longer in contact.
void set_forces(const Inverse& inverse, const std::vector<ContactEstimate>& pairs,
                Eigen::Ref<VectorX> out) {
  out.setZero();
  for (const ContactForce& one : inverse.contacts) {
    const Pair key(one.contact.geometry_a, one.contact.geometry_b);
    const auto it = std::lower_bound(pairs.begin(), pairs.end(), key,
                                     [](const ContactEstimate& e, const Pair& wanted) {
                                       return Pair(e.geometry_a, e.geometry_b) < wanted;
                                     });
    if (it == pairs.end() || Pair(it->geometry_a, it->geometry_b) != key) continue;
    out.segment<3>(3 * (it - pairs.begin())) += one.force;
  }
}

/// Derivatives with respect to the three frames of step t, by central differences.
void differentiate_by_frames(const MotionPoint& point, const SimulationOptions& options, int t,
                             InstantModel& model, MotionPoint& scratch, const Model& bodies,
                             PairForces& out) {
  // scratch space that each thread owns
  const int nv = bodies.nv();
  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(out.pairs.size());
  const double step = difference_step(options);
  out.by_frames.resize(rows, 3 * nv);
  VectorX ahead(rows), back(rows), unit = VectorX::Zero(nv);
  for (int a = 0; a < 3; ++a) {
    const auto frame = static_cast<std::size_t>(t - 1 + a);
    for (int i = 0; i < nv; ++i) {
      unit[i] = 1.0;
      integrate_configuration(bodies, point.q[frame], unit, step, scratch.q[frame]);
      set_forces(model.invert(scratch, options, t), out.pairs, ahead);
      integrate_configuration(bodies, point.q[frame], unit, -step, scratch.q[frame]);
      set_forces(model.invert(scratch, options, t), out.pairs, back);
      out.by_frames.col(a * nv + i) = (ahead - back) / (2.0 * step);
      unit[i] = 0.0;
    }
    scratch.q[frame] = point.q[frame];
  }
}

/// Derivatives of the forces of all frames with respect to one parameter, by central differences.
void differentiate_by_parameter(const MotionProblem& problem, const MotionFit& fit, int index,
                                std::vector<PairForces>& out) {
  SimulationOptions options = fit.options();
  const double step = difference_step(options);
  Model ahead = fit.model(), back = fit.model();
  const StepParameter& parameter = problem.parameters[static_cast<std::size_t>(index)];
  change_parameter(parameter, step, ahead, options);
  change_parameter(parameter, -step, back, options);
  InstantModel model_ahead(problem, ahead), model_back(problem, back);
  for (int t = 1; t + 1 < problem.frames(); ++t) {
    PairForces& at = out[static_cast<std::size_t>(t)];
    VectorX plus(at.by_parameters.rows()), minus(at.by_parameters.rows());
    set_forces(model_ahead.invert(fit.point(), fit.options(), t), at.pairs, plus);
    set_forces(model_back.invert(fit.point(), fit.options(), t), at.pairs, minus);
    at.by_parameters.col(index) = (plus - minus) / (2.0 * step);
  }
}

}  // namespace

std::vector<ContactEstimate> pair_forces(const Model& model, const Inverse& inverse) {
  std::map<Pair, Sums> by_pair;
  for (const ContactForce& one : inverse.contacts) {
    const auto& [a, b, position, normal, gap, area] = one.contact;
    Sums& sums = by_pair[{a, b}];
    const double pressure = std::max(0.0, one.force.dot(normal));
    sums.estimate.geometry_a = a;
    sums.estimate.geometry_b = b;
    sums.estimate.force += one.force;
    sums.estimate.normal_force += pressure;
    sums.weighted += pressure * position;
    sums.slip += pressure * one.slip;
    sums.plain += position;
    ++sums.count;
    const Material surface = model.pair_material(a, b);
    sums.friction += pressure * surface.friction;
  }
  std::vector<ContactEstimate> out;
  for (auto& [key, sums] : by_pair) {
    ContactEstimate& e = sums.estimate;
    const double normal = e.normal_force;
    e.centre = normal > 0.0 ? Vector3(sums.weighted / normal) : Vector3(sums.plain / sums.count);
    e.slip = normal > 0.0 ? (sums.slip / normal).norm() : 0.0;
    const double tangential = std::sqrt(std::max(0.0, e.force.squaredNorm() - normal * normal));
    e.sliding = normal > 0.0 && tangential > kSliding * sums.friction;
    out.push_back(e);
  }
  return out;
}

std::vector<PairForces> differentiate_pair_forces(const MotionProblem& problem, MotionFit& fit) {
  const int frames = problem.frames(), parameters = static_cast<int>(problem.parameters.size());
  std::vector<PairForces> out(static_cast<std::size_t>(frames));
  std::vector<MotionPoint> scratch(static_cast<std::size_t>(fit.pool().size()), fit.point());
  std::vector<std::unique_ptr<InstantModel>> models;
  for (int i = 0; i < fit.pool().size(); ++i)
    models.push_back(std::make_unique<InstantModel>(problem, fit.model()));
  fit.pool().run(frames, [&](int t, int thread) {
    if (t == 0 || t == frames - 1) return;
    InstantModel& model = *models[static_cast<std::size_t>(thread)];
    PairForces& at = out[static_cast<std::size_t>(t)];
    at.pairs = pair_forces(fit.model(), model.invert(fit.point(), fit.options(), t));
    at.by_parameters.setZero(3 * static_cast<Eigen::Index>(at.pairs.size()),
                             problem.num_parameters());
    differentiate_by_frames(fit.point(), fit.options(), t, model,
                            scratch[static_cast<std::size_t>(thread)], fit.model(), at);
  });
  fit.pool().run(parameters, [&](int k, int) { differentiate_by_parameter(problem, fit, k, out); });
  return out;
}

}  // namespace counterpoint::estimation
