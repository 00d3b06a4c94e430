// The kinds of parameters of identification: names, bounds, and what a value does to a scene.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "counterpoint/engine/estimate/estimate.h"

namespace counterpoint::estimation {

/// Elements of a scene that a kind belongs to, whose indices are Parameter::targets: geometries,
/// bodies, coordinates of v, bodies that joints move, springs, servos, actuators, world geometries;
/// kChannel: the recorded force of a joint.
enum class Target {
  kGeometries,
  kBody,
  kCoordinates,
  kJoints,
  kSprings,
  kServos,
  kActuators,
  kGround,
  kChannel,
  kNone
};

/// Meaning of the default bounds: values, multiples of the scene's value, or added to it.
enum class Bounds { kValues, kTimesScene, kAroundScene };

/// The member that a kind sets; none where it takes more than that.
using Field = std::variant<std::monostate, double Material::*, double JointSpring::*,
                           double JointServo::*, double Actuator::*, double ContactOptions::*>;

struct KindTraits {
  ParameterKind kind;
  const char* name;
  const char* unit;
  Target target;
  double lower, upper;  ///< default bounds
  bool logarithmic = false;
  Bounds bounds = Bounds::kValues;
  Field field = {};
};

/// @throws InputError that lists the kinds if there is none of this name
const KindTraits& kind_named(const std::string& name);
const KindTraits& kind_of(ParameterKind kind);
bool is_inertial(ParameterKind kind);
/// Whether a quantity changes its sign on the other side of a symmetric robot.
bool has_sign(ParameterKind kind);

/// An element and its indices.
struct NamedTargets {
  std::string name;
  std::vector<int> targets;
};
std::vector<NamedTargets> elements_of(Target target, const Model& model);

/// Indices of the elements of a kind that a user names. @throws InputError with those there are.
std::vector<int> targets_of(const KindTraits& kind, const std::string& element, const Model& model);

/// Value of a parameter in the scene, for one of its targets.
double value_at(ParameterKind kind, const Scene& scene, int target);
/// Returns the pose of a moving body's link, with the axes of its file, in the body frame.
Pose link_pose(const Model& model, int body);
/// Returns the inertia of a body after an inertial parameter, or its size, has taken a value. link:
/// link_pose, whose axes centres, spreads and shears refer to.
SpatialInertia with_value(ParameterKind kind, double value, const SpatialInertia& inertia,
                          const Pose& link);
/// Sets the parameter for one target.
void set_target(ParameterKind kind, int target, double value, const Model& model,
                ModelEditor& editor);
/// Sets a parameter that belongs to the whole scene, or to no part of it. Returns false for kinds
/// with targets.
bool set_scene(ParameterKind kind, double value, Model& model, SimulationOptions& options);
/// Sets a parameter of the scene. @throws InputError for a value outside the range that it allows.
void set_parameter(const Parameter& parameter, double value, Model& model,
                   SimulationOptions& options);

}  // namespace counterpoint::estimation
