#include <fmt/format.h>

#include <cmath>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {
namespace {

void check(double value, double low, double high, const char* what, const std::string& where) {
  if (value >= low && value <= high) return;  // false for NaN
  throw InputError(
      fmt::format("{}: {} {:.6g}; expected {:g} to {:g}", where, what, value, low, high));
}

constexpr double kMost = 1e12;  // beyond any value of a real machine
constexpr double kLeast = 1e-12;

Shape scaled(Shape shape, double factor) {
  shape.size *= factor;
  if (!shape.mesh) return shape;
  std::vector<Vector3> vertices = shape.mesh->vertices;
  for (Vector3& v : vertices) v *= factor;
  ConvexMesh mesh = *make_convex_hull(vertices, shape.mesh->source);
  mesh.union_standoff = factor * shape.mesh->union_standoff;
  shape.mesh = std::make_shared<const ConvexMesh>(std::move(mesh));
  return shape;
}

}  // namespace

void ModelEditor::set_gravity(const Vector3& gravity) {
  check(gravity.norm(), 0.0, kMost, "gravity", "scene");
  model_.gravity_ = gravity;
}

void ModelEditor::set_material(int geometry, const Material& material) {
  Geometry& g = model_.geometries_[geometry];
  check(material.friction, 0.0, kMost, "friction", g.name);
  check(material.restitution, 0.0, 1.0, "restitution", g.name);
  check(material.torsional_friction, 0.0, kMost, "torsional_friction", g.name);
  check(material.rolling_friction, 0.0, kMost, "rolling_friction", g.name);
  check(material.static_friction, 0.0, kMost, "static_friction", g.name);
  check(material.stribeck_speed, kLeast, kMost, "stribeck_speed", g.name);
  if (std::isfinite(material.stiffness))
    check(material.stiffness, kLeast, kMost, "stiffness", g.name);
  if (material.per_area.is_soft())
    check(material.per_area.stiffness, kLeast, kMost, "stiffness per area", g.name);
  check(material.per_area.damping, 0.0, kMost, "damping per area", g.name);
  check(material.per_area.dissipation, 0.0, kMost, "dissipation", g.name);
  check(material.damping, 0.0, kMost, "damping", g.name);
  check(material.dissipation, 0.0, kMost, "dissipation", g.name);
  check(material.friction_axis.norm(), 0.0, kMost, "length of friction_axis", g.name);
  check(material.friction_across, 0.0, kMost, "friction across the axis", g.name);
  g.material = material;
}

void ModelEditor::set_pose(int geometry, const Pose& X_BG) {
  Geometry& g = model_.geometries_[geometry];
  check(X_BG.translation.norm(), 0.0, kMost, "distance from the origin", g.name);
  g.X_BG = X_BG;
}

void ModelEditor::set_mass(int body, double mass) {
  SpatialInertia& inertia = model_.bodies_[body].inertia;
  check(mass, kLeast, kMost, "mass", model_.joint(body - 1).link);
  if (inertia.mass > 0.0) inertia.rotational *= mass / inertia.mass;
  inertia.mass = mass;
}

void ModelEditor::set_inertia(int body, const SpatialInertia& inertia) {
  const std::string& link = model_.joint(body - 1).link;
  check(inertia.mass, kLeast, kMost, "mass", link);
  check(inertia.center.norm(), 0.0, kMost, "distance of the centre of mass from the origin", link);
  check(inertia.rotational.norm(), 0.0, kMost, "rotational inertia", link);
  model_.bodies_[body].inertia = inertia;
}

void ModelEditor::scale_inertia(int body, double factor) {
  check(factor, kLeast, kMost, "factor of the inertia", model_.joint(body - 1).link);
  model_.bodies_[body].inertia.rotational *= factor;
}

