// Parameters of a scene by name, to be set or identified: "friction", "mass:cube", "damping:elbow".
#pragma once

#include <string>
#include <vector>

#include "counterpoint/model/scene.h"

namespace counterpoint::apps {

enum class ParameterKind {
  kFriction,
  kRestitution,
  kTorsionalFriction,
  kRollingFriction,
  kMass,
  kInertia,
  kSize,
  kDamping,
  kDryFriction,
  kArmature,
  kGravity,
  kHeight,
  kCompliance,
  kSmoothing,
  kStabilization,
  kMaxRecoverySpeed,
};

/// One figure of a scene, and between which bounds it is looked for.
struct Parameter {
  ParameterKind kind = ParameterKind::kFriction;
  std::string name;  ///< as written: KIND or KIND:ELEMENT
  std::string unit;
  double lower = 0.0, upper = 0.0;
  bool logarithmic = false;  ///< looked for by its logarithm
  std::vector<int> targets;  ///< geometries, bodies or velocity coordinates, as the kind has it
};

/// KIND[:ELEMENT][=LOW..HIGH], comma separated, for this scene. Kinds, elements, units and default
/// bounds: docs/reference/recording-format.md. @throws InputError naming the part that is no such thing, and what
/// there is.
std::vector<Parameter> parse_parameters(const std::string& text, const Scene& scene);

/// Value of each in the scene; of several targets the mean.
VectorX parameter_values(const std::vector<Parameter>& parameters, const Scene& scene);

/// The scene with these values. @throws InputError for a value that no scene may have.
Scene with_parameters(const Scene& scene, const std::vector<Parameter>& parameters,
                      const VectorX& values);

/// KIND[:ELEMENT]=VALUE, comma separated: the scene with these values ("" leaves it as it is).
Scene with_settings(Scene scene, const std::string& text);

}  // namespace counterpoint::apps
