// Pairs of geometries of a ModelBuilder: excluded pairs, included pairs, and pairs with their own
// surface values.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "counterpoint/model/builder/builder_names.h"
#include "counterpoint/model/builder/robot_tree.h"
#include "counterpoint/model/limits.h"

namespace counterpoint {
namespace {

void check_number(size_t pairs, const char* what) {
  if (pairs < limits::kMaxExclusions) return;
  throw InputError(
      fmt::format("more than {} pairs of geometries {}; use fewer geometries or smaller groups",
                  limits::kMaxExclusions, what));
}

}  // namespace

std::vector<int> ModelBuilder::geometries_named(const std::string& name) const {
  std::vector<int> found;
  const auto geometry = geometry_names_.find(name);
  const auto is_piece = [&](int i) {
    return i < static_cast<int>(model_.geometries_.size()) &&
           model_.geometries_[i].whole == geometry->second && model_.geometries_[i].name != name;
  };
  if (geometry != geometry_names_.end()) {
    found.push_back(geometry->second);
    if (is_piece(geometry->second))  // the name of the whole mesh
      for (int i = geometry->second + 1; is_piece(i); ++i) found.push_back(i);
  }
  const auto frame = frame_names_.find(name);
  if (frame != frame_names_.end()) {
    // The geometries of a link are contiguous.
    const auto& all = model_.geometries_;
    for (int i = frame_geometries_[frame->second];
         i < static_cast<int>(all.size()) && all[i].frame == frame->second; ++i) {
      found.push_back(i);
    }
  }
  if (geometry == geometry_names_.end() && frame == frame_names_.end()) {
    throw InputError(fmt::format("there is no geometry or link '{}'; links: {}; geometries: {}",
                                 name, listed(frame_names_), listed(geometry_names_)));
  }
  return found;
}

void ModelBuilder::exclude_pair(const std::string& geometry_or_link_a,
                                const std::string& geometry_or_link_b, const std::string& reason) {
  const std::vector<int> side_b = geometries_named(geometry_or_link_b);
  for (const int a : geometries_named(geometry_or_link_a)) {
    for (const int b : side_b) {
      if (a != b) add_exclusion(a, b, reason);
    }
  }
}

void ModelBuilder::add_exclusion(int a, int b, const std::string& reason) {
  check_number(model_.excluded_pairs_.size(), "are excluded");
  model_.excluded_pairs_.push_back(std::minmax(a, b));
  model_.exclusion_reasons_.push_back(reason);
}

void ModelBuilder::include_pair(const std::string& geometry_or_link_a,
                                const std::string& geometry_or_link_b) {
  const std::vector<int> side_b = geometries_named(geometry_or_link_b);
  for (const int a : geometries_named(geometry_or_link_a)) {
    for (const int b : side_b) {
      if (a == b) continue;
      check_number(model_.included_pairs_.size(), "are named to touch");
      model_.included_pairs_.push_back(std::minmax(a, b));
    }
  }
}

namespace {

/// Sets the springs that are given for a pair. One of points replaces that of areas, and the other
/// way round.
void set_springs(const PairSurface& given, Material& m) {
  if ((given.stiffness || given.stiffness_per_area) && !given.restitution) m.restitution = 0.0;
  if (given.stiffness_per_area) {
    m.stiffness = Spring().stiffness;
    m.damping = m.dissipation = 0.0;
  }
  if (given.stiffness) m.per_area = Spring();
  m.stiffness = given.stiffness.value_or(m.stiffness);
  m.damping = given.damping.value_or(m.damping);
  m.per_area.stiffness = given.stiffness_per_area.value_or(m.per_area.stiffness);
  m.per_area.damping = given.damping_per_area.value_or(m.per_area.damping);
  double& dissipation = m.per_area.is_soft() ? m.per_area.dissipation : m.dissipation;
  dissipation = given.dissipation.value_or(dissipation);
}

}  // namespace

void ModelBuilder::set_pair_surface(const std::string& geometry_or_link_a,
                                    const std::string& geometry_or_link_b,
                                    const PairSurface& surface) {
  const std::vector<int> side_b = geometries_named(geometry_or_link_b);
  for (const int a : geometries_named(geometry_or_link_a)) {
    for (const int b : side_b) {
      if (a == b) continue;
      const auto& all = model_.geometries_;
      Material m = combine_materials(all[a].material, all[b].material);
      if (surface.friction) {
        m.static_friction = 0.0;
        m.friction_axis = surface.friction_axis.value_or(Vector3::Zero());
        m.friction_across = surface.friction_across;
        m.axis_of_second = a > b;
      }
      m.friction = surface.friction.value_or(m.friction);
      m.static_friction = surface.static_friction.value_or(m.static_friction);
      m.stribeck_speed = surface.stribeck_speed.value_or(m.stribeck_speed);
      set_springs(surface, m);
      m.restitution = surface.restitution.value_or(m.restitution);
      m.torsional_friction = surface.torsional_friction.value_or(m.torsional_friction);
      m.rolling_friction = surface.rolling_friction.value_or(m.rolling_friction);
      check_material(m, fmt::format("pair '{}', '{}'", all[a].name, all[b].name));
      check_number(model_.pair_materials_.size(), "have surface values of their own");
      model_.pair_materials_.push_back({std::min(a, b), std::max(a, b), m});
    }
  }
}

/// Sorts the pairs and keeps each once: exclusions with the reason given first, surfaces with the
/// values given last. A pair that is included is not excluded.
void ModelBuilder::sort_pairs() {
  std::vector<std::pair<int, int>>& included = model_.included_pairs_;
  std::sort(included.begin(), included.end());
  included.erase(std::unique(included.begin(), included.end()), included.end());

  std::map<std::pair<int, int>, std::string> reasons;
  for (size_t i = 0; i < model_.excluded_pairs_.size(); ++i)
    if (!std::binary_search(included.begin(), included.end(), model_.excluded_pairs_[i]))
      reasons.emplace(model_.excluded_pairs_[i], std::move(model_.exclusion_reasons_[i]));
  model_.excluded_pairs_.clear();
  model_.exclusion_reasons_.clear();
  for (auto& [pair, reason] : reasons) {
    model_.excluded_pairs_.push_back(pair);
    model_.exclusion_reasons_.push_back(std::move(reason));
  }

  std::map<std::pair<int, int>, Material> surfaces;
  for (const PairMaterial& p : model_.pair_materials_)
    surfaces.insert_or_assign({p.geometry_a, p.geometry_b}, p.material);
  model_.pair_materials_.clear();
  for (const auto& [pair, material] : surfaces)
    model_.pair_materials_.push_back({pair.first, pair.second, material});
}

}  // namespace counterpoint
