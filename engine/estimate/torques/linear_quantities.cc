#include "counterpoint/engine/estimate/torques/linear_quantities.h"

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

}  // namespace

Coordinates::Coordinates(const std::vector<Parameter>& list, const VectorX& start)
    : parameters(list),
      lower(start.size()),
      upper(start.size()),
      prior(start.size()),
      prior_weights(start.size()) {
  for (Eigen::Index i = 0; i < start.size(); ++i) {
    const Parameter& p = list[static_cast<std::size_t>(i)];
    lower[i] = p.logarithmic ? std::log(p.lower) : p.lower;
    upper[i] = p.logarithmic ? std::log(p.upper) : p.upper;
    const double at = std::clamp(start[i], p.lower, p.upper);
    prior[i] = p.logarithmic ? std::log(at) : at;
    prior_weights[i] = fitting::prior_weight(p.deviation, at, p.logarithmic, range(i));
  }
}

double Coordinates::value(Eigen::Index i, double x) const {
  return parameters[static_cast<std::size_t>(i)].logarithmic ? std::exp(x) : x;
}

VectorX Coordinates::values(const VectorX& x) const {
  VectorX out(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) out[i] = value(i, x[i]);
  return out;
}

bool is_channel(ParameterKind kind) {
  return kind == K::kForceOffset || kind == K::kForceGain || kind == K::kForceDelay;
}
bool is_linear(ParameterKind kind) {
  return is_inertial(kind) || kind == K::kDamping || kind == K::kDryFriction ||
         kind == K::kArmature || kind == K::kGravity;
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
