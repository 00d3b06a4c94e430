// Random kinematic trees, configurations and velocities; the same seed gives the same ones
// everywhere.
#pragma once

#include <cstdint>

#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::test {

/// A small random generator; standard distributions differ between libraries.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits();
  double uniform(double low, double high);
  int integer(int low, int high);  ///< both ends included
  Vector3 vector(double size);     ///< every component in -size ... size
  Vector3 unit_vector();
  Quaternion quaternion();  ///< uniform over rotations

 private:
  std::uint64_t state_;
};

struct RandomModelOptions {
  int links = 12;  ///< links per robot
  int robots = 1;
  Base base = Base::kFloating;
  bool single_axis_only = false;  ///< revolute and prismatic joints only (a floating base stays)
  double fixed_share = 0.15;      ///< share of fixed joints
  bool damping = false;
  bool armature = false;
  bool limits = false;
  bool dry_friction = false;
  bool springs = false;  ///< on joints with one coordinate
  bool servos = false;   ///< on joints with one coordinate
  bool effort_limits = false;
  bool drag = false;
  bool compensations = false;  ///< links compensate random shares of their weight
  bool mimics = false;         ///< some joints with one coordinate follow others of their robot
  int closures = 0;            ///< balls, welds and distances, closed in the default pose
  bool any_closures = false;   ///< closures of all types but screws; springs and ropes among them
  /// Tendons of random kind, with springs, dampers and servos; they need fixed_share 0.
  int tendons = 0;
  bool tendon_friction = false;  ///< dry friction and bounded servos of tendons
  /// Actuators of every law but muscles, on joints, tendons and links.
  int actuators = 0;
  bool tendon_limits = false;  ///< limits near the lengths in the default pose
};

/// Up to 13 links on up to three robots, alternately with fixed and floating bases.
inline RandomModelOptions varied_options(int seed) {
  RandomModelOptions o;
  o.links = 1 + seed % 13;
  o.robots = 1 + seed % 3;
  o.base = seed % 2 == 0 ? Base::kFloating : Base::kFixed;
  return o;
}

/// Every joint type, branches, rotated axes, offset and tilted inertias of real boxes.
RobotSpec make_random_robot(std::uint64_t seed, const RandomModelOptions& options = {});
/// Robots "0/", "1/", ..., apart from each other; a single robot has no prefix.
Model make_random_model(std::uint64_t seed, const RandomModelOptions& options = {});

/// A random model at a random configuration and velocity, drawn from `random` in this order.
Scene make_random_scene(std::uint64_t seed, const RandomModelOptions& options, Random& random);

/// Returns nq coordinates: quaternions of unit length, lengths within 1 m, angles within pi.
VectorX random_configuration(const Model& model, std::uint64_t seed);
VectorX random_vector(int size, std::uint64_t seed, double scale = 1.0);

/// Returns the inertia of a solid box with random sides, tilted, off the origin.
SpatialInertia random_inertia(Random& random);
Pose random_pose(Random& random, double size);

}  // namespace counterpoint::test
