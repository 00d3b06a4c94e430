#include "counterpoint/model/export/mjcf_parts.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/model/export/numbers.h"
#include "counterpoint/model/robot_files.h"

namespace counterpoint {

std::pair<std::string, std::string> mjcf_shape(const Geometry& g) {
  const Vector3& s = g.shape.size;
  switch (g.shape.type) {
    case ShapeType::kPlane:
      if (g.body != 0)
        throw InputError("geometry '" + g.name +
                         "': MJCF has planes on the world only; use a box in its place");
      return {"plane", "0 0 1"};
    case ShapeType::kSphere:
      return {"sphere", export_number(s.x())};
    case ShapeType::kBox:
      return {"box", export_numbers(s)};
    case ShapeType::kCapsule:
      return {"capsule", export_numbers({s.x(), s.y()})};
    case ShapeType::kCylinder:
      return {"cylinder", export_numbers({s.x(), s.y()})};
    case ShapeType::kConvexMesh:
      return {"mesh", ""};
    case ShapeType::kTerrain:
      break;
  }
  return {};
}

CarriedWeight carried_weight(const Model& model, int body) {
  CarriedWeight carried;
  Vector3 moment = Vector3::Zero();
  for (const GravityCompensation& part : model.gravity_compensations()) {
    if (part.body != body) continue;
    carried.mass += part.mass;
    moment += part.mass * part.center;
  }
  const Vector3 centered = carried.mass * model.body(body).inertia.center;
  carried.at_center = (moment - centered).norm() <= 1e-9 * (moment.norm() + centered.norm());
  return carried;
}

std::vector<Closure> mjcf_closures(const Model& model, std::vector<Note>& lost) {
  constexpr double kHingeWidth = 0.1;  // distance of the points that stand for a hinge [m]
  const auto lose = [&](const Closure& c, const std::string& what) {
    lost.push_back({"closure '" + c.name + "'", what});
  };
  std::vector<Closure> out;
  for (const Closure& c : model.closures()) {
    const bool hinge = c.type == ClosureType::kHinge;
    const bool known = hinge || c.type == ClosureType::kBall || c.type == ClosureType::kWeld ||
                       c.type == ClosureType::kDistance;
    std::string lack;
    if (!known) lack = std::string("a closure of the type ") + closure_type_name(c.type);
    if (c.linear.acts || c.angular.acts) lack = "its spring";
    if (c.rope) lack = "a rope";
    if (c.switched && !c.attached) lack = "a switched closure that is not attached";
    if (lack.empty() && std::isfinite(c.breaking_force)) lose(c, "its breaking_force");
    if (lack.empty() && std::isfinite(c.breaking_torque)) lose(c, "its breaking_torque");
    for (const double side : {-0.5, 0.5}) {
      if (!lack.empty() || (!hinge && side > 0.0)) continue;
      Closure& part = out.emplace_back(c);
      part.X_BC = c.anchor_b(model.default_z());
      if (!hinge) continue;
      part.type = ClosureType::kBall;
      if (side > 0.0) part.name += ".2";
      for (Pose* X : {&part.X_AC, &part.X_BC})
        X->translation += side * kHingeWidth * X->rotation.col(2);
    }
    if (!lack.empty()) lose(c, lack);
  }
  return out;
}

MjcfPairs list_mjcf_pairs(const Model& model, const IndexPairs& apart, bool all) {
  const auto& geometries = model.geometries();
  const auto& included = model.included_geometry_pairs();
  const auto bodies_of = [&](const std::pair<int, int>& pair) -> std::pair<int, int> {
    return std::minmax(geometries[pair.first].body, geometries[pair.second].body);
  };
  const auto may_touch = [&](const std::pair<int, int>& pair) {
    const auto [i, j] = bodies_of(pair);
    const bool joined = i > 0 && model.body(j).parent == i;
    return i != j && !apart.count(pair) &&
           (!joined || std::binary_search(included.begin(), included.end(), pair));
  };
  MjcfPairs out;
  for (const auto& pair : apart) {
    const auto [i, j] = bodies_of(pair);
    if (i != j && !all) out.excluded_bodies.emplace(i, j);
  }
  for (const auto& pair : included)
    if (may_touch(pair)) out.listed.insert(pair);
  const int n = static_cast<int>(geometries.size());
  for (int a = 0; a < n; ++a) {
    for (int b = a + 1; b < n; ++b) {
      const bool in_question = all || out.excluded_bodies.count(bodies_of({a, b})) > 0;
      if (in_question && may_touch({a, b})) out.listed.emplace(a, b);
    }
  }
  return out;
}

}  // namespace counterpoint
