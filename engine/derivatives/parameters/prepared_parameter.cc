#include "counterpoint/engine/derivatives/parameters/prepared_parameter.h"

namespace counterpoint {
namespace {

using K = StepParameterKind;

WeightChange weight_change(const StepParameter& parameter, const Model& model) {
  std::array<InverseWeights, 4> at;
  SimulationOptions none;
  const DifferenceScheme scheme = difference_scheme(parameter, model, none);
  for (size_t i = 0; i < at.size(); ++i) {
    Model changed = model;
    change_parameter(parameter, scheme.at[i], changed, none);
    Data data(changed);
    at[i] = compute_inverse_weights(changed, data);
  }
  const auto by = [&](auto member) {
    return scheme(std::array{member(at[0]), member(at[1]), member(at[2]), member(at[3])});
  };
  WeightChange out;
  const auto vector = [](const std::vector<double>& numbers) {
    return VectorX(
        Eigen::Map<const VectorX>(numbers.data(), static_cast<Eigen::Index>(numbers.size())));
  };
  out.contact = by([&](const InverseWeights& w) { return vector(w.contact); });
  out.tendon = by([&](const InverseWeights& w) { return vector(w.tendon); });
  out.dof = by([](const InverseWeights& w) { return VectorX(w.dof); });
  return out;
}

void check_targets(const StepParameter& parameter, const Model& model) {
  int begin = 0, end = 0;
  switch (parameter.kind) {
    case K::kInertia:
      begin = 1;
      end = model.num_bodies();
      break;
    case K::kDamping:
    case K::kDryFriction:
    case K::kBreakawayFriction:
    case K::kStribeckSpeed:
    case K::kArmature:
      end = model.nv();
      break;
    default:
      end = static_cast<int>(model.geometries().size());
  }
  for (const int target : parameter.targets)
    if (target < begin || target >= end)
      throw InputError("parameter of a step: there is no target " + std::to_string(target));
  if (parameter.kind == K::kInertia && parameter.changes.size() != parameter.targets.size())
    throw InputError("parameter of a step: inertia needs a change for each target");
}

}  // namespace

PreparedParameter::PreparedParameter(const StepParameter& p, const Model& model) : parameter(p) {
  check_targets(parameter, model);
  if (changes_mass_matrix(kind())) weights = weight_change(parameter, model);
  if (kind() != K::kInertia) return;
  const FreeFlight flight(model);
  bool flies = false;
  for (int n = 0; n < flight.num_flyers(); ++n) flies = flies || has(flight.body(n));
  if (!flies) return;
  SimulationOptions none;
  flight_scheme = difference_scheme(parameter, model, none);
  for (const double by : flight_scheme.at) {
    Model changed = model;
    change_parameter(parameter, by, changed, none);
    flights.emplace_back(std::move(changed));
  }
}

}  // namespace counterpoint
