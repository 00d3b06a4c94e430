// Energy of a whole scene, for reports.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/state.h"

namespace counterpoint::apps {

/// Springs of soft surfaces (Material::stiffness). Scratch memory inside: one per thread.
class SurfaceSprings {
 public:
  /// Makes no collider if no surface is soft: energy() is then 0.
  explicit SurfaceSprings(const Model& model);
  /// Energy of the overlaps at q (nq), k d^2 / 2 for each point [J].
  double energy(const VectorX& q);

 private:
  const Model& model_;
  std::optional<collision::Collider> collider_;
  std::vector<double> margin_;
  std::vector<collision::Candidate> candidates_;
};

/// Whether parts of the scene do work by themselves: servos of joints and tendons, actuators, and
/// surfaces that move on their bodies (Material::surface_velocity).
bool has_drives(const Model& model);

/// Kinetic plus potential energy, including springs of joints and surfaces [J].
double total_energy(const Model& model, const State& state);

}  // namespace counterpoint::apps
