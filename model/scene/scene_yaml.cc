#include "counterpoint/model/scene/scene_yaml.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/scene/scene_actuators.h"
#include "counterpoint/model/scene/scene_closures.h"
#include "counterpoint/model/scene/scene_models.h"
#include "counterpoint/model/scene/scene_sensors.h"
#include "counterpoint/model/scene/scene_shapes.h"
#include "counterpoint/model/scene/scene_tendons.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

namespace fs = std::filesystem;

/// Reads one scene file (docs/reference/scene-format.md) from top to bottom.
class SceneReader {
 public:
  SceneReader(const YamlValue& root, const fs::path& file, const SceneOverrides& overrides)
      : root_(root),
        folder_(file.parent_path()),
        scene_name_(root.has("name") ? root.at("name").text() : file.stem().string()),
        builder_(read_gravity(root)),
        models_(folder_, urdf_options_, builder_) {
    if (root.has("defaults")) {
      const YamlValue defaults = root.at("defaults");
      defaults.expect_map({}, kSurfaceKeys);
      refuse_surface_velocity(defaults);
      urdf_options_.default_material = read_material(defaults, Material());
    }
    urdf_options_.packages = overrides.packages;
    if (root.has("packages")) {
      for (const auto& [name, value] : root.at("packages").entries()) {
        urdf_options_.packages.emplace(name, resolved(folder_, value.text()));
      }
    }
    const int hull_vertices =
        root.has("hull_vertices") ? root.at("hull_vertices").integer(4, 1'000'000) : 0;
    const MeshCollisions meshes =
        root.has("meshes") ? read_mesh_collisions(root.at("meshes")) : MeshCollisions{};
    urdf_options_.hulls = std::make_shared<HullCache>(hull_vertices, meshes);
    urdf_options_.repair_inertias =
        overrides.repair_inertias ||
        (root.has("repair_inertias") && root.at("repair_inertias").boolean());
    urdf_options_.repair_joints = overrides.repair_joints ||
                                  (root.has("repair_joints") && root.at("repair_joints").boolean());
    const double filled = overrides.fill_inertia > 0.0 ? overrides.fill_inertia
                          : root.has("fill_inertia")   ? root.at("fill_inertia").positive()
                                                       : 0.0;
    if (filled > 0.0) builder_.fill_inertia(filled);
  }

  Scene read() {
    const SimulationOptions options = read_options();
    take_each("models",
              [&](const YamlValue& in, std::size_t count) { models_.read(in, count == 1); });
    take("ground", [&](const YamlValue& in) { read_ground(in); });
    take_each("environment", [&](const YamlValue& in, std::size_t) { read_environment(in); });
    // The sections below refer to names defined above.
    faults_.throw_if_any();
    take("groups", [&](const YamlValue& in) { read_groups(in); });
    faults_.throw_if_any();
    take_each("exclude", [&](const YamlValue& in, std::size_t) { read_exclusion(in); });
    take_each("pairs", [&](const YamlValue& in, std::size_t) { read_pair(in); });
    take_each("closures",
              [&](const YamlValue& in, std::size_t) { builder_.add_closure(read_closure(in)); });
    take_each("tendons",
              [&](const YamlValue& in, std::size_t) { builder_.add_tendon(read_tendon(in)); });
    take_each("actuators",
              [&](const YamlValue& in, std::size_t) { builder_.add_actuator(read_actuator(in)); });
    take_each("sensors",
              [&](const YamlValue& in, std::size_t) { builder_.add_sensor(read_sensor(in)); });
    faults_.throw_if_any();
    Model model = build();
    VectorX q = model.default_q();
    VectorX v = models_.start_velocities(model);
    return {scene_name_, std::move(model), std::move(q), std::move(v), options};
  }

 private:
  /// Reads the value of a key of the scene, if present; an error is collected.
  template <class Read>
  void take(const char* key, Read&& read) {
    if (root_.has(key)) faults_.collect([&] { read(root_.at(key)); });
  }
  /// Reads every item of a list; `read` gets the item and the number of items.
  template <class Read>
  void take_each(const char* key, Read&& read) {
    take(key, [&](const YamlValue& in) {
      const std::vector<YamlValue> items = in.list();
      for (const YamlValue& item : items) faults_.collect([&] { read(item, items.size()); });
    });
  }

