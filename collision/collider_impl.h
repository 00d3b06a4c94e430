// The members of Collider. Functions are in collider.cc (contacts) and near_pairs.cc (close pairs).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "counterpoint/collision/broadphase/broadphase.h"
#include "counterpoint/collision/broadphase/pair_filter.h"
#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/pairs/corner_contacts.h"
#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/collision/pairs/pair_motion.h"
#include "counterpoint/collision/pairs/patch_area.h"
#include "counterpoint/collision/pairs/seams.h"
#include "counterpoint/collision/pairs/terrain_contacts.h"
#include "counterpoint/collision/shapes/enclosure.h"

namespace counterpoint::collision {

struct Collider::Impl {
  explicit Impl(const Model& model)
      : geometries(model.geometries()), seams(geometries), filter(model) {}

  // Solids of one body, near each other.
  struct Group {
    int body;
    int begin, end;    // range in `members`
    Enclosure around;  // box around their boxes, in the frame of the body
  };
  void group_solids(const Model& model);
  Enclosure enclose_group(std::span<const int> part) const;
  void list_group_pairs();
  void place();
  void place_group(int g);
  void find_pairs();
  void add_solid_pairs(int i, int j, bool all_enabled);
  void add_found_pair(int i, int j);
  bool list_awake();
  void add_awake_pairs();
  void add_plane_pairs(int plane);
  void add_terrain_pairs(int terrain);
  void add_ground_pair(int ground, int solid);
  void merge_ground_pairs();
  std::span<const int> members_of(const Group& group) const {
    return std::span(members).subspan(group.begin, group.end - group.begin);
  }
  bool is_idle_body(int body) const { return !idle.empty() && idle[body]; }
  bool is_idle(int i) const { return is_idle_body(placements[i].body); }
  double turn(int a, int b, double margin) const;
  void find_contacts(int a, int b, const PairQuery& query);
  bool may_pass(int a, int b) const;
  PairMotion motion_of(std::span<const Pose> X_WB, int a, int b, const BodyMotions& motions) const;
  int find_moving_contacts(int a, int b, PairQuery query, const PairMotion& motion);
  bool is_hidden(int a, int b, const ContactPoint& point) const;
  void drop_hidden(int a, int b);
  void find_areas(int a, int b, const BodyPlaces& at);
  bool meets_seam(int a, int b, double way) const;
  void add_core_contacts(int a, int b, double margin, double travel, std::vector<Candidate>& out);

  // The members of Geometry that every step reads. A whole Geometry spans several more cache lines.
  struct Placement {
    Pose X_BG;
    int body;
    ShapeType type;
  };

  // A copy, so that the collider does not depend on the model's lifetime.
  std::vector<Geometry> geometries;
  std::vector<Placement> placements;
  Seams seams;
  PairFilter filter;
  Broadphase broadphase;
  bool has_soft_pairs = false;  // some pair of geometries has a stiffness per area of its own
  std::vector<Enclosure> enclosures;
  std::vector<Corners> corners;
  std::vector<double> radii;                  // bounding radius of each body, without planes [m]
  std::vector<int> planes, terrains, solids;  // geometry indices
  std::vector<std::pair<int, int>> overlapping;
  std::vector<int> members;  // indices of solids, group by group
  std::vector<Group> groups;
  bool group_pairs_listed = false;  // only for few groups
  struct GroupPair {
    int first, second;
    bool all_enabled;  // else the filter enables some of their pairs of solids
  };
  std::vector<GroupPair> group_pairs;
  // The poses in W and margins [m] of a search, and the idle bodies, for each body.
  std::span<const Pose> body_poses;
  std::span<const double> margins;
  std::span<const char> idle;  // empty: none is idle
  // Scratch.
  std::vector<Pose> X_WG;     // for planes, terrains, and solids of placed groups
  std::vector<Bounds> boxes;  // for each solid of a placed group; kNowhere if the box is not sound
  std::vector<Bounds> group_boxes;
  std::vector<char> placed;  // for each group
  std::vector<std::pair<int, int>> pairs, near_groups;
  std::vector<int> awake;                         // indices of groups
  std::vector<std::uint64_t> solid_pairs;         // keys of pairs of solids
  std::vector<std::pair<int, int>> ground_pairs;  // not yet merged into `pairs`
  TerrainContacts terrain_contacts;
  Manifold manifold;
  PatchFaces patch_faces;
  std::array<double, Manifold::kCapacity> areas;  // one for each point of `manifold` [m^2]
};

}  // namespace counterpoint::collision
