// The kinds of parameters of identification: names, bounds, and what a value does to a scene.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/estimate/estimate.h"

namespace counterpoint::estimation {

/// Elements of a scene that a kind belongs to; kChannel: the recorded force of a joint.
enum class Target { kGeometries, kBody, kCoordinates, kGround, kChannel, kNone };

/// Meaning of the default bounds: values, multiples of the scene's value, or added to it.
enum class Bounds { kValues, kTimesScene, kAroundScene };

struct KindTraits {
  ParameterKind kind;
  const char* name;
  const char* unit;
  Target target;
  double lower, upper;  ///< default bounds
  bool logarithmic = false;
  Bounds bounds = Bounds::kValues;
};

/// @throws InputError that lists the kinds if there is none of this name
const KindTraits& kind_named(const std::string& name);
const KindTraits& kind_of(ParameterKind kind);
bool is_inertial(ParameterKind kind);
/// Whether a quantity changes its sign on the other side of a symmetric robot.
bool has_sign(ParameterKind kind);

/// Indices of the elements of a kind that a user names. @throws InputError with those there are.
std::vector<int> targets_of(const KindTraits& kind, const std::string& element, const Model& model);

/// Value of a parameter in the scene, for one of its targets.
double value_at(ParameterKind kind, const Scene& scene, int target);
/// The inertia of a body after an inertial parameter, or its size, has taken a value.
SpatialInertia with_value(ParameterKind kind, double value, const SpatialInertia& inertia);
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