  static Vector3 read_gravity(const YamlValue& root) {
    root.expect_map(
        {"name",         "gravity",         "time_step",     "duration",      "contact",
         "packages",     "repair_inertias", "defaults",      "models",        "ground",
         "environment",  "exclude",         "groups",        "hull_vertices", "meshes",
         "closures",     "effects",         "max_speed",     "closing_time",  "integrator",
         "step_control", "velocity_forces", "repair_joints", "fill_inertia",  "pairs",
         "tendons",      "actuators",       "sensors",       "step_budget"});
    if (root.has("gravity")) return root.at("gravity").vector3();
    return {0, 0, -kStandardGravity};
  }

  SimulationOptions read_options() {
    SimulationOptions o;
    take("time_step", [&](const YamlValue& in) { o.time_step = in.positive(); });
    take("integrator", [&](const YamlValue& in) { o.integrator = read_integrator(in); });
    take("duration", [&](const YamlValue& in) { o.duration = in.number(0.0, kInfinity); });
    take("max_speed", [&](const YamlValue& in) { o.max_speed = read_bound(in); });
    take("closing_time", [&](const YamlValue& in) { o.closing_time = read_bound(in); });
    take("step_budget", [&](const YamlValue& in) { o.step_budget = read_budget(in); });
    take("velocity_forces",
         [&](const YamlValue& in) { o.mean_velocity_forces = read_velocity_forces(in); });
    take("effects", [&](const YamlValue& in) { read_effects(in, o.effects); });
    take("step_control", [&](const YamlValue& in) { o.step_control = read_step_control(in); });
    take("contact", [&](const YamlValue& in) { read_contact(in, o.contact); });
    return o;
  }

  static int read_budget(const YamlValue& in) {
    if (in.is_text("none")) return 0;
    return in.integer(1, std::numeric_limits<int>::max());
  }

  static Integrator read_integrator(const YamlValue& in) {
    const auto integrator = integrator_from_name(in.text());
    if (!integrator)
      in.fail("'" + in.text() +
              "' is not one of semi_implicit_euler, implicit_midpoint, runge_kutta_4");
    return *integrator;
  }

  static StepControlOptions read_step_control(const YamlValue& in) {
    in.expect_map({"tolerance", "relative_tolerance", "event_tolerance", "min_step", "max_step",
                   "interval", "strict"});
    StepControlOptions out;
    if (in.has("tolerance")) out.tolerance = in.at("tolerance").positive();
    if (in.has("relative_tolerance"))
      out.relative_tolerance = in.at("relative_tolerance").number(0.0, kInfinity);
    if (in.has("event_tolerance")) out.event_tolerance = in.at("event_tolerance").positive();
    if (in.has("min_step")) out.min_step = in.at("min_step").positive();
    if (in.has("max_step")) out.max_step = in.at("max_step").positive();
    if (in.has("interval")) out.interval = in.at("interval").number(0.0, kInfinity);
    if (in.has("strict")) out.strict = in.at("strict").boolean();
    if (const std::string flaw = step_control_flaw(out); !flaw.empty()) in.fail(flaw);
    return out;
  }

  static bool read_velocity_forces(const YamlValue& in) {
    if (!in.is_text("mean") && !in.is_text("start")) in.fail("mean or start is expected");
    return in.is_text("mean");
  }

  static double read_bound(const YamlValue& in) {
    return in.is_text("none") ? kInfinity : in.positive();
  }

  /// Reads `effects: {NAME: on or off}`.
  static void read_effects(const YamlValue& in, EffectSet& effects) {
    for (const auto& [name, value] : in.entries()) {
      const auto effect = effect_from_name(name);
      if (!effect) value.fail("'" + name + "' is no effect; known: " + effect_names());
      effects.set(*effect, value.boolean());
    }
  }

