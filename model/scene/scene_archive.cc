#include <cstdint>

#include "counterpoint/model/files/archive.h"
#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {
namespace {

/// Mark with the version of the format; increase it with every change of the content.
constexpr std::string_view kMark = "counterpoint scene 10\n";
constexpr const char* kWhat = "scene archive";

}  // namespace

namespace archive {

template <class A>
void visit(A& a, EffectSet& effects) {
  for (int i = 0; i < kNumEffects; ++i) {
    bool on = effects.has(static_cast<Effect>(i));
    a.plain(on);
    effects.set(static_cast<Effect>(i), on);
  }
}

template <class A>
void visit(A& a, Pose& x) {
  auto& [rotation, translation] = x;
  a(rotation, translation);
}
template <class A>
void visit(A& a, SpatialInertia& x) {
  auto& [mass, center, rotational] = x;
  a(mass, center, rotational);
}
template <class A>
void visit(A& a, Body& x) {
  auto& [parent, type, q, v, tree, end, X_PJ, inertia] = x;
  a(parent, type, q, v, tree, end, X_PJ, inertia);
}
template <class A>
void visit(A& a, Tree& x) {
  auto& [body_begin, body_end, v_begin, v_end] = x;
  a(body_begin, body_end, v_begin, v_end);
}
template <class A>
void visit(A& a, JointInfo& x) {
  auto& [name, link, lower, upper, effort, velocity, actuated, prescribed] = x;
  a(name, link, lower, upper, effort, velocity, actuated, prescribed);
}
template <class A>
void visit(A& a, JointSpring& x) {
  auto& [joint, stiffness, reference] = x;
  a(joint, stiffness, reference);
}
template <class A>
void visit(A& a, JointServo& x) {
  auto& [joint, stiffness, damping, position, velocity] = x;
  a(joint, stiffness, damping, position, velocity);
}
template <class A>
void visit(A& a, Drag& x) {
  auto& [linear, quadratic, angular, angular_quadratic] = x;
  a(linear, quadratic, angular, angular_quadratic);
}
template <class A>
void visit(A& a, BodyDrag& x) {
  auto& [body, center, drag] = x;
  a(body, center, drag);
}
template <class A>
void visit(A& a, GravityCompensation& x) {
  auto& [body, center, mass] = x;
  a(body, center, mass);
}
template <class A>
void visit(A& a, Frame& x) {
  auto& [name, body, X_BF, parent, inertia] = x;
  a(name, body, X_BF, parent, inertia);
}
template <class A>
void visit(A& a, Mimic& x) {
  auto& [joint, master, multiplier, offset] = x;
  a(joint, master, multiplier, offset);
}
template <class A>
void visit(A& a, ClosureSpring& x) {
  auto& [acts, stiffness, damping] = x;
  a.plain(acts);
  a(stiffness, damping);
}
template <class A>
void visit(A& a, Closure& x) {
  auto& [name, type, body_a, body_b, X_AC, X_BC, length, pitch, rope, linear, angular, frame_a,
         frame_b, switched, attached, breaking_force, breaking_torque, in_place, z_index] = x;
  a(name, type, body_a, body_b, X_AC, X_BC, length, pitch);
  a.plain(rope);
  a(linear, angular, frame_a, frame_b);
  a.plain(switched);
  a.plain(attached);
  a.plain(in_place);
  a(breaking_force, breaking_torque, z_index);
}
template <class A>
void visit(A& a, TendonJoint& x) {
  auto& [joint, coefficient] = x;
  a(joint, coefficient);
}
template <class A>
void visit(A& a, TendonPoint& x) {
  auto& [body, position] = x;
  a(body, position);
}
template <class A>
void visit(A& a, TendonWrap& x) {
  auto& [body, X_BG, radius, cylinder, side] = x;
  a(body, X_BG, radius, cylinder, side);
}
template <class A>
void visit(A& a, TendonSegment& x) {
  auto& [from, to, wrap, share] = x;
  a(from, to, wrap, share);
}
template <class A>
void visit(A& a, TendonServo& x) {
  auto& [stiffness, damping, target, speed, least, most] = x;
  a(stiffness, damping, target, speed, least, most);
}
template <class A>
void visit(A& a, Tendon& x) {
  auto& [name, joints, path, wraps, stiffness, shortest, longest, damping, friction, lower, upper,
         servo] = x;
  a(name, joints, path, wraps, stiffness, shortest, longest, damping, friction, lower, upper,
    servo);
}
template <class A>
void visit(A& a, Muscle& x) {
  auto& [curves, force, optimal, slack, pennation, speed, damping, shortest, longest, passive,
         eccentric, activation, deactivation, smoothing] = x;
  a(curves, force, optimal, slack, pennation, speed, damping, shortest, longest, passive, eccentric,
    activation, deactivation, smoothing);
}
template <class A>
void visit(A& a, Actuator& x) {
  auto& [name, transmission, joint, tendon, body, frame, point, direction, reach, gear, command,
         least_command, most_command, delay, samples, slew, lag, integrates, least_setpoint,
         most_setpoint, law, gain, bias, stiffness, damping, command_damping, kp, ki, kd,
         integral_limit, torque_constant, resistance, inductance, current_limit, muscle, least,
         most, z_index] = x;
  a(name, transmission, joint, tendon, body, frame, point, direction.torque, direction.force, reach,
    gear, command, least_command, most_command, delay, samples, slew, lag, integrates,
    least_setpoint, most_setpoint, law, gain, bias);
  a(stiffness, damping, command_damping, kp, ki, kd, integral_limit, torque_constant, resistance,
    inductance, current_limit, muscle, least, most, z_index);
}
template <class A>
void visit(A& a, SensorErrors& x) {
  auto& [bias, noise, quantum, rate, delay] = x;
  a(bias, noise, quantum, rate, delay);
}
template <class A>
void visit(A& a, Sensor& x) {
  auto& [name, kinds, frame, X_FS, reference, own_axes, joint, tendon, actuator, geometries, others,
         size, limit, errors] = x;
  a(name, kinds, frame, X_FS, reference, own_axes, joint, tendon, actuator, geometries, others,
    size, limit, errors);
}
template <class A>
void visit(A& a, Note& x) {
  auto& [where, message] = x;
  a(where, message);
}
template <class A>
void visit(A& a, Spring& x) {
  auto& [stiffness, damping, dissipation] = x;
  a(stiffness, damping, dissipation);
}
template <class A>
void visit(A& a, Material& x) {
  auto& [friction, restitution, torsional, rolling, at_rest, stribeck_speed, stiffness, damping,
         dissipation, per_area, axis, across, of_second, surface_velocity] = x;
  a(friction, restitution, torsional, rolling, at_rest, stribeck_speed, stiffness, damping,
    dissipation, per_area, axis, across, of_second, surface_velocity);
}
template <class A>
void visit(A& a, Terrain::Triangle& x) {
  auto& [vertices, normal, neighbors, edges] = x;
  a(vertices, normal, neighbors, edges);
}
template <class A>
void visit(A& a, TriangleTree::Node& x) {
  auto& [low, high, first, count, right] = x;
  a(low, high, first, count, right);
}
template <class A>
void visit(A& a, Terrain& x) {
  auto& [vertices, triangles, low, high, dropped, misfits, source, tree, neighbors] = x;
  a(vertices, triangles, low, high, dropped, misfits, source, tree.nodes, tree.order, neighbors);
}
template <class A>
void visit(A& a, Shape& x) {
  auto& [type, size, mesh, terrain] = x;
  a(type, size);
  a.shared(mesh, a.meshes);
  a.shared(terrain, a.terrains);
}
template <class A>
void visit(A& a, Geometry& x) {
  auto& [name, body, frame, instance, assembly, whole, X_BG, shape, material] = x;
  a(name, body, frame, instance, assembly, whole, X_BG, shape, material);
}
template <class A>
void visit(A& a, PairMaterial& x) {
  auto& [geometry_a, geometry_b, material] = x;
  a(geometry_a, geometry_b, material);
}
template <class A>
void visit(A& a, ContactOptions& x) {
  auto& [model, compliance, smoothing, stabilization, speed, margin, reach, slip_time] = x;
  a(model, compliance, smoothing, stabilization, speed, margin, reach, slip_time);
}
template <class A>
void visit(A& a, StepControlOptions& x) {
  auto& [tolerance, relative, event, min_step, max_step, interval, strict] = x;
  a(tolerance, relative, event, min_step, max_step, interval, strict);
}
template <class A>
void visit(A& a, SimulationOptions& x) {
  auto& [h, integrator, duration, max_speed, closing_time, budget, contact, effects, mean_forces,
         push_deep, control] = x;
  a(h, integrator, duration, max_speed, closing_time, budget, contact, effects, mean_forces,
    push_deep, control);
}

}  // namespace archive

