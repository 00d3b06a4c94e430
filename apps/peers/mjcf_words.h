// Numbers, poses, surfaces and gravity compensation as text in MJCF.
#pragma once

#include <fmt/format.h>

#include <initializer_list>
#include <string>

#include "counterpoint/engine/step.h"
#include "counterpoint/model/model.h"
#include "not_expressible.h"

namespace counterpoint::peers {

inline std::string numbers(std::initializer_list<double> values) {
  std::string out;
  for (const double value : values) {
    if (!out.empty()) out += ' ';
    out += fmt::format("{:.17g}", value);
  }
  return out;
}

inline std::string text(const Vector3& v) { return numbers({v.x(), v.y(), v.z()}); }

inline std::string placed(const Pose& pose) {
  const Quaternion q(pose.rotation);
  return fmt::format("pos='{}' quat='{}'", text(pose.translation),
                     numbers({q.w(), q.x(), q.y(), q.z()}));
}

/// Attributes friction and condim of a geometry, or of a pair, which has one coefficient for each
/// direction; the units are the same as ours.
inline std::string surface(const Material& material, EffectSet on, bool pair = false) {
  const double slide = on.has(Effect::kFriction) ? material.friction : 0.0;
  const double spin = on.has(Effect::kTorsionalFriction) ? material.torsional_friction : 0.0;
  const double roll = on.has(Effect::kRollingFriction) ? material.rolling_friction : 0.0;
  // Without friction the coefficients have no effect, but MuJoCo requires positive ones.
  if (slide <= 0.0) return fmt::format("condim='1' friction='{}'", pair ? "1 1 0 0 0" : "1 0 0");
  const int dimensions = roll > 0.0 ? 6 : spin > 0.0 ? 4 : 3;
  return fmt::format(
      "condim='{}' friction='{}'", dimensions,
      pair ? numbers({slide, slide, spin, roll, roll}) : numbers({slide, spin, roll}));
}

/// Attribute gravcomp of a body, the share of its weight that is compensated; "" if none is,
/// because MuJoCo before 2.3 does not know the attribute. @throws NotExpressible if the force does
/// not act at the centre of mass, to 1e-9 of the distances.
inline std::string gravcomp(const Model& model, int body) {
  double mass = 0.0;
  Vector3 moment = Vector3::Zero();
  bool any = false;
  for (const GravityCompensation& carried : model.gravity_compensations()) {
    if (carried.body != body) continue;
    any = true;
    mass += carried.mass;
    moment += carried.mass * carried.center;
  }
  if (!any) return "";
  const SpatialInertia& inertia = model.body(body).inertia;
  const Vector3 centred = mass * inertia.center;
  if (!((moment - centred).norm() <= 1e-9 * (moment.norm() + centred.norm())))
    throw NotExpressible("MuJoCo carries a share of a body's weight at its centre of mass only");
  return fmt::format(" gravcomp='{:.17g}'", mass / inertia.mass);
}

}  // namespace counterpoint::peers
