// One parameter of a step, and what was found of it once.
#pragma once

#include <algorithm>
#include <optional>

#include "counterpoint/engine/derivatives/parameters/perturbed.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"
#include "counterpoint/engine/forces/free_flight.h"

namespace counterpoint {

/// Change of the inverse weights, a unit of a parameter.
struct WeightChange {
  VectorX contact, dof;
};

/// Bodies that fly (free_flight.h), with one figure changed.
struct ChangedFlight {
  explicit ChangedFlight(Model changed) : model(std::move(changed)), flight(model) {}
  Model model;
  FreeFlight flight;
};

struct PreparedParameter {
  /// @throws InputError where it has no such target.
  PreparedParameter(const StepParameter& parameter, const Model& model);

  StepParameter parameter;
  std::optional<WeightChange> weights;  ///< where the parameter changes M
  std::vector<ChangedFlight> flights;   ///< by flight_scheme, where it changes a body that flies
  DifferenceScheme flight_scheme;

  StepParameterKind kind() const { return parameter.kind; }
  bool has(int target) const {
    const auto& t = parameter.targets;
    return std::find(t.begin(), t.end(), target) != t.end();
  }
  /// kHeight: the direction in which it shifts a geometry that it has, in the geometry's axes.
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
