#include "counterpoint/model/material.h"

#include <algorithm>
#include <cmath>

namespace counterpoint {
namespace {

/// Puts the springs and dampers of two surfaces in series. A surface takes the share k_other / (k_a
/// + k_b) of the deformation, and of its speed.
void combine_springs(const Material& a, const Material& b, Material& m) {
  if (!a.is_soft() && !b.is_soft()) return;
  const double share_a =
      a.is_soft() ? (b.is_soft() ? b.stiffness / (a.stiffness + b.stiffness) : 1.0) : 0.0;
  const double share_b = 1.0 - share_a;
  m.stiffness = a.is_soft() ? share_a * a.stiffness : b.stiffness;
  m.damping = share_a * share_a * a.damping + share_b * share_b * b.damping;
  m.dissipation = share_a * share_a * a.dissipation + share_b * share_b * b.dissipation;
  m.restitution = 0.0;
}

/// Combines two surfaces by their coefficients along the axis.
Material combine_along(const Material& a, const Material& b) {
  Material m;
  m.friction = std::sqrt(a.friction * b.friction);
  m.restitution = std::max(a.restitution, b.restitution);
  m.torsional_friction = std::max(a.torsional_friction, b.torsional_friction);
  m.rolling_friction = std::max(a.rolling_friction, b.rolling_friction);
  combine_springs(a, b, m);
  const bool a_holds = a.friction_at_rest() > a.friction,
             b_holds = b.friction_at_rest() > b.friction;
  if (!a_holds && !b_holds) return m;
  m.static_friction = std::sqrt(a.friction_at_rest() * b.friction_at_rest());
  m.stribeck_speed = std::max(a_holds ? a.stribeck_speed : 0.0, b_holds ? b.stribeck_speed : 0.0);
  return m;
}

double unequal(const Material& m) { return std::max(m.across_share(), 1.0 / m.across_share()); }

}  // namespace

Material combine_materials(const Material& a, const Material& b) {
  if (!a.is_directional() && !b.is_directional()) return combine_along(a, b);
  const bool second = unequal(b) > unequal(a);
  const Material other = (second ? a : b).without_direction();
  const Material& leader = second ? b : a;
  Material m = second ? combine_along(other, leader) : combine_along(leader, other);
  m.friction_axis = leader.friction_axis;
  m.friction_across = std::sqrt(leader.friction_across * other.friction);
  m.axis_of_second = second;
  return m;
}

Material Material::without_direction() const {
  Material m = *this;
  const double mean = std::sqrt(across_share());
  m.friction *= mean;
  m.static_friction *= mean;
  m.friction_axis.setZero();
  m.friction_across = 0.0;
  m.axis_of_second = false;
  return m;
}

SlidingFriction sliding_friction(const Material& material, double speed) {
  const double excess = material.friction_at_rest() - material.friction;
  if (!(excess > 0.0)) return {material.friction};
  const double ratio = speed / material.stribeck_speed, left = std::exp(-ratio * ratio);
  const double by_ratio = -2.0 * ratio * excess * left;
  return {material.friction + excess * left, by_ratio / material.stribeck_speed, left,
          -by_ratio * ratio / material.stribeck_speed};
}

}  // namespace counterpoint
