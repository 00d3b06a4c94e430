#include <algorithm>
#include <cmath>

#include "counterpoint/collision/collider_impl.h"

namespace counterpoint::collision {
namespace {

bool meet(const Bounds& a, const Bounds& b) {
  return (a.low.array() <= b.high.array()).all() && (b.low.array() <= a.high.array()).all();
}

}  // namespace

void Collider::Impl::place(std::span<const Pose> X_WB, std::span<const double> margin) {
  X_WG.resize(geometries.size());
  for (std::size_t i = 0; i < geometries.size(); ++i) {
    if (is_idle(static_cast<int>(i))) continue;
    X_WG[i] = X_WB[placements[i].body] * placements[i].X_BG;
  }
  boxes.resize(solids.size());
  for (std::size_t k = 0; k < solids.size(); ++k) {
    const int i = solids[k];
    if (is_idle(i)) continue;
    const Bounds box =
        bounds(placements[i].type, enclosures[i], X_WG[i], margin[placements[i].body]);
    boxes[k] = is_sound(box) ? box : kNowhere;
  }
}

void Collider::Impl::add_plane_pairs(int plane, std::span<const double> margin) {
  const Vector3 normal = X_WG[plane].rotation.col(2);
  const double offset = normal.dot(X_WG[plane].translation);
  const double plane_margin = margin[geometries[plane].body];
  if (!std::isfinite(offset)) return;
  const Vector3 up = normal.cwiseMax(0.0), down = normal.cwiseMin(0.0);
  for (std::size_t k = 0; k < solids.size(); ++k) {
    // Test the lowest corner of the box (which includes the solid's margin) first: most boxes are
    // far above.
    if (up.dot(boxes[k].low) + down.dot(boxes[k].high) >= offset + plane_margin) continue;
    const int i = solids[k];
    if (both_idle(plane, i)) continue;
    const double height = normal.dot(X_WG[i] * enclosures[i].center) - offset;
    const double reach =
        std::min(enclosures[i].radius,
                 (X_WG[i].rotation.transpose() * normal).cwiseAbs().dot(enclosures[i].half));
    if (height - reach >= plane_margin + margin[placements[i].body]) continue;
    if (filter.enabled(plane, i)) ground_pairs.emplace_back(std::min(plane, i), std::max(plane, i));
  }
}

// Adds pairs with a terrain, which in the broad phase would be a neighbour of every solid.
void Collider::Impl::add_terrain_pairs(int terrain, std::span<const double> margin) {
  const Geometry& g = geometries[terrain];
  const Bounds all = bounds(g.shape.type, enclosures[terrain], X_WG[terrain], margin[g.body]);
  if (!is_sound(all)) return;
  for (std::size_t k = 0; k < solids.size(); ++k) {
    const int i = solids[k];
    if (both_idle(terrain, i)) continue;
    if ((boxes[k].low.array() > all.high.array()).any() ||
        (boxes[k].high.array() < all.low.array()).any()) {
      continue;
    }
    if (filter.enabled(terrain, i))
      ground_pairs.emplace_back(std::min(terrain, i), std::max(terrain, i));
  }
}

// Groups solids by body in models of few bodies with many solids, such as robots: the boxes of
// whole bodies are then tested before those of their solids.
void Collider::Impl::group_by_body(const Model& model) {
  constexpr std::size_t kMostBodies = 32, kMostSolids = 128;
  if (solids.size() > kMostSolids) return;
  std::vector<std::vector<int>> of_body(static_cast<std::size_t>(model.num_bodies()));
  for (int k = 0; k < static_cast<int>(solids.size()); ++k)
    of_body[static_cast<std::size_t>(placements[solids[k]].body)].push_back(k);
  std::erase_if(of_body, [](const std::vector<int>& list) { return list.empty(); });
  if (of_body.size() > kMostBodies) return;
  begin_of_body = {0};
  for (const std::vector<int>& list : of_body) {
    by_body.insert(by_body.end(), list.begin(), list.end());
    begin_of_body.push_back(static_cast<int>(by_body.size()));
  }
  const auto num_solids = static_cast<int>(solids.size());
  enabled_solids.resize(solids.size() * solids.size());
  for (int k = 0; k < num_solids; ++k)
    for (int l = 0; l < num_solids; ++l)
      enabled_solids[k * num_solids + l] = filter.enabled(solids[k], solids[l]);
  const auto enabled = [&](int k, int l) { return enabled_solids[k * num_solids + l] != 0; };
  for (std::size_t i = 0; i < of_body.size(); ++i) {
    for (std::size_t j = i + 1; j < of_body.size(); ++j) {
      const bool any = std::any_of(of_body[i].begin(), of_body[i].end(), [&](int k) {
        return std::any_of(of_body[j].begin(), of_body[j].end(),
                           [&](int l) { return enabled(k, l); });
      });
      if (any) body_pairs.emplace_back(i, j);
    }
  }
  body_boxes.resize(of_body.size());
}

void Collider::Impl::find_pairs_by_body() {
  for (std::size_t i = 0; i < body_boxes.size(); ++i) {
    Bounds all = kNowhere;
    for (int at = begin_of_body[i]; at < begin_of_body[i + 1]; ++at) {
      const Bounds& box = boxes[by_body[at]];
      all.low = all.low.cwiseMin(box.low);
      all.high = all.high.cwiseMax(box.high);
    }
    body_boxes[i] = all;
  }
  solid_pairs.clear();
  const auto num_solids = static_cast<int>(solids.size());
  for (const auto& [i, j] : body_pairs) {
    if (!meet(body_boxes[i], body_boxes[j])) continue;
    for (int at = begin_of_body[i]; at < begin_of_body[i + 1]; ++at) {
      const int k = by_body[at];
      if (!meet(boxes[k], body_boxes[j])) continue;
      for (int to = begin_of_body[j]; to < begin_of_body[j + 1]; ++to) {
        const int l = by_body[to];
        if (enabled_solids[k * num_solids + l] && meet(boxes[k], boxes[l]))
          solid_pairs.emplace_back(std::min(k, l), std::max(k, l));
      }
    }
  }
  std::sort(solid_pairs.begin(), solid_pairs.end());
}

// Lists the solids that are not idle. True if they are few enough to test each against all others.
bool Collider::Impl::list_awake() {
  constexpr std::size_t kFew = 32;  // equal to kFewestForGrid (broadphase.cc)
  if (idle.empty()) return false;
  awake.clear();
  for (std::size_t k = 0; k < solids.size(); ++k) {
    if (is_idle(solids[k])) continue;
    if (awake.size() == kFew) return false;
    awake.push_back(static_cast<int>(k));
  }
  return true;
}

// Finds the pairs that the broad phase would find, without pairs of two idle solids.
void Collider::Impl::find_awake_pairs() {
  solid_pairs.clear();
  for (const int k : awake) {
    const Bounds& box = boxes[k];
    for (int l = 0; l < static_cast<int>(solids.size()); ++l) {
      if (!meet(box, boxes[l])) continue;
      // A pair of two awake solids is added by the one of lower index.
      if (l != k && (l > k || is_idle(solids[l])))
        solid_pairs.emplace_back(std::min(k, l), std::max(k, l));
    }
  }
  std::sort(solid_pairs.begin(), solid_pairs.end());
}

// Finds the enabled pairs whose bounding volumes come within the margins, ascending.
void Collider::Impl::find_pairs(std::span<const double> margin) {
  bool all_enabled = false;
  if (list_awake()) {
    find_awake_pairs();
  } else if (!body_boxes.empty()) {
    find_pairs_by_body();
    all_enabled = true;
  } else {
    broadphase.find_pairs(boxes, solid_pairs);
  }
  pairs.clear();
  for (const auto& [k, l] : solid_pairs) {
    if (both_idle(solids[k], solids[l])) continue;
    if (all_enabled || filter.enabled(solids[k], solids[l]))
      pairs.emplace_back(solids[k], solids[l]);
  }
  for (const int plane : planes) {
    add_plane_pairs(plane, margin);
    merge_ground_pairs();
  }
  for (const int terrain : terrains) {
    add_terrain_pairs(terrain, margin);
    merge_ground_pairs();
  }
}

// Merges ground_pairs into pairs, both ascending, from the end, so that no pair is overwritten
// before it is moved.
void Collider::Impl::merge_ground_pairs() {
  auto from = static_cast<std::ptrdiff_t>(pairs.size());
  pairs.resize(pairs.size() + ground_pairs.size());
  auto to = pairs.rbegin();
  for (auto next = ground_pairs.rbegin(); next != ground_pairs.rend(); ++to) {
    *to = from > 0 && pairs[from - 1] > *next ? pairs[--from] : *next++;
  }
  ground_pairs.clear();
}

}  // namespace counterpoint::collision
