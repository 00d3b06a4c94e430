// One parameter of a step, with the results that are found for it once.
#pragma once

#include <algorithm>
#include <optional>

#include "counterpoint/engine/derivatives/parameters/perturbed.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"
#include "counterpoint/engine/forces/free_flight.h"

namespace counterpoint {

/// Derivatives of the inverse weights by a parameter.
struct WeightChange {
  VectorX contact, dof, tendon;
};

/// Free bodies (free_flight.h) of a model with one parameter changed.
struct ChangedFlight {
  explicit ChangedFlight(Model changed) : model(std::move(changed)), flight(model) {}
  Model model;
  FreeFlight flight;
};

struct PreparedParameter {
  /// @throws InputError if a target does not exist.
  PreparedParameter(const StepParameter& parameter, const Model& model);

  StepParameter parameter;
  std::optional<WeightChange> weights;  ///< set if the parameter changes M
  std::vector<ChangedFlight> flights;   ///< per entry of flight_scheme; if it changes a free body
  DifferenceScheme flight_scheme;

  StepParameterKind kind() const { return parameter.kind; }
  bool has(int target) const {
    const auto& t = parameter.targets;
    return std::find(t.begin(), t.end(), target) != t.end();
  }
  /// kHeight: the direction in which it shifts one of its geometries, in the geometry's axes.
  Vector3 direction(int geometry) const {
    const auto& t = parameter.targets;
    const auto at = std::find(t.begin(), t.end(), geometry) - t.begin();
    return parameter.direction(static_cast<std::size_t>(at));
  }
};

inline bool changes_mass_matrix(StepParameterKind kind) {
  return kind == StepParameterKind::kInertia || kind == StepParameterKind::kArmature;
}

}  // namespace counterpoint
