#include "counterpoint/engine/dynamics/gravity_compensation.h"

#include <algorithm>

namespace counterpoint {

std::span<const GravityCompensation> compensations_of(const Model& model, BodyRange bodies) {
  const std::vector<GravityCompensation>& all = model.gravity_compensations();
  const auto first_at = [&](int body) {
    return std::lower_bound(
        all.begin(), all.end(), body,
        [](const GravityCompensation& carried, int b) { return carried.body < b; });
  };
  return {first_at(bodies.begin), first_at(bodies.end)};
}

void subtract_carried_weight(const Model& model, const Vector3& gravity, BodyRange bodies,
                             const Kinematics& data, std::vector<Force>& needed) {
  if (model.gravity_compensations().empty() || gravity.isZero(0.0)) return;
  for (const GravityCompensation& carried : compensations_of(model, bodies)) {
    const Vector3 weight = carried.mass * gravity;
    needed[carried.body] += Force{arm_of(carried, data).cross(weight), weight};
  }
}

Vector3 carried_moment(const Model& model, int body) {
  Vector3 moment = Vector3::Zero();
  for (const GravityCompensation& carried : compensations_of(model, {body, body + 1}))
    moment += carried.mass * carried.center;
  return moment;
}

}  // namespace counterpoint
