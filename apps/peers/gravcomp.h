// Weight that is carried, as MuJoCo says it: a share of the whole body's.
#pragma once

#include <fmt/format.h>

#include <string>

#include "counterpoint/engine/dynamics/gravity_compensation.h"
#include "not_expressible.h"

namespace counterpoint::peers {

/// " gravcomp='...'" of a body, the share of its weight that is carried; "" if there is none, which
/// MuJoCo before 2.3 knows. @throws NotExpressible where the
/// force does not act at its centre of mass, to 1e-9 of the distances.
inline std::string gravcomp(const Model& model, int body) {
  if (compensations_of(model, {body, body + 1}).empty()) return "";
  double mass = 0.0;
  for (const GravityCompensation& carried : compensations_of(model, {body, body + 1}))
    mass += carried.mass;
  const SpatialInertia& inertia = model.body(body).inertia;
  const Vector3 moment = carried_moment(model, body), centred = mass * inertia.center;
  if (!((moment - centred).norm() <= 1e-9 * (moment.norm() + centred.norm())))
    throw NotExpressible("MuJoCo carries a share of a body's weight at its centre of mass only");
  return fmt::format(" gravcomp='{:.17g}'", mass / inertia.mass);
}

}  // namespace counterpoint::peers
