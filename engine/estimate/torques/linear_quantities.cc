#include "counterpoint/engine/estimate/torques/linear_quantities.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/estimate/fit/fit_spread.h"
#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"
#include "counterpoint/engine/estimate/parameters/step_parameters.h"

namespace counterpoint::estimation {
namespace {

using K = ParameterKind;

bool has(const std::vector<int>& list, int value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

/// Least excess of breakaway friction in a search, as a share of its range: without any, nothing
/// tells the Stribeck speed.
constexpr double kLeastExcess = 2e-5;

/// Returns the index of the dry friction of the joints of a breakaway friction, or -1.
Eigen::Index sliding_of(const Parameter& breakaway, const std::vector<Parameter>& list,
                        const VectorX& dry_friction) {
  const std::vector<int>& joints = breakaway.targets;
  bool alike = true;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (list[i].kind != K::kDryFriction) continue;
    const auto shared = std::count_if(joints.begin(), joints.end(),
                                      [&](int joint) { return has(list[i].targets, joint); });
    if (shared == static_cast<std::ptrdiff_t>(joints.size())) return static_cast<Eigen::Index>(i);
    alike = alike && shared == 0;
  }
  for (const int joint : joints)
    alike = alike && dry_friction[joint] == dry_friction[joints.front()];
  if (alike) return -1;
  throw InputError(fmt::format(
      "parameter '{}': its joints have different dry frictions; expected breakaway_friction:JOINT",
      breakaway.name));
}

}  // namespace

Coordinates::Coordinates(const std::vector<Parameter>& list, const VectorX& start,
                         const VectorX& dry_friction)
    : parameters(list),
      lower(start.size()),
      upper(start.size()),
      prior(start.size()),
      prior_weights(start.size()),
      sliding(list.size(), -1),
      level(VectorX::Zero(start.size())) {
  for (Eigen::Index i = 0; i < start.size(); ++i) {
    const Parameter& p = list[static_cast<std::size_t>(i)];
    lower[i] = p.logarithmic ? std::log(p.lower) : p.lower;
    upper[i] = p.logarithmic ? std::log(p.upper) : p.upper;
    const double at = std::clamp(start[i], p.lower, p.upper);
    prior[i] = p.logarithmic ? std::log(at) : at;
  }
  ranges = upper - lower;
  for (std::size_t k = 0; k < list.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const Parameter& p = list[k];
    prior_weights[at] = fitting::prior_weight(
        p.deviation, p.logarithmic ? std::exp(prior[at]) : prior[at], p.logarithmic, ranges[at]);
  }
  for (std::size_t k = 0; k < list.size(); ++k) {
    if (list[k].kind != K::kBreakawayFriction) continue;
    const auto i = static_cast<Eigen::Index>(k);
    sliding[k] = sliding_of(list[k], list, dry_friction);
    if (sliding[k] < 0) level[i] = dry_friction[list[k].targets.front()];
    const double from = sliding[k] < 0 ? level[i] : prior[sliding[k]];
    lower[i] = kLeastExcess * ranges[i];
    upper[i] = std::max(upper[i] - level[i], 2.0 * lower[i]);
    prior[i] = std::clamp(start[i] - from, lower[i], upper[i]);
  }
}

VectorX Coordinates::values(const VectorX& x) const {
  VectorX out = x;
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (parameters[static_cast<std::size_t>(i)].logarithmic) out[i] = std::exp(x[i]);
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (parameters[k].kind == K::kBreakawayFriction)
      out[i] = std::min(x[i] + (sliding[k] < 0 ? level[i] : out[sliding[k]]), parameters[k].upper);
  }
  return out;
}

MatrixX Coordinates::covariance_of_values(MatrixX covariance) const {
  for (Eigen::Index i = 0; i < covariance.rows(); ++i)
    if (const Eigen::Index from = sliding[static_cast<std::size_t>(i)]; from >= 0)
      covariance.row(i) += covariance.row(from);
  for (Eigen::Index i = 0; i < covariance.rows(); ++i)
    if (const Eigen::Index from = sliding[static_cast<std::size_t>(i)]; from >= 0)
      covariance.col(i) += covariance.col(from);
  return covariance;
}

