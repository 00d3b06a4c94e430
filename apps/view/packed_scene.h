// A model and clips of its motion, as the JSON data of a replay.
#pragma once

#include <nlohmann/json.hpp>

#include "view/curves.h"
#include "view/replay.h"

namespace counterpoint::view {

using Json = nlohmann::ordered_json;

/// Writes bodies, frames, shapes, visuals, meshes and closures to `out`.
void pack_model(const Model& model, const Visuals& visuals, Json& out);

/// Distance [m] from each body's origin to the farthest point of its shapes, or to its centre of
/// mass if it has none; 0 for the world.
std::vector<double> drawn_radii(const Model& model);

/// A ball around all moving bodies over the whole clip, for the initial camera.
struct Ball {
  Vector3 center = Vector3::Zero();
  double radius = 1.0;  ///< [m]
};
Ball bounds(const Model& model, const Clip& clip);

/// Whether the joint of a body, of one coordinate, is within a thousandth of its range of a limit.
bool is_at_limit(const Model& model, int body, const VectorX& q);

Json pack_clip(const Model& model, const Clip& clip, const Resolution& resolution);
Json pack_contacts(const Model& model, const Clip& clip, const Resolution& resolution);
Json pack_closure_forces(const Model& model, const Clip& clip, const Resolution& resolution);
Json pack_curves(const std::vector<Curve>& curves);

}  // namespace counterpoint::view
