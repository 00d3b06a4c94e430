#include "counterpoint/model/scene/scene_yaml.h"

#include <fmt/format.h>

#include <algorithm>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/scene/scene_actuators.h"
#include "counterpoint/model/scene/scene_closures.h"
#include "counterpoint/model/scene/scene_models.h"
#include "counterpoint/model/scene/scene_options.h"
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
    SimulationOptions options;
    read_options(root_, faults_, options);
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
        {"name", "gravity", "packages", "repair_inertias", "defaults", "models", "ground",
         "environment", "exclude", "groups", "hull_vertices", "meshes", "closures", "repair_joints",
         "fill_inertia", "pairs", "tendons", "actuators", "sensors"},
        kOptionKeys);
    if (root.has("gravity")) return root.at("gravity").vector3();
    return {0, 0, -kStandardGravity};
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
