// counterpoint inspect: lists the contents of a scene.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>

#include "command.h"
#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/geometry.h"
#include "input/scene_arguments.h"
#include "report/effect_table.h"
#include "report/part_tables.h"
#include "report/report.h"
#include "report/sensor_log.h"

namespace counterpoint::apps {
namespace {

struct InspectArguments {
  SceneArguments scene;
  bool costs = false;
  Report report;
};

/// Vertices and volume of a hull; the ratio of its volume to its mesh's, its distance from the
/// mesh, and its distance within the full hull if a vertex limit reduced it.
std::string hull_size(const ConvexMesh& hull, bool is_piece) {
  std::string text = fmt::format("{} vertices, {:.4g} m^3", hull.vertices.size(), hull.volume);
  if (is_piece) return text + ", a piece";
  text += hull.source_volume > 0.0
              ? fmt::format(", {:.3g} x its mesh", hull.volume / hull.source_volume)
              : ", mesh not closed";
  if (is_visibly_concave(hull)) text += fmt::format(", concave: {:.2g} m off it", hull.standoff);
  if (hull.deviation > 0.0) text += fmt::format(", {:.2g} m within the full hull", hull.deviation);
  return text;
}

/// Dimensions of a shape [m] as in a URDF (full lengths, not half), or the vertex count.
std::string shape_size(const Geometry& geometry) {
  const Shape& shape = geometry.shape;
  const Vector3& s = shape.size;
  switch (shape.type) {
    case ShapeType::kPlane:
      return "";
    case ShapeType::kSphere:
      return fmt::format("radius {:.4g}", s.x());
    case ShapeType::kBox:
      return fmt::format("{:.4g} x {:.4g} x {:.4g}", 2 * s.x(), 2 * s.y(), 2 * s.z());
    case ShapeType::kCapsule:
    case ShapeType::kCylinder:
      return fmt::format("radius {:.4g} length {:.4g}", s.x(), 2 * s.y());
    case ShapeType::kConvexMesh:
      return hull_size(*shape.mesh, geometry.whole >= 0);
    case ShapeType::kTerrain: {
      const Vector3 extent = shape.terrain->high - shape.terrain->low;
      return fmt::format("{} triangles, {:.4g} x {:.4g} x {:.4g}", shape.terrain->triangles.size(),
                         extent.x(), extent.y(), extent.z());
    }
  }
  return "";
}

std::string link_name(const Model& model, int body) {
  return body == 0 ? "world" : model.joint(body - 1).link;
}

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// Adds a list to the report and prints a line for each entry, below a title if there are any.
void report_list(const char* key, const std::string& title, const char* line, const Json& list,
                 Report& report) {
  if (!list.empty()) report.print("{}", title);
  for (const Json& entry : list) report.print("{}", format_entries(line, entry));
  report[key] = list;
}

Json surface_json(const Material& m) {
  return {{"friction", m.friction},
          {"static_friction", m.friction_at_rest()},
          {"stribeck_speed_m_s", m.stribeck_speed},
          {"friction_across", m.across_share() * m.friction},
          {"restitution", m.restitution},
          {"torsional_friction_m", m.torsional_friction},
          {"rolling_friction_m", m.rolling_friction},
          {"stiffness_N_m", number_or_null(m.stiffness)},
          {"damping_N_s_m", m.damping},
          {"dissipation_s_m", m.dissipation},
          {"stiffness_per_area_N_m3", number_or_null(m.per_area.stiffness)},
          {"damping_per_area_N_s_m3", m.per_area.damping},
          {"dissipation_per_area_s_m", m.per_area.dissipation}};
}

/// Stiffness [N/m], per area, or both.
std::string stiffness_text(const Material& m) {
  const bool point = std::isfinite(m.stiffness), area = m.per_area.is_soft();
  if (!point && !area) return "hard";
  const std::string text = point ? fmt::format("{:.4g}", m.stiffness) : "";
  if (!area) return text;
  return fmt::format("{}{}{:.4g} /m^2", text, point ? ", " : "", m.per_area.stiffness);
}

/// Reports springs, servos, drag and carried weight, each only if the scene has any.
void inspect_forces(const Model& model, Report& report) {
  if (!model.springs().empty()) report.print("\nsprings:\n");
  for (const JointSpring& spring : model.springs())
    report.print("  {:<28} stiffness {:.4g}, reference {:.4g}\n", model.joint(spring.joint).name,
                 spring.stiffness, spring.reference);
  if (!model.servos().empty()) report.print("\nservos:\n");
  for (const JointServo& servo : model.servos())
    report.print(
        "  {:<28} stiffness {:.4g}, damping {:.4g}; target position {:.4g}, velocity {:.4g}\n",
        model.joint(servo.joint).name, servo.stiffness, servo.damping, servo.position,
        servo.velocity);
  report_tendons(model, report);
  report_actuators(model, report);
  Json drags = Json::array(), compensations = Json::array();
  for (const auto& [body, center, drag] : model.drags())
    drags.push_back({{"link", link_name(model, body)},
                     {"center_m", vector_json(center)},
                     {"linear", drag.linear},
                     {"quadratic", drag.quadratic},
                     {"angular", drag.angular},
                     {"angular_quadratic", drag.angular_quadratic}});
  for (const GravityCompensation& carried : model.gravity_compensations())
    compensations.push_back({{"link", link_name(model, carried.body)},
                             {"center_m", vector_json(carried.center)},
                             {"mass_kg", carried.mass}});
  report_list("drags", "\ndrag:\n",
              "  {link:<28} linear {linear:.4g}, quadratic {quadratic:.4g}, angular {angular:.4g}, "
              "quadratic {angular_quadratic:.4g}\n",
              drags, report);
  report_list("gravity_compensations", "\ncarried weight:\n", "  {link:<28} of {mass_kg:.6g} kg\n",
              compensations, report);
}

void inspect_bodies(const Model& model, Report& report) {
  report.print("\n{:<28} {:<24} {:<10} {:<24} {:>10} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "joint",
               "link", "type", "parent", "mass", "lower", "upper", "effort", "damping", "friction");
  Json joints = Json::array();
  double total = 0.0;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const JointInfo& joint = model.joint(i - 1);
    total += body.inertia.mass;
    const double damping = model.damping()[body.v_index];
    const double dry_friction = model.dry_friction()[body.v_index];
    report.print(
        "{:<28} {:<24} {:<10} {:<24} {:>10.4g} {:>9.4g} {:>9.4g} {:>9.4g} {:>9.4g} {:>9.4g}\n",
        joint.name, joint.link, joint_type_name(body.joint_type), link_name(model, body.parent),
        body.inertia.mass, joint.lower, joint.upper, joint.effort_limit, damping, dry_friction);
    joints.push_back({{"name", joint.name},
                      {"link", joint.link},
                      {"parent", link_name(model, body.parent)},
                      {"type", joint_type_name(body.joint_type)},
                      {"mass_kg", body.inertia.mass},
                      {"center_of_mass_m", vector_json(body.inertia.center)},
                      {"lower", number_or_null(joint.lower)},
                      {"upper", number_or_null(joint.upper)},
                      {"effort_limit", number_or_null(joint.effort_limit)},
                      {"velocity_limit", number_or_null(joint.velocity_limit)},
                      {"damping", damping},
                      {"dry_friction", dry_friction},
                      {"breakaway_friction", model.friction_at_rest(body.v_index)},
                      {"stribeck_speed", model.stribeck_speed()[body.v_index]},
                      {"armature", model.armature()[body.v_index]},
                      {"actuated", joint.actuated},
                      {"prescribed", joint.prescribed}});
    joints.back().update(joint_forces_json(model, i - 1));
  }
  report.print("total mass {:.6g} kg\n", total);
  report["mass_kg"] = total;
  report["joints"] = joints;
}

/// Reports the meshes that collide as convex pieces.
void inspect_pieces(const Model& model, Report& report) {
  Json meshes = Json::array();
  const std::vector<Geometry>& all = model.geometries();
  for (size_t i = 0; i < all.size(); ++i) {
    if (all[i].whole != static_cast<int>(i)) continue;
    const auto of_mesh = [&](const Geometry& g) { return g.whole == all[i].whole; };
    meshes.push_back({{"name", all[i].name.substr(0, all[i].name.rfind('#'))},
                      {"pieces", std::count_if(all.begin(), all.end(), of_mesh)},
                      {"standoff_m", all[i].shape.mesh->union_standoff}});
  }
  report_list("meshes_in_pieces", "\nmeshes that collide as convex pieces:\n",
              "  {name:<28} {pieces} pieces, up to {standoff_m:.2g} m off the mesh\n", meshes,
              report);
}

void inspect_geometries(const Model& model, Report& report) {
  report.print("\n{:<32} {:<24} {:<12} {:<44} {:>8} {:>11}\n", "geometry", "link", "shape",
               "size [m]", "friction", "restitution");
  Json geometries = Json::array();
  for (const Geometry& geometry : model.geometries()) {
    const Material& material = geometry.material;
    report.print("{:<32} {:<24} {:<12} {:<44} {:>8.4g} {:>11.4g}\n", geometry.name,
                 link_name(model, geometry.body),
                 shape_type_name(geometry.shape.type, "convex mesh"), shape_size(geometry),
                 material.friction, material.restitution);
    Json entry = {{"name", geometry.name},
                  {"link", link_name(model, geometry.body)},
                  {"shape", shape_type_name(geometry.shape.type, "convex mesh")},
                  {"size_m", vector_json(geometry.shape.size)},
                  {"friction_axis", vector_json(material.friction_axis)},
                  {"surface_velocity_m_s", vector_json(material.surface_velocity)}};
    entry.update(surface_json(material));
    if (geometry.shape.mesh) {
      entry["vertices"] = geometry.shape.mesh->vertices.size();
      entry["volume_m3"] = geometry.shape.mesh->volume;
      entry["mesh_volume_m3"] = geometry.shape.mesh->source_volume;
      entry["hull_standoff_m"] = geometry.shape.mesh->standoff;
      entry["concave"] = is_visibly_concave(*geometry.shape.mesh);
      entry["hull_deviation_m"] = geometry.shape.mesh->deviation;
      entry["piece"] = geometry.whole >= 0;
      entry["surface_standoff_m"] =
          geometry.whole >= 0 ? geometry.shape.mesh->union_standoff : geometry.shape.mesh->standoff;
    }
    geometries.push_back(std::move(entry));
  }
  report["geometries"] = geometries;
  inspect_pieces(model, report);
}

void inspect_closures(const Model& model, const VectorX& q, Report& report) {
  Json closures = Json::array();
  const std::vector<Pose> X_WB = body_poses(model, q);
  for (const Closure& closure : model.closures()) {
    const ClosureGap gap = closure_gap(closure, X_WB, model.default_z());
    Json& entry = closures.emplace_back(closure_json(closure, gap));
    entry["link_a"] = link_name(model, closure.body_a);
    entry["link_b"] = link_name(model, closure.body_b);
  }
  report_list(
      "closures", "\nclosures:\n",
      "  {name} ({type}): {link_a} - {link_b}, open by {open_m:.3g} m, {open_rad:.3g} rad\n",
      closures, report);
  for (const Closure& closure : model.closures())
    if (closure.switched)
      report.print("  {} is switched, {} at the start; it breaks above {:.6g} N, {:.6g} N m\n",
                   closure.name, closure.attached ? "attached" : "open", closure.breaking_force,
                   closure.breaking_torque);
}

/// Reports the pairs of geometries that are never tested.
void inspect_pairs(const Model& model, const collision::Collider& collider, Report& report) {
  Json excluded = Json::array(), overlapping = Json::array();
  const auto add = [&](const std::pair<int, int>& pair, const std::string& reason, Json& list) {
    list.push_back({{"a", model.geometries()[pair.first].name},
                    {"b", model.geometries()[pair.second].name},
                    {"reason", reason}});
  };
  for (size_t i = 0; i < model.excluded_geometry_pairs().size(); ++i) {
    const std::string& reason = model.exclusion_reasons()[i];
    add(model.excluded_geometry_pairs()[i], reason.empty() ? "excluded" : reason, excluded);
  }
  for (const auto& pair : collider.overlapping_pairs())
    add(pair, "overlapping in the default pose", overlapping);
  report.print("\n{} geometry pairs may touch; left out: {} of links joined by a joint{}\n",
               collider.num_enabled_pairs(), collider.num_joined_pairs(),
               excluded.empty() && overlapping.empty() ? "" : ", and:");
  report["enabled_pairs"] = collider.num_enabled_pairs();
  report["joined_pairs"] = collider.num_joined_pairs();
  report_list("excluded_pairs", "", "  {a} - {b}  ({reason})\n", excluded, report);
  report_list("overlapping_pairs", "", "  {a} - {b}  ({reason})\n", overlapping, report);
}

/// Reports the pairs of geometries that may touch, grouped by their combined material.
void inspect_surfaces(const Model& model, const collision::Collider& collider, Report& report) {
  struct Surface {
    Material material;
    int pairs, a, b;  // number of pairs, and the first pair
  };
  std::map<std::array<double, 13>, Surface> surfaces;
  const int count = static_cast<int>(model.geometries().size());
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) {
      if (!collider.may_touch(a, b)) continue;
      const Material m = model.pair_material(a, b);
      const std::array key{m.friction,
                           m.restitution,
                           m.torsional_friction,
                           m.rolling_friction,
                           m.friction_at_rest(),
                           m.stribeck_speed,
                           m.across_share(),
                           m.stiffness,
                           m.damping,
                           m.dissipation,
                           m.per_area.stiffness,
                           m.per_area.damping,
                           m.per_area.dissipation};
      ++surfaces.try_emplace(key, Surface{m, 0, a, b}).first->second.pairs;
    }
  }
  if (!surfaces.empty())
    report.print("\n{:<52} {:>6} {:>8} {:>8} {:>8} {:>11} {:>11} {:>11} {:>15}\n",
                 "surfaces of pairs", "pairs", "friction", "across", "at rest", "restitution",
                 "torsion [m]", "rolling [m]", "stiffness [N/m]");
  Json list = Json::array();
  for (const auto& [key, surface] : surfaces) {
    const auto& [m, pairs, a, b] = surface;
    const std::string &name_a = model.geometries()[a].name, &name_b = model.geometries()[b].name;
    report.print("{:<52} {:>6} {:>8.4g} {:>8.4g} {:>8.4g} {:>11.4g} {:>11.4g} {:>11.4g} {:>15}\n",
                 fmt::format("{} - {}{}", name_a, name_b, pairs > 1 ? ", ..." : ""), pairs,
                 m.friction, m.across_share() * m.friction, m.friction_at_rest(), m.restitution,
                 m.torsional_friction, m.rolling_friction, stiffness_text(m));
    list.push_back({{"pairs", pairs}, {"between", {name_a, name_b}}});
    list.back().update(surface_json(m));
  }
  report["surfaces"] = list;
}

