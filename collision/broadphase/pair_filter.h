// The pairs of geometries that may touch.
#pragma once

#include <utility>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::collision {

/// Memory and construction time grow with the number of geometries and of pairs excluded by name,
/// not with the number of all pairs.
class PairFilter {
 public:
  explicit PairFilter(const Model& model);

  /// True if geometries a and b may touch. False for geometries of one body, two planes, excluded
  /// pairs, and, unless the model includes the pair, two bodies of one assembly joined by a joint.
  bool enabled(int a, int b) const;
  /// True if the model includes the pair (Model::included_geometry_pairs).
  bool included(int a, int b) const;
  bool has_included() const { return !included_.empty(); }
  /// The test of enabled() without the exclusions.
  bool enabled_by_structure(int a, int b) const;
  /// Excludes further pairs.
  void exclude(const std::vector<std::pair<int, int>>& pairs);
  int num_enabled_pairs() const;
  /// Number of pairs on two bodies of one assembly joined by a joint.
  int num_joined_pairs() const;

 private:
  struct Item {
    int body, parent, assembly;
    bool plane;
  };
  bool joined(int a, int b) const;
  std::vector<Item> items_;
  std::vector<std::pair<int, int>> included_;  // sorted, first < second
  std::vector<std::pair<int, int>> excluded_;  // sorted, first < second, no duplicates
  std::vector<int> excluded_begin_;  // for each geometry, the index of its first pair in excluded_
};

}  // namespace counterpoint::collision