  static void read_preset(const YamlValue& value, ContactOptions& contact) {
    const auto preset = contact_preset_from_name(value.text());
    if (!preset) value.fail("'" + value.text() + "' is not one of fast, default, hard");
    apply_contact_preset(*preset, contact);
  }

  /// Reads `contact: fast`, or `contact: {preset: fast, ...}`; other keys override the preset.
  static void read_contact(const YamlValue& in, ContactOptions& contact) {
    if (!in.is_map()) return read_preset(in, contact);
    in.expect_map({"preset", "friction_model", "compliance", "smoothing", "stabilization",
                   "max_recovery_speed", "margin", "reach_acceleration", "slip_time"});
    if (in.has("preset")) read_preset(in.at("preset"), contact);
    if (in.has("friction_model")) {
      const YamlValue value = in.at("friction_model");
      const auto model = friction_model_from_name(value.text());
      if (!model) value.fail("'" + value.text() + "' is not one of convex, lagged, coulomb");
      contact.friction_model = *model;
    }
    if (in.has("compliance")) contact.compliance = in.at("compliance").positive();
    if (in.has("smoothing")) contact.smoothing = in.at("smoothing").number(0.0, kInfinity);
    if (in.has("stabilization")) contact.stabilization = in.at("stabilization").number(0.0, 1.0);
    if (in.has("max_recovery_speed")) {
      contact.max_recovery_speed = in.at("max_recovery_speed").number(0.0, kInfinity);
    }
    if (in.has("margin")) contact.margin = in.at("margin").number(0.0, kInfinity);
    if (in.has("reach_acceleration"))
      contact.reach_acceleration = in.at("reach_acceleration").number(0.0, kInfinity);
    if (in.has("slip_time")) contact.slip_time = in.at("slip_time").positive();
  }

  static Matrix3 read_normal(const YamlValue& in) {
    const Vector3 normal = in.vector3();
    if (normal.norm() < 1e-9) in.fail("a normal cannot be zero");
    return rotation_z_to(normal.normalized());
  }

  void read_ground(const YamlValue& in) {
    in.expect_map({"height", "normal"}, kSurfaceKeys);
    Pose pose;
    if (in.has("height")) pose.translation.z() = in.at("height").number();
    if (in.has("normal")) pose.rotation = read_normal(in.at("normal"));
    const Material material = read_material(in, urdf_options_.default_material);
    located(in, [&] {
      return builder_.add_environment(kGroundName, {ShapeType::kPlane, {}, nullptr}, pose,
                                      material);
    });
  }

  void read_environment(const YamlValue& in) {
    in.expect_map({"name", "plane", "sphere", "box", "capsule", "cylinder", "mesh", "triangle_mesh",
                   "height_field", "scale", "position", "rpy", "quaternion"},
                  kSurfaceKeys);
    const Shape shape = read_shape(in, folder_, *urdf_options_.hulls);
    const std::string name = in.at("name").text();
    if (shape.mesh && !hull_note(*shape.mesh).empty()) {
      builder_.add_note({in.where() + ": environment '" + name + "'",
                         "mesh '" + in.at("mesh").text() + "' " + hull_note(*shape.mesh)});
    }
    if (shape.terrain) note_flaws(*shape.terrain, in.where() + ": environment '" + name + "'");
    const Material material = read_material(in, urdf_options_.default_material);
    Pose pose = read_pose(in);
    if (in.has("plane")) pose.rotation = pose.rotation * read_normal(in.at("plane"));
    located(in, [&] { return builder_.add_environment(name, shape, pose, material); });
  }

  void note_flaws(const Terrain& terrain, const std::string& where) {
    if (terrain.dropped > 0) {
      builder_.add_note({where, fmt::format("{} triangles without area, or given twice, left out",
                                            terrain.dropped)});
    }
    if (terrain.misfits > 0) {
      builder_.add_note(
          {where,
           fmt::format("{} edges at which triangles of opposite orientation or more than two "
                       "triangles meet; a triangle pushes to the side from which its corners "
                       "run counter-clockwise only",
                       terrain.misfits)});
    }
  }

