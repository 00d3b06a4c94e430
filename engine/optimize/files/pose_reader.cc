#include "counterpoint/engine/optimize/files/pose_reader.h"

#include <fmt/format.h>

#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::optimization {
namespace {

/// Joint name of a coordinate: "left_knee" for "left_knee.q".
std::string owner(const std::string& name) { return name.substr(0, name.rfind('.')); }

/// Calls set(i) for each coordinate whose name matches a pattern; an error if there is none.
template <class Set>
void for_each_match(const YamlValue& in, const std::string& pattern,
                    const std::vector<std::string>& names, bool owners, Set set) {
  bool any = false;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!matches(pattern, names[i]) && !(owners && matches(pattern, owner(names[i])))) continue;
    any = true;
    set(static_cast<Eigen::Index>(i));
  }
  if (any) return;
  in.fail(fmt::format("'{}' is no coordinate of the scene; known: {}", pattern,
                      fmt::join(names, ", ")));
}

void normalize_pose(const YamlValue& in, const Model& model, VectorX& q) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (joint_nq(body.joint_type) == joint_nv(body.joint_type)) continue;
    auto quaternion = q.segment<4>(body.q_index + joint_num_linear(body.joint_type));
    if (quaternion.norm() < 1e-9) in.fail("the quaternion of a joint is zero");
    quaternion.normalize();
  }
}

}  // namespace

void read_pose(const YamlValue& in, const Model& model, VectorX& q) {
  const CoordinateNames names = coordinate_names(model);
  for (const auto& entry : in.entries()) {  // Clang 14 captures no structured binding
    const auto& pattern = entry.first;
    const double number = entry.second.number();
    for_each_match(entry.second, pattern, names.q, true, [&](Eigen::Index i) {
      const std::string& name = names.q[static_cast<std::size_t>(i)];
      const bool single = name.size() > 2 && name.compare(name.size() - 2, 2, ".q") == 0;
      if (single || matches(pattern, name)) q[i] = number;
    });
  }
  normalize_pose(in, model, q);
}

void read_by_velocity(const YamlValue& in, const Model& model, VectorX& values) {
  if (!in.is_map()) {
    values.setConstant(model.nv(), in.number());
    return;
  }
  const CoordinateNames names = coordinate_names(model);
  for (const auto& [pattern, value] : in.entries()) {
    const double number = value.number();
    for_each_match(value, pattern, names.v, true, [&](Eigen::Index i) { values[i] = number; });
  }
}

}  // namespace counterpoint::optimization
