// The members of Collider. Functions are in collider.cc (contacts) and near_pairs.cc (close pairs).
#pragma once

#include <array>
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

  void place(std::span<const Pose> X_WB, std::span<const double> margin);
  void find_pairs(std::span<const double> margin);
  void add_plane_pairs(int plane, std::span<const double> margin);
  void add_terrain_pairs(int terrain, std::span<const double> margin);
  void merge_ground_pairs();
  double turn(int a, int b, double margin) const;
  void group_by_body(const Model& model);
  void find_pairs_by_body();
  bool list_awake();
  void find_awake_pairs();
  bool is_idle(int i) const { return !idle.empty() && idle[placements[i].body]; }
  bool both_idle(int a, int b) const { return is_idle(a) && is_idle(b); }
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
  // Only for few bodies with several solids each: indices of the solids in order of body, the
  // beginning of each body's part (and the end), the pairs of bodies with enabled pairs of solids,
  // and for any two solids whether the filter enables them.
  std::vector<int> by_body, begin_of_body;
  std::vector<char> enabled_solids;
  std::vector<std::pair<int, int>> body_pairs;
  // Scratch.
  std::span<const char> idle;  // for each body; empty: none is idle
  std::vector<Pose> X_WG;
  std::vector<Bounds> boxes;  // for each solid; kNowhere if the box is not sound
  std::vector<Bounds> body_boxes;
  std::vector<std::pair<int, int>> pairs;
  std::vector<int> awake;                                      // indices of solids
  std::vector<std::pair<int, int>> solid_pairs, ground_pairs;  // not yet merged into `pairs`
  TerrainContacts terrain_contacts;
  Manifold manifold;
  PatchFaces patch_faces;
  std::array<double, Manifold::kCapacity> areas;  // one for each point of `manifold` [m^2]
};

}  // namespace counterpoint::collision
