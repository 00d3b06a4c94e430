#include "scene_arguments.h"

#include <fmt/format.h>

#include <charconv>
#include <string_view>

#include "command_line/command_line.h"
#include "data_folder.h"

namespace counterpoint::apps {
namespace {

/// Parses a mass [kg]: "0.001", "1e-3kg" or "1e-3 kg".
double mass_of(const std::string& text) {
  double mass = 0.0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, mass);
  std::string_view unit(stop, static_cast<size_t>(end - stop));
  while (!unit.empty() && unit.front() == ' ') unit.remove_prefix(1);
  if (error == std::errc() && mass > 0.0 && (unit.empty() || unit == "kg")) return mass;
  throw InputError(fmt::format("--fill-inertia {}: a positive mass is expected, 1e-3kg say", text));
}

}  // namespace

void SceneArguments::add_to(Command& command) {
  command
      .add_option("SCENE", file,
                  "Scene (.yaml), robot (.urdf), file of MuJoCo (.xml, .mjcf) or Gazebo (.sdf, "
                  ".world), or bundled name (help "
                  "scenes)")
      .becomes(bundled_scene)
      .required();
  command
      .add_option("--base", base, "Lone robot: root link held by the world or free (default fixed)")
      .one_of({"fixed", "floating"});
  command.add_flag("--ground", ground, "Lone robot: add the ground plane z = 0");
  command.add_option("--package", packages, "Folder of a package:// name, may be repeated")
      .type_name("NAME=DIR")
      .seldom()
      .one_value_each();
  command
      .add_option("--srdf", srdf,
                  "Lone robot: SRDF file, whose disabled pairs of links never collide")
      .seldom();
  command
      .add_option("--hull-vertices", hull_vertices,
                  "Lone robot: at most this many vertices for the hull of each mesh")
      .range(4, 1'000'000)
      .seldom();
  command.add_option("--integrator", integrator, "Default: the scene's, or semi_implicit_euler")
      .one_of({"semi_implicit_euler", "implicit_midpoint", "runge_kutta_4"});
  command
      .add_option(
          "--contact", contact,
          "Contacts as soft as MuJoCo's (fast), stiff (default) or stiffer (hard); default: "
          "the scene's")
      .one_of({"fast", "default", "hard"});
  command
      .add_flag("--repair-inertias", repair_inertias,
                "Make non-physical inertias physical; each change is listed")
      .seldom();
  command
      .add_flag("--repair-joints", repair_joints,
                "Exchange joint limits given the wrong way round, let joints move by themselves "
                "that cannot follow the one they mimic; each is listed")
      .seldom();
  command
      .add_option("--fill-inertia", fill_inertia,
                  "Where a joint moves no inertia, its link gets a ball of this mass and the "
                  "density of water about its origin; each is listed")
      .type_name("MASS[kg]")
      .seldom();
}

std::map<std::string, std::filesystem::path> SceneArguments::package_folders() const {
  std::map<std::string, std::filesystem::path> folders;
  for (const std::string& package : packages) {
    const size_t equals = package.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == package.size()) {
      throw InputError(fmt::format("--package {}: expected NAME=DIR", package));
    }
    folders[package.substr(0, equals)] = package.substr(equals + 1);
  }
  return folders;
}

Scene SceneArguments::load() const {
  SceneOverrides overrides;
  if (!base.empty()) overrides.base = base == "floating" ? Base::kFloating : Base::kFixed;
  overrides.ground = ground;
  overrides.repair_inertias = repair_inertias;
  overrides.repair_joints = repair_joints;
  if (!fill_inertia.empty()) overrides.fill_inertia = mass_of(fill_inertia);
  overrides.srdf = srdf;
  overrides.hull_vertices = hull_vertices;
  overrides.packages = package_folders();
  Scene scene = load_scene(file, overrides);
  if (!integrator.empty()) scene.options.integrator = *integrator_from_name(integrator);
  if (!contact.empty())
    apply_contact_preset(*contact_preset_from_name(contact), scene.options.contact);
  return scene;
}

}  // namespace counterpoint::apps
