// Which pairs of geometries may touch.
#pragma once

#include <utility>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::collision {

/// Memory and construction time grow with the geometries and the pairs excluded by name, not with
/// the pairs there are.
class PairFilter {
 public:
  explicit PairFilter(const Model& model);

  /// May geometries a and b touch? Not if they are on one body, both planes, or, unless the model
  /// includes the pair, on two bodies of one assembly joined by a joint, or excluded.
  bool enabled(int a, int b) const;
  /// Does the model include the pair (Model::included_geometry_pairs)?
  bool included(int a, int b) const;
  /// The part of the test that does not look at exclusions.
  bool enabled_by_structure(int a, int b) const;
  /// Excludes further pairs.
  void exclude(const std::vector<std::pair<int, int>>& pairs);
  int num_enabled_pairs() const;
  /// Pairs on two bodies of one assembly joined by a joint.
  int num_joined_pairs() const;

 private:
  struct Item {
    int body, parent, assembly;
    bool plane;
  };
  bool joined(int a, int b) const;
  std::vector<Item> items_;
  std::vector<std::pair<int, int>> included_;  // as excluded_
  std::vector<std::pair<int, int>> excluded_;  // sorted, first < second, no duplicates
  std::vector<int> excluded_begin_;            // by first
};

}  // namespace counterpoint::collision
