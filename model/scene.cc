#include "counterpoint/model/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene/scene_yaml.h"
#include "counterpoint/model/special_values.h"
#include "counterpoint/model/urdf/srdf.h"

namespace counterpoint {
namespace {

namespace fs = std::filesystem;

constexpr double kStartGap = 1e-3;  // initial gap between the ground and a floating robot [m]

/// Returns the smallest world z [m] of all moving geometry in the default configuration; infinity
/// if nothing moves.
double lowest_point(const Model& model) {
  const std::vector<Pose> X_WB = body_poses(model, model.default_q());
  double lowest = kInfinity;
  for (const Geometry& geometry : model.geometries())
    if (geometry.body != 0)
      lowest = std::min(lowest, lowest_point(geometry.shape, X_WB[geometry.body] * geometry.X_BG));
  return lowest;
}

ModelFileOptions file_options(const SceneOverrides& overrides) {
  return {
      overrides.packages, overrides.repair_inertias,
      std::make_shared<HullCache>(overrides.hull_vertices, MeshCollisions{overrides.meshes, {}})};
}

Scene load_lone_urdf(const fs::path& file, const SceneOverrides& overrides) {
  const UrdfOptions urdf_options{file_options(overrides), overrides.repair_joints, Material()};
  RobotSpec robot = load_urdf(file, urdf_options);
  const ModelParts parts = load_urdf_parts(file, robot);
  const Srdf srdf = overrides.srdf.empty() ? Srdf() : load_srdf(overrides.srdf);
  const Base base = overrides.base.value_or(Base::kFixed);
  Pose X_WL;
  ModelBuilder builder;
  if (overrides.fill_inertia > 0.0) builder.fill_inertia(overrides.fill_inertia);
  if (overrides.ground) {
    if (base == Base::kFloating) {
      ModelBuilder trial;
      if (overrides.fill_inertia > 0.0) trial.fill_inertia(overrides.fill_inertia);
      trial.add_robot(robot, base, X_WL);
      if (const double z = lowest_point(trial.build()); z < kInfinity)
        X_WL.translation.z() = kStartGap - z;
    }
    Material material;
    if (overrides.ground_friction) material.friction = *overrides.ground_friction;
    builder.add_environment(kGroundName, {ShapeType::kPlane, {}, nullptr}, Pose(), material);
  }
  builder.add_robot(robot, base, X_WL);
  add_parts(parts, X_WL, "", builder);
  exclude_disabled_pairs(srdf, "", builder);
  for (const Note& note : srdf.notes) builder.add_note(note);
  return scene_of(builder.build(), robot.name);
}

/// Refuses the options for bases and ground: MJCF and SDF files define these themselves.
void expect_no_base(const fs::path& file, const SceneOverrides& overrides, const char* format) {
  if (overrides.base || overrides.ground || overrides.ground_friction || !overrides.srdf.empty())
    throw InputError(
        fmt::format("{}: base, ground and SRDF are options for a single URDF; an {} file says "
                    "them itself, or a scene that names it",
                    file.string(), format));
}

/// Loads a single MJCF file, including the initial velocities of its keyframe.
Scene load_lone_mjcf(const fs::path& file, const SceneOverrides& overrides) {
  expect_no_base(file, overrides, "MJCF");
  const MjcfModel model = load_mjcf(file, {file_options(overrides), {}});
  ModelBuilder builder(model.gravity);
  if (overrides.fill_inertia > 0.0) builder.fill_inertia(overrides.fill_inertia);
  const std::vector<StartVelocity> velocities = add_mjcf(model, "", Pose(), "", builder);
  Scene scene = scene_of(builder.build(), model.robot.name);
  scene.options.time_step = model.time_step;
  for (const StartVelocity& start : velocities) {
    const Body& body = scene.model.body(scene.model.find_joint(start.joint) + 1);
    std::copy(start.v.begin(), start.v.end(), scene.v.data() + body.v_index);
  }
  return scene;
}

Scene load_lone_sdf(const fs::path& file, const SceneOverrides& overrides) {
  expect_no_base(file, overrides, "SDF");
  const SdfModel model = load_sdf(file, {file_options(overrides), {}});
  ModelBuilder builder(model.gravity.value_or(Vector3(0, 0, -kStandardGravity)));
  if (overrides.fill_inertia > 0.0) builder.fill_inertia(overrides.fill_inertia);
  add_sdf(model, Pose(), "", builder);
  Scene scene = scene_of(builder.build(), model.name);
  if (model.time_step) scene.options.time_step = *model.time_step;
  return scene;
}

}  // namespace

const char* friction_model_name(FrictionModel model) {
  switch (model) {
    case FrictionModel::kConvex:
      return "convex";
    case FrictionModel::kLagged:
      return "lagged";
    case FrictionModel::kCoulomb:
      return "coulomb";
  }
  return "?";
}

std::optional<FrictionModel> friction_model_from_name(const std::string& name) {
  for (const FrictionModel model :
       {FrictionModel::kConvex, FrictionModel::kLagged, FrictionModel::kCoulomb}) {
    if (name == friction_model_name(model)) return model;
  }
  return std::nullopt;
}

const char* contact_preset_name(ContactPreset preset) {
  switch (preset) {
    case ContactPreset::kFast:
      return "fast";
    case ContactPreset::kDefault:
      return "default";
    case ContactPreset::kHard:
      return "hard";
  }
  return "?";
}

std::optional<ContactPreset> contact_preset_from_name(const std::string& name) {
  for (const ContactPreset preset :
       {ContactPreset::kFast, ContactPreset::kDefault, ContactPreset::kHard}) {
    if (name == contact_preset_name(preset)) return preset;
  }
  return std::nullopt;
}

void apply_contact_preset(ContactPreset preset, ContactOptions& options) {
  const ContactOptions usual;
  options.friction_model =
      preset == ContactPreset::kFast ? FrictionModel::kConvex : usual.friction_model;
  options.compliance = preset == ContactPreset::kFast   ? 0.1
                       : preset == ContactPreset::kHard ? 1e-8
                                                        : usual.compliance;
}

const char* integrator_name(Integrator integrator) {
  switch (integrator) {
    case Integrator::kSemiImplicitEuler:
      return "semi_implicit_euler";
    case Integrator::kImplicitMidpoint:
      return "implicit_midpoint";
    case Integrator::kRungeKutta4:
      return "runge_kutta_4";
  }
  return "?";
}

std::optional<Integrator> integrator_from_name(const std::string& name) {
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint, Integrator::kRungeKutta4}) {
    if (name == integrator_name(integrator)) return integrator;
  }
  return std::nullopt;
}

