// What a Collider holds; its functions are in collider.cc (contacts) and near_pairs.cc (which pairs
// are near).
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "counterpoint/collision/broadphase/broadphase.h"
#include "counterpoint/collision/broadphase/pair_filter.h"
#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/pairs/corner_contacts.h"
#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/collision/pairs/pair_motion.h"
#include "counterpoint/collision/pairs/terrain_contacts.h"
#include "counterpoint/collision/shapes/enclosure.h"

namespace counterpoint::collision {

struct Collider::Impl {
  explicit Impl(const Model& model) : geometries(model.geometries()), filter(model) {}

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
  void find_moving_contacts(int a, int b, PairQuery query, const PairMotion& motion);
  void add_core_contacts(int a, int b, double margin, double travel, std::vector<Candidate>& out);

  // What every step reads of each geometry; all that a Geometry holds is several cache lines more.
  struct Placement {
    Pose X_BG;
    int body;
    ShapeType type;
  };

  // A copy: nothing then depends on where the model lives.
  std::vector<Geometry> geometries;
  std::vector<Placement> placements;
  PairFilter filter;
  Broadphase broadphase;
  std::vector<Enclosure> enclosures;
  std::vector<Corners> corners;
  std::vector<double> radii;  // by body, of its shapes about its origin; of planes 0
  std::vector<int> planes, terrains, solids;  // geometry indices
  std::vector<std::pair<int, int>> overlapping;
  // Of few bodies with several solids each: the indices of the solids body by body, where each
  // body's begin (and the end), and the pairs of bodies that hold enabled pairs; of any two solids
  // whether the filter enables them.
  std::vector<int> by_body, begin_of_body;
  std::vector<char> enabled_solids;
  std::vector<std::pair<int, int>> body_pairs;
  // Scratch.
  std::span<const char> idle;  // by body; empty: none
  std::vector<Pose> X_WG;
  std::vector<Bounds> boxes;  // of solids; kNowhere of those that are not sound
  std::vector<Bounds> body_boxes;
  std::vector<std::pair<int, int>> pairs;
  std::vector<int> awake;                                      // indices of solids
  std::vector<std::pair<int, int>> solid_pairs, ground_pairs;  // before they join the others
  TerrainContacts terrain_contacts;
  Manifold manifold;
};

}  // namespace counterpoint::collision
