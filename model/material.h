// Materials of surfaces: friction, restitution, stiffness.
#pragma once

#include <limits>
#include <optional>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

/// Spring and damper at a contact: of a point, or per area of a patch (units in brackets).
struct Spring {
  double stiffness = std::numeric_limits<double>::infinity();  ///< [N/m] ([N/m^3])
  double damping = 0.0;                                        ///< linear [N s/m] ([N s/m^3])
  double dissipation = 0.0;  ///< Hunt and Crossley's, F = k d (1 + dissipation d') [s/m]

  /// Whether it yields: its stiffness is finite.
  bool is_soft() const { return stiffness < std::numeric_limits<double>::infinity(); }
};
/// Returns two springs in series, each with its damper: a surface takes the share k_other / (k_a +
/// k_b) of the deformation and of its speed, and dampers count with the square of that share.
Spring in_series(const Spring& a, const Spring& b);

/// Area [m^2] that a contact point stands for at least, where its patch has less.
inline constexpr double kLeastPatchArea = 1e-8;

/// Surface material. The values of a pair of surfaces follow from combine_materials.
struct Material {
  double friction = 0.8;            ///< coefficient of sliding (Coulomb) friction [-]
  double restitution = 0.0;         ///< Newton's coefficient of restitution, 0 ... 1 [-]
  double torsional_friction = 0.0;  ///< torque about the normal / normal force [m]
  double rolling_friction = 0.0;    ///< rolling torque / normal force [m]
  double static_friction = 0.0;     ///< coefficient at rest [-]; `friction` where that is larger
  /// Sliding speed [m/s] at which 1 / e of the excess of static friction is left.
  double stribeck_speed = 0.01;
  double stiffness = std::numeric_limits<double>::infinity();  ///< that of a contact point [N/m]
  double damping = 0.0;      ///< linear, at a contact point with finite stiffness [N s/m]
  double dissipation = 0.0;  ///< see Spring [s/m]
  Spring per_area = {};      ///< spring and damper of the unit of area, for flat contacts
  /// Direction in the geometry frame along which `friction` acts, of any length; zero: all
  /// directions are alike.
  Vector3 friction_axis = Vector3::Zero();
  double friction_across = 0.0;  ///< coefficient across friction_axis, in the surface [-]
  /// Pair: friction_axis is in the frame of the second geometry, the one of the higher index.
  bool axis_of_second = false;
  /// Velocity of the surface relative to its body (a belt), in the geometry frame [m/s]; its part
  /// along the normal of a contact does not count. A pair has none: each surface keeps its own.
  Vector3 surface_velocity = Vector3::Zero();

  /// Returns the coefficient at rest, the largest one at any speed [-].
  double friction_at_rest() const {
    return friction > 0.0 && static_friction > friction ? static_friction : friction;
  }
  /// Whether the surface yields like a spring: a stiffness is finite.
  bool is_soft() const {
    return stiffness < std::numeric_limits<double>::infinity() || per_area.is_soft();
  }
  /// Returns the spring of a contact point that stands for an area [m^2] of its patch
  /// (collision::Candidate::area): that of the point in series with that of the area.
  Spring spring_of(double area) const;
  bool is_directional() const {
    return friction > 0.0 && friction_across != friction && !friction_axis.isZero(0.0);
  }
  /// Returns the ratio of the coefficients across the axis and along it, at every speed [-].
  double across_share() const { return is_directional() ? friction_across / friction : 1.0; }
  /// Returns the largest coefficient at any speed in any direction [-].
  double most_friction() const {
    const double across = across_share();
    return across > 1.0 ? across * friction_at_rest() : friction_at_rest();
  }
  /// Returns this surface with the geometric mean of its two coefficients in all directions.
  Material without_direction() const;
};

/// Stiffness [N/m] from which on that of a robot's file counts as hard. Gazebo's default is 1e12.
inline constexpr double kHardStiffness = 1e9;
/// Whether a stiffness that a robot's file gives [N/m] is that of a spring.
inline bool is_spring(const std::optional<double>& stiffness) {
  return stiffness && *stiffness > 0.0 && *stiffness < kHardStiffness;
}

/// Friction at a sliding speed, and its derivatives: a coefficient [-] of a surface, or a force
/// [N, N m] of a joint.
struct SlidingFriction {
  double value = 0.0;
  double by_speed = 0.0;  ///< per [m/s, rad/s]
  /// Derivative by the friction at rest [-]; that by the friction of sliding is the rest to 1.
  double by_static = 0.0;
  double by_stribeck_speed = 0.0;  ///< per [m/s, rad/s]
};
/// Returns sliding + (at_rest - sliding) exp(-(speed / stribeck_speed)^2), speeds [m/s, rad/s] (Bo
/// and Pavelescu 1982, "The friction-speed relation and its influence on the critical velocity of
/// stick-slip motion"; Stribeck 1902).
SlidingFriction friction_curve(double sliding, double at_rest, double stribeck_speed, double speed);
/// Returns friction_curve of the coefficients of a surface.
SlidingFriction sliding_friction(const Material& material, double speed);

/// Returns the material of a pair: the geometric mean of the sliding frictions (MuJoCo takes the
/// maximum, Bullet the product, ODE one value per pair) and the larger restitution, torsional and
/// rolling friction (the last two as in MuJoCo). Static frictions combine like sliding ones, and
/// the larger Stribeck speed of the surfaces with static friction counts. If both surfaces have a
/// friction axis, the one with the more unequal coefficients keeps it. Springs are in series
/// (in_series), those of points and those of areas each among themselves. A pair with finite
/// stiffness has no restitution: its springs and dampers make it bounce. Torsional and rolling
/// friction act only with sliding friction; if that is zero on one side, the pair has no friction
/// at all.
Material combine_materials(const Material& a, const Material& b);

}  // namespace counterpoint
