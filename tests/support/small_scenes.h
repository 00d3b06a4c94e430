// Scenes of a few bodies, built in memory, for tests with known answers.
#pragma once

#include "counterpoint/model/scene.h"

namespace counterpoint::test {

/// A free box of half lengths `half` [m], mass [kg] and uniform density, resting flat on the plane
/// z = 0 with the given friction and restitution; a leaning gravity makes a slope.
struct BoxOnPlane {
  Vector3 half = Vector3::Constant(0.1);
  double mass = 1.0;
  double friction = 0.5;
  double restitution = 0.0;
  double height = 0.0;  ///< gap between lower face and plane [m]
  Vector3 gravity = Vector3(0, 0, -9.81);
  bool ground = true;
};
Scene box_on_plane(const BoxOnPlane& box);

/// A pendulum about the world's y axis: a point mass [kg] at `length` [m] below the joint.
struct Pendulum {
  double mass = 1.0, length = 1.0, damping = 0.0, armature = 0.0, dry_friction = 0.0;
  double lower = -1e9, upper = 1e9;
  Drag drag = {};
  double gravity_compensation = 0.0;
};
Scene pendulum(const Pendulum& parameters);

/// A block of `mass` [kg] on a prismatic joint along the world's x axis, with dry friction [N];
/// gravity acts across. Its link is named "block".
struct Slider {
  double mass = 1.0, dry_friction = 0.0;
  double breakaway_friction = 0.0, stribeck_speed = 0.01;  ///< [N], [m/s]
  double stiffness = 0.0, reference = 0.0, damping = 0.0;
  ServoSpec servo = {};
  double effort_limit = std::numeric_limits<double>::infinity();
  double velocity_limit = std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};
Scene slider(const Slider& parameters);

/// A free ball of uniform density resting on the plane z = 0, or `height` [m] above it; both
/// surfaces have this material.
struct BallOnPlane {
  double radius = 0.1, mass = 1.0, height = 0.0;
  Material material = {};
  double gravity_compensation = 0.0;
};
Scene ball_on_plane(const BallOnPlane& parameters);

/// A free ball of uniform density and radius 0.1 m, in still air.
struct FreeBall {
  double mass = 1.0;
  Vector3 gravity = Vector3::Zero();
  Drag drag = {};
  double gravity_compensation = 0.0;
};
Scene free_ball(const FreeBall& parameters);

}  // namespace counterpoint::test
