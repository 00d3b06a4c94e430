#include "counterpoint/model/scene/scene_shapes.h"

#include <fmt/format.h>

#include <cctype>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

namespace fs = std::filesystem;

constexpr const char* kShapeKeys[] = {"plane",    "sphere", "box",           "capsule",
                                      "cylinder", "mesh",   "triangle_mesh", "height_field"};

/// Reads `height_field: {file, size, height}`; `height` is the height of white [m], for images
/// only.
TriangleMesh read_height_field(const YamlValue& in, const fs::path& folder) {
  in.expect_map({"file", "size", "height"});
  const YamlValue name = in.at("file");
  const fs::path file = resolved(folder, name.text());
  const std::vector<double> size = in.at("size").numbers();
  if (size.size() != 2 || !(size[0] > 0.0) || !(size[1] > 0.0)) {
    in.at("size").fail("two lengths [along x, along y] in metres are expected");
  }
  const auto mesh = [&](const HeightGrid& grid, double scale) {
    return height_field_mesh(grid, size[0], size[1], scale, file.string());
  };
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".png") {
    const double height = in.at("height").number();
    return located(name, [&] { return mesh(load_height_image(file), height); });
  }
  if (extension != ".csv") name.fail("a .png image or a .csv table of heights is expected");
  if (in.has("height")) in.at("height").fail("the heights of a table are in metres; leave it out");
  return located(name, [&] { return mesh(load_height_table(file), 1.0); });
}

/// Reads `triangle_mesh: FILE` with `scale`, or `height_field`.
Shape read_terrain(const YamlValue& in, const std::string& kind, const fs::path& folder) {
  const YamlValue value = in.at(kind.c_str());
  Shape shape{ShapeType::kTerrain, {}, nullptr};
  if (kind == "height_field") {
    const TriangleMesh mesh = read_height_field(value, folder);
    const std::string file = resolved(folder, value.at("file").text()).string();
    shape.terrain = located(value, [&] { return make_terrain(mesh, file); });
    return shape;
  }
  const Vector3 scale = in.has("scale") ? in.at("scale").vector3() : Vector3(1, 1, 1);
  const fs::path file = resolved(folder, value.text());
  shape.terrain =
      located(value, [&] { return make_terrain(load_mesh(file, scale), file.string()); });
  return shape;
}

MeshCollision read_mesh_collision(const YamlValue& in, MeshCollision out) {
  if (in.has("kind")) {
    const YamlValue kind = in.at("kind");
    const auto named = mesh_kind_from_name(kind.text());
    if (!named) kind.fail("auto, hull or pieces is expected");
    out.kind = *named;
  }
  if (in.has("tolerance")) out.tolerance = in.at("tolerance").positive();
  if (in.has("most")) out.most = in.at("most").integer(1, 4096);
  return out;
}

}  // namespace

fs::path resolved(const fs::path& folder, const std::string& name) {
  const fs::path path(name);
  return path.is_absolute() ? path : folder / path;
}

std::pair<double, double> read_range(const YamlValue& in, bool open) {
  const std::vector<YamlValue> ends = in.list();
  if (ends.size() != 2) in.fail("two numbers [lowest, highest] are expected");
  const auto end = [&](const YamlValue& value, double none) {
    return open && value.is_text("none") ? none : value.number();
  };
  const std::pair range(end(ends[0], -kInfinity), end(ends[1], kInfinity));
  if (!(range.first <= range.second)) in.fail("the first number must not exceed the second");
  return range;
}

Pose read_pose(const YamlValue& in) {
  Pose pose;
  if (in.has("position")) pose.translation = in.at("position").vector3();
  if (in.has("rpy") && in.has("quaternion")) {
    in.at("quaternion").fail("give either rpy or quaternion, not both");
  }
  if (in.has("rpy")) {
    const Vector3 rpy = in.at("rpy").vector3();
    pose.rotation = rotation_from_rpy(rpy[0], rpy[1], rpy[2]);
  }
  if (in.has("quaternion")) {
    const YamlValue value = in.at("quaternion");
    const std::vector<double> q = value.numbers();
    if (q.size() != 4) value.fail("four numbers [w, x, y, z] are expected");
    const Quaternion quaternion(q[0], q[1], q[2], q[3]);
    if (quaternion.norm() < 1e-9) value.fail("a quaternion cannot be zero");
    pose.rotation = quaternion.normalized().toRotationMatrix();
  }
  return pose;
}

std::optional<FrictionGiven> read_friction(const YamlValue& in) {
  const bool axis = in.has("friction_axis");
  if (!in.has("friction")) {
    if (axis)
      in.at("friction_axis").fail("it needs two coefficients beside it: friction: [along, across]");
    return {};
  }
  const YamlValue value = in.at("friction");
  if (!value.is_list()) {
    if (axis)
      in.at("friction_axis")
          .fail(
              "friction has one coefficient, hence no direction; two are "
              "given as friction: [along the axis, across it]");
    return FrictionGiven{value.number(0.0, kInfinity)};
  }
  const std::vector<YamlValue> both = value.list();
  if (both.size() != 2)
    value.fail("one coefficient, or two [along friction_axis, across it] are expected");
  if (!axis)
    value.fail("two coefficients need a friction_axis [x, y, z], in the frame of the shape");
  const FrictionGiven out{both[0].positive(), both[1].positive(), in.at("friction_axis").vector3()};
  if (out.axis.norm() < 1e-9) in.at("friction_axis").fail("an axis cannot be zero");
  return out;
}