  /// Reads `groups: {NAME: [links or geometries]}`, for exclusions and pairs.
  void read_groups(const YamlValue& in) {
    for (const auto& [name, value] : in.entries()) {
      std::vector<std::string>& members = groups_[name];
      for (const YamlValue& member : value.list()) members.push_back(member.text());
      if (members.empty()) value.fail("a group needs at least one link or geometry");
      for (const std::string& member : members) {
        // Names are checked here, even if the group is not used.
        located(value, [&] { builder_.geometries_named(member); });
      }
    }
  }

  std::vector<std::string> members(const std::string& name) const {
    const auto group = groups_.find(name);
    return group == groups_.end() ? std::vector<std::string>{name} : group->second;
  }

  void read_exclusion(const YamlValue& in) {
    const std::vector<YamlValue> pair = in.list();
    if (pair.size() != 2) in.fail("two names [a, b] are expected");
    const std::string name_a = pair[0].text(), name_b = pair[1].text();
    const bool by_group = groups_.count(name_a) + groups_.count(name_b) > 0;
    const std::string reason = by_group
                                   ? fmt::format("excluded by the scene: [{}, {}]", name_a, name_b)
                                   : "excluded by the scene";
    for (const std::string& a : members(name_a)) {
      for (const std::string& b : members(name_b)) {
        located(in, [&] { builder_.exclude_pair(a, b, reason); });
      }
    }
  }

  /// Reads `{between: [a, b], friction: ..., collide: true}` for links, geometries or groups.
  void read_pair(const YamlValue& in) {
    in.expect_map({"between", "collide"}, kSurfaceKeys);
    refuse_surface_velocity(in);
    const std::vector<YamlValue> between = in.at("between").list();
    if (between.size() != 2) in.at("between").fail("two names [a, b] are expected");
    PairSurface surface;
    const auto read = [&](const char* key, double high, std::optional<double>& value) {
      if (in.has(key)) value = in.at(key).number(0.0, high);
    };
    if (const auto friction = read_friction(in)) {
      surface.friction = friction->along;
      surface.friction_across = friction->across;
      if (!friction->axis.isZero(0.0)) surface.friction_axis = friction->axis;
    }
    read("static_friction", kInfinity, surface.static_friction);
    if (in.has("stribeck_speed")) surface.stribeck_speed = in.at("stribeck_speed").positive();
    if (surface.friction) expect_static_friction(in, *surface.friction);
    read("restitution", 1.0, surface.restitution);
    read("torsional_friction", kInfinity, surface.torsional_friction);
    read("rolling_friction", kInfinity, surface.rolling_friction);
    expect_one_stiffness(in);
    if (in.has("stiffness")) surface.stiffness = in.at("stiffness").positive();
    if (in.has("stiffness_per_area"))
      surface.stiffness_per_area = in.at("stiffness_per_area").positive();
    read("damping_per_area", kInfinity, surface.damping_per_area);
    read("damping", kInfinity, surface.damping);
    read("dissipation", kInfinity, surface.dissipation);
    const bool collide = in.has("collide") && in.at("collide").boolean();
    if (in.has("collide") && !collide)
      in.at("collide").fail("true is expected; pairs that never collide go under `exclude`");
    for (const std::string& a : members(between[0].text())) {
      for (const std::string& b : members(between[1].text())) {
        located(in, [&] {
          if (collide) builder_.include_pair(a, b);
          builder_.set_pair_surface(a, b, surface);
        });
      }
    }
  }

  Model build() {
    return located(root_, [&] { return builder_.build(); });
  }

  const YamlValue root_;
  fs::path folder_;
  std::string scene_name_;
  UrdfOptions urdf_options_;
  ModelBuilder builder_;
  ModelReader models_;
  std::map<std::string, std::vector<std::string>> groups_;
  Faults faults_;
};

}  // namespace

Scene load_yaml_scene(const fs::path& file, const SceneOverrides& overrides) {
  return SceneReader(YamlValue::load(file), file, overrides).read();
}

}  // namespace counterpoint