std::string step_control_flaw(const StepControlOptions& o) {
  const auto positive = [](double x) { return x > 0.0 && x < kInfinity; };
  const auto share = [](double x) { return x >= 0.0 && x < kInfinity; };
  if (!positive(o.tolerance)) return "tolerance: a positive number is expected";
  if (!share(o.relative_tolerance)) return "relative_tolerance: 0 or more is expected";
  if (!positive(o.min_step)) return "min_step: a positive number is expected";
  if (!(o.event_tolerance >= o.min_step && o.max_step >= o.event_tolerance && positive(o.max_step)))
    return fmt::format("min_step <= event_tolerance <= max_step is expected; they are {}, {}, {} s",
                       o.min_step, o.event_tolerance, o.max_step);
  if (!share(o.interval)) return "interval: 0 or more is expected";
  return "";
}

Scene scene_of(Model model, std::string name) {
  VectorX q = model.default_q();
  VectorX v = VectorX::Zero(model.nv());
  return {std::move(name), std::move(model), std::move(q), std::move(v), SimulationOptions()};
}

Scene load_scene(const fs::path& file, const SceneOverrides& overrides) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".urdf") return load_lone_urdf(file, overrides);
  if (extension == ".mjcf" || (extension == ".xml" && is_mjcf(file)))
    return load_lone_mjcf(file, overrides);
  if (extension == ".sdf" || extension == ".world" || (extension == ".xml" && is_sdf(file)))
    return load_lone_sdf(file, overrides);
  if (extension == ".xml") return load_lone_urdf(file, overrides);
  if (extension != ".yaml" && extension != ".yml") {
    throw InputError(
        fmt::format("{}: a scene (.yaml) or a model (.urdf, .xml, .mjcf, .sdf, .world) is expected",
                    file.string()));
  }
  if (overrides.base || overrides.ground || overrides.ground_friction || !overrides.srdf.empty() ||
      overrides.hull_vertices > 0 || overrides.meshes.kind != MeshKind::kAuto ||
      overrides.meshes.tolerance > 0.0) {
    throw InputError(
        fmt::format("{}: base, ground, SRDF, meshes and hull vertices are options for a single "
                    "URDF; a scene file says them itself",
                    file.string()));
  }
  return load_yaml_scene(file, overrides);
}

}  // namespace counterpoint