void ModelEditor::scale_size(int body, double factor) {
  const std::string& link = model_.joint(body - 1).link;
  check(factor, kLeast, kMost, "factor of the size", link);
  for (const Body& other : model_.bodies_) {
    if (other.parent == body)
      throw InputError(fmt::format(
          "{}: its size cannot be changed, another link hangs on it; only the last link of a "
          "branch has a size of its own",
          link));
  }
  for (const Closure& closure : model_.closures_) {
    if (closure.body_a == body || closure.body_b == body)
      throw InputError(
          fmt::format("{}: its size cannot be changed, closure '{}' holds it", link, closure.name));
  }
  SpatialInertia& inertia = model_.bodies_[body].inertia;
  inertia.center *= factor;
  inertia.rotational *= factor * factor;
  for (Geometry& g : model_.geometries_) {
    if (g.body != body) continue;
    g.X_BG.translation *= factor;
    g.shape = scaled(std::move(g.shape), factor);
  }
  for (Frame& frame : model_.frames_)
    if (frame.body == body) frame.X_BF.translation *= factor;
  for (BodyDrag& drag : model_.drags_)
    if (drag.body == body) drag.center *= factor;
  for (GravityCompensation& carried : model_.gravity_compensations_)
    if (carried.body == body) carried.center *= factor;
}

void ModelEditor::set_damping(int v_index, double value) {
  check(value, 0.0, kMost, "damping", fmt::format("coordinate {}", v_index));
  model_.damping_[v_index] = value;
}

void ModelEditor::set_dry_friction(int v_index, double value) {
  check(value, 0.0, kMost, "dry friction", fmt::format("coordinate {}", v_index));
  model_.dry_friction_[v_index] = value;
}

void ModelEditor::set_breakaway_friction(int v_index, double value) {
  check(value, 0.0, kMost, "breakaway friction", fmt::format("coordinate {}", v_index));
  model_.breakaway_friction_[v_index] = value;
}

void ModelEditor::set_stribeck_speed(int v_index, double value) {
  check(value, kLeast, kMost, "stribeck_speed", fmt::format("coordinate {}", v_index));
  model_.stribeck_speed_[v_index] = value;
}

void ModelEditor::set_armature(int v_index, double value) {
  check(value, 0.0, kMost, "armature", fmt::format("coordinate {}", v_index));
  model_.armature_[v_index] = value;
}

void ModelEditor::set_spring(int index, const JointSpring& spring) {
  const std::string& name = model_.joint(spring.joint).name;
  check(spring.stiffness, kLeast, kMost, "stiffness of the spring", name);
  check(spring.reference, -kMost, kMost, "reference of the spring", name);
  model_.springs_[static_cast<size_t>(index)] = spring;
}

void ModelEditor::set_servo(int index, const JointServo& servo) {
  const std::string& name = model_.joint(servo.joint).name;
  check(servo.stiffness, 0.0, kMost, "stiffness of the servo", name);
  check(servo.damping, 0.0, kMost, "damping of the servo", name);
  check(servo.stiffness + servo.damping, kLeast, 2.0 * kMost, "sum of the servo's gains", name);
  model_.servos_[static_cast<size_t>(index)] = servo;
}

void ModelEditor::set_actuator(int index, const Actuator& actuator) {
  for (const double value : {actuator.gear, actuator.gain, actuator.torque_constant})
    check(value, -kMost, kMost, "gear, gain or torque constant", actuator.name);
  check(actuator.resistance, actuator.law == ActuatorLaw::kDcMotor ? kLeast : 0.0, kMost,
        "resistance", actuator.name);
  model_.actuators_[static_cast<size_t>(index)] = actuator;
}

void ModelEditor::set_joint_pose(int body, const Pose& X_PJ) {
  check(X_PJ.translation.norm(), 0.0, kMost, "distance of the joint from its link's origin",
        model_.joint(body - 1).name);
  model_.bodies_[static_cast<size_t>(body)].X_PJ = X_PJ;
}

}  // namespace counterpoint