void refuse_surface_velocity(const YamlValue& in) {
  if (in.has("surface_velocity"))
    in.at("surface_velocity").fail("it is that of a shape, in its frame; give it there");
}

void expect_static_friction(const YamlValue& in, double friction) {
  if (!in.has("static_friction")) return;
  const YamlValue value = in.at("static_friction");
  const double at_rest = value.number(0.0, kInfinity);
  if (friction <= 0.0) value.fail("a surface without `friction` has no static friction either");
  if (at_rest < friction)
    value.fail(
        fmt::format("{} is less than the friction {} of sliding; give at least that, or leave "
                    "it out",
                    at_rest, friction));
}

void expect_one_stiffness(const YamlValue& in) {
  if (in.has("stiffness") && in.has("stiffness_per_area"))
    in.at("stiffness_per_area")
        .fail(
            "a surface has a stiffness [N/m] of each contact point, or one per area [N/m^3]; "
            "leave one of them out");
}

namespace {

/// Reads the spring of the surface; one given here replaces that of the defaults.
void read_springs(const YamlValue& in, Material& material) {
  expect_one_stiffness(in);
  const bool point = in.has("stiffness"), area = in.has("stiffness_per_area");
  if ((point || area) && !in.has("restitution")) material.restitution = 0.0;
  Spring spring{material.stiffness, material.damping, material.dissipation};
  if (point && material.per_area.is_soft()) material.per_area = Spring();
  if (area && spring.is_soft()) spring = Spring();
  if (point) spring.stiffness = in.at("stiffness").positive();
  if (area) material.per_area.stiffness = in.at("stiffness_per_area").positive();
  const auto read = [&](const char* key, double& value) {
    if (in.has(key)) value = in.at(key).number(0.0, kInfinity);
  };
  read("damping", spring.damping);
  read("damping_per_area", material.per_area.damping);
  read("dissipation",
       material.per_area.is_soft() ? material.per_area.dissipation : spring.dissipation);
  material.stiffness = spring.stiffness;
  material.damping = spring.damping;
  material.dissipation = spring.dissipation;
}

}  // namespace

Material read_material(const YamlValue& in, Material material) {
  const auto read = [&](const char* key, double high, double& value) {
    if (in.has(key)) value = in.at(key).number(0.0, high);
  };
  if (const auto friction = read_friction(in)) {
    // Coefficients given here replace all of the defaults.
    material.friction = friction->along;
    material.friction_across = friction->across;
    material.friction_axis = friction->axis;
    material.static_friction = 0.0;
  }
  read("static_friction", kInfinity, material.static_friction);
  expect_static_friction(in, material.friction);
  if (in.has("stribeck_speed")) material.stribeck_speed = in.at("stribeck_speed").positive();
  read("restitution", 1.0, material.restitution);
  read("torsional_friction", kInfinity, material.torsional_friction);
  read("rolling_friction", kInfinity, material.rolling_friction);
  if (in.has("surface_velocity")) material.surface_velocity = in.at("surface_velocity").vector3();
  read_springs(in, material);
  return material;
}

MeshCollisions read_mesh_collisions(const YamlValue& in) {
  in.expect_map({"kind", "tolerance", "most", "files"});
  MeshCollisions out{read_mesh_collision(in, {}), {}};
  if (!in.has("files")) return out;
  for (const auto& [name, value] : in.at("files").entries()) {
    value.expect_map({"kind", "tolerance", "most"});
    out.named[name] = read_mesh_collision(value, out.others);
  }
  return out;
}

Shape read_shape(const YamlValue& in, const fs::path& folder, HullCache& hulls) {
  const char* found = nullptr;
  for (const char* key : kShapeKeys) {
    if (!in.has(key)) continue;
    if (found != nullptr)
      in.fail(fmt::format("both {} and {} are given; one shape is", found, key));
    found = key;
  }
  if (found == nullptr) {
    in.fail(
        "a shape is missing: one of plane, sphere, box, capsule, cylinder, mesh, triangle_mesh, "
        "height_field");
  }
  const std::string kind = found;
  const YamlValue value = in.at(found);
  const auto sizes = [&](size_t count, const char* what) {
    std::vector<double> numbers = value.numbers();
    if (numbers.size() != count) value.fail(fmt::format("{} is expected", what));
    for (const double n : numbers) {
      if (n <= 0.0) value.fail(fmt::format("{} is not positive; {} is expected", n, what));
    }
    return numbers;
  };
  if (kind == "sphere") {
    return {ShapeType::kSphere, {sizes(1, "a radius [m]")[0], 0, 0}, nullptr};
  }
  if (kind == "plane") return {ShapeType::kPlane, {}, nullptr};  // scene_yaml.cc reads its normal
  if (kind == "box") {
    const auto s = sizes(3, "three half lengths [m]");
    return {ShapeType::kBox, {s[0], s[1], s[2]}, nullptr};
  }
  if (kind == "triangle_mesh" || kind == "height_field") return read_terrain(in, kind, folder);
  if (kind == "mesh") {
    const Vector3 scale = in.has("scale") ? in.at("scale").vector3() : Vector3(1, 1, 1);
    return located(value, [&] {
      return Shape{ShapeType::kConvexMesh, {}, hulls.load(resolved(folder, value.text()), scale)};
    });
  }
  const auto s = sizes(2, "[radius, length] in metres (without the caps of a capsule)");
  return {kind == "capsule" ? ShapeType::kCapsule : ShapeType::kCylinder,
          {s[0], 0.5 * s[1], 0},
          nullptr};
}

}  // namespace counterpoint
