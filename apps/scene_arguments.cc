#include "scene_arguments.h"

#include <fmt/format.h>

namespace counterpoint::apps {

void SceneArguments::add_to(CLI::App& command) {
  command.add_option("SCENE", file, "Scene (.yaml), or a lone robot (.urdf)")->required();
  command
      .add_option("--base", base, "Lone robot: root link held by the world or free (default fixed)")
      ->check(CLI::IsMember({"fixed", "floating"}));
  command.add_flag("--ground", ground, "Lone robot: add the ground plane z = 0");
  command.add_option("--package", packages, "Folder of a package:// name, may be repeated")
      ->type_name("NAME=DIR")
      ->allow_extra_args(false);
  command.add_option("--srdf", srdf,
                     "Lone robot: SRDF file, whose disabled pairs of links never collide");
  command
      .add_option("--hull-vertices", hull_vertices,
                  "Lone robot: at most this many vertices for the hull of each mesh")
      ->check(CLI::Range(4, 1'000'000));
  command.add_option("--integrator", integrator, "Default: the scene's, or semi_implicit_euler")
      ->check(CLI::IsMember({"semi_implicit_euler", "implicit_midpoint", "runge_kutta_4"}));
  command
      .add_option(
          "--contact", contact,
          "Contacts as soft as MuJoCo's (fast), stiff (default) or stiffer (hard); default: "
          "the scene's")
      ->check(CLI::IsMember({"fast", "default", "hard"}));
  command.add_flag("--repair-inertias", repair_inertias,
                   "Make non-physical inertias physical; each change is listed");
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
