// Notes on a model, including the overlaps of its bodies in the default pose.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>

#include "counterpoint/collision/broadphase/default_poses.h"
#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/shapes/enclosure.h"

namespace counterpoint::collision {
namespace {

using Pair = std::pair<int, int>;

constexpr size_t kShown = 4;  // pairs named in a note; further ones are counted

/// Pairs that overlap by more than this share of the distance from the surface to the middle of the
/// thinner shape are reported. Preloaded grasps are not so deep, and a foot that starts so deep is
/// visibly pushed out.
constexpr double kDeep = 0.1;

std::string names(const Model& model, const Pair& pair) {
  return fmt::format("'{}' and '{}'", model.geometries()[pair.first].name,
                     model.geometries()[pair.second].name);
}

/// Joins items: "a; b; c; d; and 3 more".
std::string listed(const std::vector<std::string>& items) {
  std::string text;
  for (size_t i = 0; i < items.size() && i < kShown; ++i) text += (i > 0 ? "; " : "") + items[i];
  if (items.size() > kShown) text += fmt::format("; and {} more", items.size() - kShown);
  return text;
}

/// Distance from the surface of the thinner shape to its middle [m]; planes and terrain are
/// half-spaces.
double half_thickness(const Geometry& a, const Geometry& b) {
  double least = std::numeric_limits<double>::infinity();
  for (const Geometry* g : {&a, &b})
    if (g->shape.type != ShapeType::kPlane && g->shape.type != ShapeType::kTerrain)
      least = std::min(least, enclose(g->shape).thickness);
  return least;
}

/// Returns pairs that start deep inside each other with their depths [m], the deepest first.
std::vector<std::pair<double, Pair>> deep_pairs(const Model& model, Collider& collider) {
  const std::vector<Pose> X_WB = default_poses(model);
  std::vector<Candidate> touching;
  collider.compute_candidates(X_WB, std::vector<double>(X_WB.size(), 0.0), touching);
  std::map<Pair, double> depth;
  for (const Candidate& c : touching) {
    double& most = depth[{c.geometry_a, c.geometry_b}];
    most = std::max(most, -c.gap);
  }
  std::vector<std::pair<double, Pair>> deep;
  for (const auto& [pair, most] : depth)
    if (most >
        kDeep * half_thickness(model.geometries()[pair.first], model.geometries()[pair.second]))
      deep.emplace_back(most, pair);
  std::stable_sort(deep.begin(), deep.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  return deep;
}

}  // namespace

std::vector<Note> all_notes(const Model& model) {
  Collider collider(model);
  std::vector<Note> notes = model.notes();
  std::vector<std::string> apart, inside;
  for (const Pair& pair : collider.overlapping_pairs()) apart.push_back(names(model, pair));
  if (!apart.empty())
    notes.push_back(
        {"left out",
         fmt::format("links of one tree that overlap in the default pose never touch: {}. If they "
                     "should, name them in `pairs` of a scene file with collide: true (MJCF: "
                     "<pair>)",
                     listed(apart))});
  bool box = false;
  for (const auto& [depth, pair] : deep_pairs(model, collider)) {
    inside.push_back(fmt::format("{} by {:.3g} m", names(model, pair), depth));
    for (const int i : {pair.first, pair.second})
      box = box || model.geometries()[i].shape.type == ShapeType::kBox;
  }
  const char* const lengths =
      ": `box` of a scene file and of MJCF takes half lengths, <box> of URDF and SDF whole ones";
  if (!inside.empty())
    notes.push_back(
        {"start",
         fmt::format("bodies start deep inside each other and are pushed apart: {}. Check places "
                     "and sizes{}",
                     listed(inside), box ? lengths : "")});
  return notes;
}

}  // namespace counterpoint::collision