namespace {

/// 64-bit FNV-1a; detects damage, not manipulation.
std::uint64_t checksum(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return hash;
}

}  // namespace

/// Accesses the members of a model through ModelEditor.
class ModelArchive {
 public:
  template <class A>
  static void visit_model(A& a, Model& model) {
    std::apply([&](auto&... parts) { a(parts...); }, ModelEditor::parts(model));
  }
};

std::string archive_scene(const Scene& scene) {
  archive::Writer out;
  Scene copy = scene;
  out.bytes = kMark;
  out(copy.name, copy.q, copy.v, copy.options);
  ModelArchive::visit_model(out, copy.model);
  std::uint64_t sum = checksum(out.bytes);
  out.plain(sum);
  return std::move(out.bytes);
}

Scene restore_scene(std::string_view bytes) {
  if (bytes.substr(0, kMark.size()) != kMark)
    throw InputError(
        "scene archive: not of this version of Counterpoint; load the scene's file, or "
        "archive it anew");
  std::uint64_t sum = 0;
  if (bytes.size() < kMark.size() + sizeof sum) throw InputError("scene archive: cut short");
  archive::Reader(bytes.substr(bytes.size() - sizeof sum), kWhat).plain(sum);
  bytes.remove_suffix(sizeof sum);
  if (checksum(bytes) != sum) throw InputError("scene archive: damaged, or cut short");
  archive::Reader in(bytes.substr(kMark.size()), kWhat);
  Scene scene;
  in(scene.name, scene.q, scene.v, scene.options);
  ModelArchive::visit_model(in, scene.model);
  if (!in.bytes.empty()) throw InputError("scene archive: damaged, bytes are left over");
  if (scene.q.size() != scene.model.nq() || scene.v.size() != scene.model.nv())
    throw InputError("scene archive: damaged, sizes do not agree");
  return scene;
}

}  // namespace counterpoint
