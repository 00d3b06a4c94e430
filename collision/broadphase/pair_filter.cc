#include "counterpoint/collision/broadphase/pair_filter.h"

#include <algorithm>
#include <map>

namespace counterpoint::collision {

PairFilter::PairFilter(const Model& model) : included_(model.included_geometry_pairs()) {
  items_.reserve(model.geometries().size());
  for (const Geometry& g : model.geometries()) {
    // The world has no parent; -1 is no body's index.
    const int parent = g.body == 0 ? -1 : model.body(g.body).parent;
    items_.push_back({g.body, parent, g.assembly, g.shape.type == ShapeType::kPlane});
  }
  excluded_begin_.assign(items_.size() + 1, 0);
  exclude(model.excluded_geometry_pairs());
}

bool PairFilter::joined(int a, int b) const {
  const Item& i = items_[a];
  const Item& j = items_[b];
  return i.assembly >= 0 && i.assembly == j.assembly && (i.parent == j.body || j.parent == i.body);
}

bool PairFilter::included(int a, int b) const {
  return !included_.empty() && std::binary_search(included_.begin(), included_.end(),
                                                  std::pair(std::min(a, b), std::max(a, b)));
}

bool PairFilter::enabled_by_structure(int a, int b) const {
  const Item& i = items_[a];
  const Item& j = items_[b];
  if (i.body == j.body || (i.plane && j.plane)) return false;
  return !joined(a, b) || included(a, b);
}

bool PairFilter::enabled(int a, int b) const {
  if (!enabled_by_structure(a, b)) return false;
  if (a > b) std::swap(a, b);
  const auto begin = excluded_.begin() + excluded_begin_[a];
  const auto end = excluded_.begin() + excluded_begin_[a + 1];
  return begin == end || !std::binary_search(begin, end, std::pair(a, b));
}

void PairFilter::exclude(const std::vector<std::pair<int, int>>& pairs) {
  for (const auto& [a, b] : pairs) excluded_.emplace_back(std::min(a, b), std::max(a, b));
  std::sort(excluded_.begin(), excluded_.end());
  excluded_.erase(std::unique(excluded_.begin(), excluded_.end()), excluded_.end());
  std::fill(excluded_begin_.begin(), excluded_begin_.end(), 0);
  for (const auto& pair : excluded_) ++excluded_begin_[pair.first + 1];
  for (std::size_t i = 1; i < excluded_begin_.size(); ++i) {
    excluded_begin_[i] += excluded_begin_[i - 1];
  }
}

// Counts by groups of geometries that enabled_by_structure cannot tell apart.
int PairFilter::num_joined_pairs() const {
  struct Group {
    int parent = -1;
    long count = 0, planes = 0;
  };
  std::map<std::pair<int, int>, Group> groups;  // key: body and assembly
  for (const Item& item : items_) {
    if (item.assembly < 0) continue;
    Group& group = groups[{item.body, item.assembly}];
    group.parent = item.parent;
    ++group.count;
    group.planes += item.plane;
  }
  long count = 0;
  for (const auto& [key, group] : groups) {
    const auto parent = groups.find({group.parent, key.second});
    if (parent == groups.end()) continue;
    count += group.count * parent->second.count - group.planes * parent->second.planes;
  }
  for (const auto& [a, b] : included_)
    count -= joined(a, b) && !(items_[a].plane && items_[b].plane);
  return static_cast<int>(count);
}

int PairFilter::num_enabled_pairs() const {
  std::map<int, long> on_body;
  std::map<int, long> planes_on_body;
  long planes = 0;
  for (const Item& item : items_) {
    ++on_body[item.body];
    planes_on_body[item.body] += item.plane;
    planes += item.plane;
  }
  const auto choose2 = [](long n) { return n * (n - 1) / 2; };
  long enabled = choose2(static_cast<long>(items_.size())) - num_joined_pairs();
  for (const auto& [body, count] : on_body) enabled -= choose2(count);
  enabled -= choose2(planes);
  for (const auto& [body, count] : planes_on_body) enabled += choose2(count);
  for (const auto& [a, b] : excluded_) enabled -= enabled_by_structure(a, b);
  return static_cast<int>(enabled);
}

}  // namespace counterpoint::collision