void inspect_coordinates(const Model& model, Report& report) {
  const CoordinateNames names = coordinate_names(model);
  const std::vector<std::string> targets = InputColumns::of(model).names(model);
  report["coordinates"] = {
      {"q", names.q}, {"v", names.v}, {"force", names.force}, {"target", targets}};
  report.print("\napplied forces and other inputs (columns of --inputs):\n ");
  for (const std::string& name : names.force) report.print(" {}", name);
  for (const std::string& name : targets) report.print(" {}", name);
  report.print("{}\n", names.force.empty() ? " none" : "");
}

void inspect_notes(const Model& model, Report& report) {
  Json notes = Json::array();
  for (const Note& note : collision::all_notes(model))
    notes.push_back({{"where", note.where}, {"message", note.message}});
  report_list("notes", "\nnotes:\n", "  {where}: {message}\n", notes, report);
}

int inspect(InspectArguments& arguments) {
  const Scene scene = arguments.scene.load();
  const Model& model = scene.model;
  Report& report = arguments.report;
  report.begin("inspect", arguments.scene.file);
  report["name"] = scene.name;
  report["trees"] = model.num_trees();
  report["nq"] = model.nq();
  report["nv"] = model.nv();
  report["gravity_m_s2"] = vector_json(model.gravity());
  report["time_step_s"] = scene.options.time_step;
  report["duration_s"] = scene.options.duration;
  report.print(
      "{}: {} moving bodies in {} trees, {} coordinates, {} velocities; time step {:.6g} s, "
      "duration {:.6g} s\n",
      scene.name, model.num_joints(), model.num_trees(), model.nq(), model.nv(),
      scene.options.time_step, scene.options.duration);
  inspect_bodies(model, report);
  inspect_forces(model, report);
  inspect_geometries(model, report);
  inspect_closures(model, scene.q, report);
  const collision::Collider collider(model);
  inspect_pairs(model, collider, report);
  inspect_surfaces(model, collider, report);
  inspect_coordinates(model, report);
  report_sensors(model, report);
  const std::vector<EffectUse> uses = list_effects(model, collider, scene.options);
  report_effects(uses, report);
  report_phases(scene, report);
  if (arguments.costs) report_costs(scene, uses, report);
  inspect_notes(model, report);
  report.write();
  return kSuccess;
}

}  // namespace

void add_inspect(CommandLine& line) {
  auto [command, arguments] = line.add<InspectArguments>(
      "inspect",
      "List joints, limits, geometries, materials, closures, pairs, effects and what they cost, "
      "and notes of a scene",
      "Example:\n  counterpoint inspect robot.urdf --base floating --ground", inspect);
  arguments.scene.add_to(command);
  command.add("--costs", arguments.costs,
              "Also the time of a step as effects are added one by one");
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
