#include "counterpoint/engine/estimate/parameters/step_parameters.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"

namespace counterpoint::estimation {
namespace {

using K = ParameterKind;
using S = StepParameterKind;

bool changes_inertia(ParameterKind kind) { return is_inertial(kind) || kind == K::kSize; }

}  // namespace

std::optional<StepParameterKind> step_kind(ParameterKind kind) {
  if (is_inertial(kind)) return S::kInertia;
  switch (kind) {
    case K::kFriction:
      return S::kFriction;
    case K::kRestitution:
      return S::kRestitution;
    case K::kTorsionalFriction:
      return S::kTorsionalFriction;
    case K::kRollingFriction:
      return S::kRollingFriction;
    case K::kHeight:
    case K::kPlaceX:
    case K::kPlaceY:
    case K::kPlaceZ:
      return S::kHeight;
    case K::kDamping:
      return S::kDamping;
    case K::kDryFriction:
      return S::kDryFriction;
    case K::kBreakawayFriction:
      return S::kBreakawayFriction;
    case K::kStribeckSpeed:
      return S::kStribeckSpeed;
    case K::kArmature:
      return S::kArmature;
    case K::kGravity:
      return S::kGravity;
    case K::kCompliance:
      return S::kCompliance;
    case K::kSmoothing:
      return S::kSmoothing;
    case K::kStabilization:
      return S::kStabilization;
    case K::kMaxRecoverySpeed:
      return S::kMaxRecoverySpeed;
    default:
      return std::nullopt;
  }
}

SpatialInertia inertia_at(const std::vector<Parameter>& parameters, const VectorX& values, int body,
                          const Model& model) {
  SpatialInertia out = model.body(body).inertia;
  const Pose link = link_pose(model, body);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    const double sign = p.sign_of(body);
    if (changes_inertia(p.kind) && sign != 0.0)
      out = with_value(p.kind, sign * values[static_cast<Eigen::Index>(i)], out, link);
  }
  return out;
}

/// Inertial parameters are polynomials of second degree in each value, so that central differences
/// over any step are exact.
StepParameter step_parameter(const std::vector<Parameter>& parameters, std::size_t k,
                             const VectorX& values, const Model& model) {
  const Parameter& p = parameters[k];
  StepParameter out{*step_kind(p.kind), p.targets, {}, {}};
  for (std::size_t i = 0; i < p.targets.size() && out.kind == S::kHeight; ++i)
    out.directions.push_back(p.sign(i) * Vector3::Unit(p.kind == K::kPlaceX   ? 0
                                                       : p.kind == K::kPlaceY ? 1
                                                                              : 2));
  if (out.kind != S::kInertia) return out;
  const auto at = static_cast<Eigen::Index>(k);
  const double step = 0.1 * std::max(std::abs(values[at]), 0.1);
  for (const int body : p.targets) {
    const auto moved = [&](double by) {
      VectorX to = values;
      to[at] += by;
      return inertial_parameters(inertia_at(parameters, to, body, model));
    };
    out.changes.push_back((moved(step) - moved(-step)) / (2.0 * step));
  }
  return out;
}

}  // namespace counterpoint::estimation