MatrixX Coordinates::information_of_values(MatrixX information) const {
  for (Eigen::Index i = 0; i < information.rows(); ++i)
    if (const Eigen::Index from = sliding[static_cast<std::size_t>(i)]; from >= 0)
      information.row(from) -= information.row(i);
  for (Eigen::Index i = 0; i < information.rows(); ++i)
    if (const Eigen::Index from = sliding[static_cast<std::size_t>(i)]; from >= 0)
      information.col(from) -= information.col(i);
  return information;
}

Coordinates Coordinates::near(const VectorX& x, double most) const {
  Coordinates out = *this;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    if (parameters[static_cast<std::size_t>(i)].kind != K::kStribeckSpeed) continue;
    out.lower[i] = std::max(lower[i], x[i] - most);
    out.upper[i] = std::min(upper[i], x[i] + most);
  }
  return out;
}

bool is_channel(ParameterKind kind) {
  return kind == K::kForceOffset || kind == K::kForceGain || kind == K::kForceDelay;
}
bool is_linear(ParameterKind kind) {
  return is_inertial(kind) || kind == K::kDamping || kind == K::kDryFriction ||
         kind == K::kBreakawayFriction || kind == K::kStribeckSpeed || kind == K::kArmature ||
         kind == K::kGravity;
}

std::vector<ChannelValues> channel_values(const std::vector<int>& coordinates,
                                          const std::vector<Parameter>& parameters,
                                          const VectorX& values) {
  std::vector<ChannelValues> out(coordinates.size());
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    const double value = values[static_cast<Eigen::Index>(i)];
    for (std::size_t c = 0; c < coordinates.size(); ++c) {
      const double sign = p.sign_of(coordinates[c]);
      if (!is_channel(p.kind) || sign == 0.0) continue;
      (p.kind == K::kForceOffset ? out[c].offset
       : p.kind == K::kForceGain ? out[c].gain
                                 : out[c].delay) = sign * value;
    }
  }
  return out;
}

LinearQuantities::LinearQuantities(const Scene& scene, const std::vector<Parameter>& parameters)
    : parameters_(parameters), model_(scene.model) {
  for (const Parameter& p : parameters) {
    if (!is_inertial(p.kind)) continue;
    for (const int body : p.targets)
      if (!has(bodies_, body)) bodies_.push_back(body);
  }
  std::sort(bodies_.begin(), bodies_.end());
  for (std::size_t i = 0; i < parameters.size(); ++i)
    if (!is_inertial(parameters[i].kind) && !is_channel(parameters[i].kind))
      others_.push_back(static_cast<Eigen::Index>(i));
}

std::vector<StepParameter> LinearQuantities::step_parameters(const Model& model) const {
  const std::vector<StepParameter> all = inertial_step_parameters(model);
  std::vector<StepParameter> out;
  for (const int body : bodies_)
    for (int k = 0; k < 10; ++k) out.push_back(all[static_cast<std::size_t>(10 * (body - 1) + k)]);
  for (const Eigen::Index i : others_) {
    const Parameter& p = parameters_[static_cast<std::size_t>(i)];
    out.push_back({*step_kind(p.kind), p.targets, {}, {}});
  }
  return out;
}

VectorX LinearQuantities::at(const VectorX& values) const {
  VectorX out(size());
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    out.segment<10>(10 * static_cast<Eigen::Index>(b)) =
        inertial_parameters(inertia_at(parameters_, values, bodies_[b], model_));
  for (std::size_t i = 0; i < others_.size(); ++i)
    out[num_inertial() + static_cast<Eigen::Index>(i)] = values[others_[i]];
  return out;
}

/// The map is a polynomial but for logarithms, so that central differences have no error to speak
/// of.
MatrixX LinearQuantities::derivatives(const Coordinates& coordinates, const VectorX& x) const {
  MatrixX out(size(), x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double step = 1e-5 * coordinates.range(i);
    VectorX moved = x;
    moved[i] = x[i] + step;
    out.col(i) = at(coordinates.values(moved));
    moved[i] = x[i] - step;
    out.col(i) -= at(coordinates.values(moved));
    out.col(i) /= 2.0 * step;
  }
  return out;
}

}  // namespace counterpoint::estimation
