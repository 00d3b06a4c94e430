#include <algorithm>
#include <cmath>
#include <cstdint>

#include "counterpoint/collision/collider_impl.h"

namespace counterpoint::collision {
namespace {

// Number of groups up to which all pairs are tested; equal to kFewestForGrid (broadphase.cc).
constexpr std::size_t kFewGroups = 32;

// A pair of indices as one number, which sorts faster.
std::uint64_t key_of(int first, int second) {
  return static_cast<std::uint64_t>(first) << 32 | static_cast<std::uint32_t>(second);
}

}  // namespace

// Divides the solids of each body into groups of kGroup at most: where a body has more, at the
// median along the widest extent of their centres. The world's solids, which may be anywhere, are
// groups of their own.
void Collider::Impl::group_solids(const Model& model) {
  constexpr std::ptrdiff_t kGroup = 8;
  std::vector<std::vector<int>> of_body(static_cast<std::size_t>(model.num_bodies()));
  for (int k = 0; k < static_cast<int>(solids.size()); ++k)
    of_body[static_cast<std::size_t>(placements[solids[k]].body)].push_back(k);
  const auto center = [&](int k) -> Vector3 {
    return placements[solids[k]].X_BG * enclosures[solids[k]].center;
  };
  const auto divide = [&](auto& self, int body, std::span<int> part) -> void {
    const auto size = static_cast<std::ptrdiff_t>(part.size());
    if (size > (body == 0 ? 1 : kGroup)) {
      Vector3 low = center(part[0]), high = low;
      for (const int k : part) {
        low = low.cwiseMin(center(k));
        high = high.cwiseMax(center(k));
      }
      int axis = 0;
      (high - low).maxCoeff(&axis);
      const std::ptrdiff_t half = size / 2;
      std::nth_element(part.begin(), part.begin() + half, part.end(), [&](int k, int l) {
        return std::pair(center(k)[axis], k) < std::pair(center(l)[axis], l);
      });
      self(self, body, part.first(static_cast<std::size_t>(half)));
      self(self, body, part.subspan(static_cast<std::size_t>(half)));
      return;
    }
    if (part.empty()) return;
    const auto begin = static_cast<int>(members.size());
    members.insert(members.end(), part.begin(), part.end());
    groups.push_back({body, begin, static_cast<int>(members.size()), enclose_group(part)});
  };
  for (int body = 0; body < model.num_bodies(); ++body)
    divide(divide, body, of_body[static_cast<std::size_t>(body)]);
  group_boxes.assign(groups.size(), kNowhere);
  placed.assign(groups.size(), 0);
}

// Returns a box in the frame of the body around the boxes of several of its solids.
Enclosure Collider::Impl::enclose_group(std::span<const int> part) const {
  Bounds all = kNowhere;
  for (const int k : part) {
    const Enclosure& e = enclosures[solids[k]];
    const Pose& X = placements[solids[k]].X_BG;
    const Vector3 middle = X * e.center;
    const Vector3 half = X.rotation.cwiseAbs() * e.half;
    all.low = all.low.cwiseMin(middle - half);
    all.high = all.high.cwiseMax(middle + half);
  }
  Enclosure out;
  out.center = 0.5 * (all.low + all.high);
  out.half = 0.5 * (all.high - all.low);
  out.radius = out.half.norm();
  return out;
}

// Places the groups, and of these the ones of a single solid; others are placed when they come near
// anything (place_group).
void Collider::Impl::place() {
  for (const std::vector<int>* list : {&planes, &terrains})
    for (const int i : *list)
      if (!is_idle(i)) X_WG[i] = body_poses[placements[i].body] * placements[i].X_BG;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Group& group = groups[g];
    if (is_idle_body(group.body)) continue;
    placed[g] = 0;
    if (group.end - group.begin == 1) {
      place_group(static_cast<int>(g));
      group_boxes[g] = boxes[members[group.begin]];
      continue;
    }
    const Bounds box =
        bounds(ShapeType::kConvexMesh, group.around, body_poses[group.body], margins[group.body]);
    group_boxes[g] = is_sound(box) ? box : kNowhere;
  }
}

// Places the solids of a group, once in a search.
void Collider::Impl::place_group(int g) {
  if (placed[g]) return;
  placed[g] = 1;
  const Group& group = groups[g];
  const Pose& X = body_poses[group.body];
  for (const int k : members_of(group)) {
    const int i = solids[k];
    X_WG[i] = X * placements[i].X_BG;
    const Bounds box = bounds(placements[i].type, enclosures[i], X_WG[i], margins[group.body]);
    boxes[k] = is_sound(box) ? box : kNowhere;
  }
}

void Collider::Impl::add_plane_pairs(int plane) {
  const Vector3 normal = X_WG[plane].rotation.col(2);
  const double offset = normal.dot(X_WG[plane].translation);
  const double plane_margin = margins[geometries[plane].body];
  if (!std::isfinite(offset)) return;
  const Vector3 up = normal.cwiseMax(0.0), down = normal.cwiseMin(0.0);
  // Tests the lowest corner of a box (which includes the margin of its body) first: most boxes are
  // far above.
  const auto is_above = [&](const Bounds& box) {
    return up.dot(box.low) + down.dot(box.high) >= offset + plane_margin;
  };
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Group& group = groups[g];
    if (is_above(group_boxes[g]) || (is_idle(plane) && is_idle_body(group.body))) continue;
    place_group(static_cast<int>(g));
    for (const int k : members_of(group)) {
      if (is_above(boxes[k])) continue;
      const int i = solids[k];
      const double height = normal.dot(X_WG[i] * enclosures[i].center) - offset;
      const double reach =
          std::min(enclosures[i].radius,
                   (X_WG[i].rotation.transpose() * normal).cwiseAbs().dot(enclosures[i].half));
      if (height - reach >= plane_margin + margins[group.body]) continue;
      add_ground_pair(plane, i);
    }
  }
}

