// A model, and clips of its motion, as the JSON of a replay.
#pragma once

#include <nlohmann/json.hpp>

#include "view/curves.h"
#include "view/replay.h"

namespace counterpoint::view {

using Json = nlohmann::ordered_json;

/// Bodies, frames, shapes and visuals, meshes, closures into `out`.
void pack_model(const Model& model, const Visuals& visuals, Json& out);

/// How far a body's shapes, or without any its centre of mass, reach from its origin [m], by body;
/// the world's stays 0.
std::vector<double> drawn_radii(const Model& model);

/// A ball around all that moves, at any time of the clip: what the camera looks at.
struct Ball {
  Vector3 center = Vector3::Zero();
  double radius = 1.0;  ///< [m]
};
Ball bounds(const Model& model, const Clip& clip);

Json pack_clip(const Model& model, const Clip& clip, const Resolution& resolution);
Json pack_contacts(const Model& model, const Clip& clip, const Resolution& resolution);
Json pack_closure_forces(const Model& model, const Clip& clip, const Resolution& resolution);
Json pack_curves(const std::vector<Curve>& curves);

}  // namespace counterpoint::view
