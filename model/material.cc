#include "counterpoint/model/material.h"

#include <algorithm>
#include <cmath>

namespace counterpoint {
namespace {

Spring point_spring(const Material& m) { return {m.stiffness, m.damping, m.dissipation}; }

void combine_springs(const Material& a, const Material& b, Material& m) {
  const Spring point = in_series(point_spring(a), point_spring(b));
  m.stiffness = point.stiffness;
  m.damping = point.damping;
  m.dissipation = point.dissipation;
  m.per_area = in_series(a.per_area, b.per_area);
  if (m.is_soft()) m.restitution = 0.0;
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

Spring in_series(const Spring& a, const Spring& b) {
  if (!b.is_soft()) return a;
  if (!a.is_soft()) return b;
  const double share_a = b.stiffness / (a.stiffness + b.stiffness), share_b = 1.0 - share_a;
  const double square_a = share_a * share_a, square_b = share_b * share_b;
  return {share_a * a.stiffness, square_a * a.damping + square_b * b.damping,
          square_a * a.dissipation + square_b * b.dissipation};
}

Spring Material::spring_of(double area) const {
  if (!per_area.is_soft()) return point_spring(*this);
  const double covered = std::max(area, kLeastPatchArea);
  return in_series(point_spring(*this), {covered * per_area.stiffness, covered * per_area.damping,
                                         per_area.dissipation});
}

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

SlidingFriction friction_curve(double sliding, double at_rest, double stribeck_speed,
                               double speed) {
  const double excess = at_rest - sliding;
  const double ratio = speed / stribeck_speed, left = std::exp(-ratio * ratio);
  const double by_ratio = -2.0 * ratio * excess * left;
  return {sliding + excess * left, by_ratio / stribeck_speed, left,
          -by_ratio * ratio / stribeck_speed};
}

SlidingFriction sliding_friction(const Material& material, double speed) {
  const double at_rest = material.friction_at_rest();
  if (!(at_rest > material.friction)) return {material.friction};
  return friction_curve(material.friction, at_rest, material.stribeck_speed, speed);
}

}  // namespace counterpoint