void Collider::Impl::add_ground_pair(int ground, int solid) {
  if (filter.enabled(ground, solid))
    ground_pairs.emplace_back(std::min(ground, solid), std::max(ground, solid));
}

// Adds pairs with a terrain, which in the broad phase would be a neighbour of every solid.
void Collider::Impl::add_terrain_pairs(int terrain) {
  const Geometry& ground = geometries[terrain];
  const Bounds all =
      bounds(ground.shape.type, enclosures[terrain], X_WG[terrain], margins[ground.body]);
  if (!is_sound(all)) return;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Group& group = groups[g];
    if (!meet(group_boxes[g], all) || (is_idle(terrain) && is_idle_body(group.body))) continue;
    place_group(static_cast<int>(g));
    for (const int k : members_of(group))
      if (meet(boxes[k], all)) add_ground_pair(terrain, solids[k]);
  }
}

// Lists the pairs of groups with an enabled pair of solids, if there are few groups: testing the
// boxes of each pair then takes less than a broad phase.
void Collider::Impl::list_group_pairs() {
  if (groups.size() > kFewGroups) return;
  for (int i = 0; i < static_cast<int>(groups.size()); ++i) {
    for (int j = i + 1; j < static_cast<int>(groups.size()); ++j) {
      const auto ours = members_of(groups[i]), theirs = members_of(groups[j]);
      std::size_t enabled = 0;
      for (const int k : ours)
        for (const int l : theirs) enabled += filter.enabled(solids[k], solids[l]);
      if (enabled > 0) group_pairs.push_back({i, j, enabled == ours.size() * theirs.size()});
    }
  }
  group_pairs_listed = true;
}

// Adds the enabled pairs of solids of two groups, whose boxes meet, with boxes that meet.
// all_enabled: the filter enables all of them.
void Collider::Impl::add_solid_pairs(int i, int j, bool all_enabled) {
  const Group &a = groups[i], &b = groups[j];
  if (is_idle_body(a.body) && is_idle_body(b.body)) return;
  place_group(i);
  place_group(j);
  for (const int k : members_of(a)) {
    if (!meet(boxes[k], group_boxes[j])) continue;
    for (const int l : members_of(b))
      if (meet(boxes[k], boxes[l]) && (all_enabled || filter.enabled(solids[k], solids[l])))
        solid_pairs.push_back(key_of(std::min(k, l), std::max(k, l)));
  }
}

// Same, for groups that the broad phase found: bodies joined by a joint, or the same, are common.
void Collider::Impl::add_found_pair(int i, int j) {
  const int k = solids[members[groups[i].begin]], l = solids[members[groups[j].begin]];
  if (filter.has_included() || filter.enabled_by_structure(k, l)) add_solid_pairs(i, j, false);
}

// Lists the groups that are not idle. True if they are few enough to test each against all others.
bool Collider::Impl::list_awake() {
  if (idle.empty()) return false;
  awake.clear();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (is_idle_body(groups[g].body)) continue;
    if (awake.size() == kFewGroups) return false;
    awake.push_back(static_cast<int>(g));
  }
  return true;
}

// Finds the pairs that the broad phase would find, without pairs of two idle groups.
void Collider::Impl::add_awake_pairs() {
  for (const int g : awake) {
    const Bounds& box = group_boxes[g];
    for (int other = 0; other < static_cast<int>(groups.size()); ++other) {
      if (!meet(box, group_boxes[other])) continue;
      // A pair of two awake groups is added by the one of lower index.
      if (other > g || (other != g && is_idle_body(groups[other].body))) add_found_pair(g, other);
    }
  }
}

// Finds the enabled pairs whose bounding volumes come within the margins, ascending.
void Collider::Impl::find_pairs() {
  solid_pairs.clear();
  if (list_awake()) {
    add_awake_pairs();
  } else if (group_pairs_listed) {
    for (const auto& [i, j, all_enabled] : group_pairs)
      if (meet(group_boxes[i], group_boxes[j])) add_solid_pairs(i, j, all_enabled);
  } else {
    broadphase.find_pairs(group_boxes, near_groups);
    for (const auto& [i, j] : near_groups) add_found_pair(i, j);
  }
  std::sort(solid_pairs.begin(), solid_pairs.end());
  pairs.clear();
  for (const std::uint64_t key : solid_pairs)
    pairs.emplace_back(solids[key >> 32], solids[static_cast<std::uint32_t>(key)]);
  for (const int plane : planes) {
    add_plane_pairs(plane);
    merge_ground_pairs();
  }
  for (const int terrain : terrains) {
    add_terrain_pairs(terrain);
    merge_ground_pairs();
  }
}

// Merges ground_pairs, sorted, into pairs, ascending, from the end, so that no pair is overwritten
// before it is moved.
void Collider::Impl::merge_ground_pairs() {
  if (!std::is_sorted(ground_pairs.begin(), ground_pairs.end()))
    std::sort(ground_pairs.begin(), ground_pairs.end());
  auto from = static_cast<std::ptrdiff_t>(pairs.size());
  pairs.resize(pairs.size() + ground_pairs.size());
  auto to = pairs.rbegin();
  for (auto next = ground_pairs.rbegin(); next != ground_pairs.rend(); ++to) {
    *to = from > 0 && pairs[from - 1] > *next ? pairs[--from] : *next++;
  }
  ground_pairs.clear();
}

}  // namespace counterpoint::collision
