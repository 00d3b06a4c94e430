#include "scene_arguments.h"

#include <fmt/format.h>

#include <charconv>
#include <string_view>

#include "command_line/command_line.h"
#include "counterpoint/engine/estimate/estimate.h"
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
  command.add("SCENE", file,
              "Scene (.yaml), robot (.urdf), file of MuJoCo (.xml, .mjcf) or Gazebo (.sdf, "
              ".world), or bundled name (help scenes)",
              becomes(bundled_scene), required);
  command.add("--base fixed|floating", base,
              "Lone robot: root link held by the world or free (default fixed)");
  command.add("--ground", overrides.ground, "Lone robot: add the ground plane z = 0");
  command.add("--package NAME=DIR", packages, "Folder of a package:// name, may be repeated",
              seldom, one_value_each);
  command.add("--srdf", srdf, "Lone robot: SRDF file, whose disabled pairs of links never collide",
              seldom);
  command.add("--hull-vertices", overrides.hull_vertices,
              "Lone robot: at most this many vertices for the hull of each mesh",
              range(4, 1'000'000), seldom);
  command.add(
      "--meshes auto|hull|pieces", meshes,
      "Lone robot: how its meshes collide (default auto: as convex pieces if the hull is far off)",
      seldom);
  command.add("--mesh-tolerance LENGTH[m]", overrides.meshes.tolerance,
              "Lone robot: how far the pieces of meshes may stand off them (default 2 % of their "
              "diameter)",
              seldom);
  command.add("--integrator semi_implicit_euler|implicit_midpoint|runge_kutta_4", integrator,
              "Default: the scene's, or semi_implicit_euler");
  command.add("--contact fast|default|hard", contact,
              "Contacts as soft as MuJoCo's (fast), stiff (default) or stiffer (hard); default: "
              "the scene's");
  command.add("--option KEY=VALUE", settings,
              "An option of the scene by its key in scene files, such as contact.smoothing=1e-6, "
              "effects.drag=off; may be repeated",
              seldom, one_value_each);
  command.add(
      "--set KIND[:ELEMENT]=VALUE,...", set,
      "Masses, frictions, gains and others to set first (docs/reference/recording-format.md, "
      "Parameters), or @FILE of identify --output",
      seldom);
  command.add("--repair-inertias", overrides.repair_inertias,
              "Make non-physical inertias physical; each change is listed", seldom);
  command.add("--repair-joints", overrides.repair_joints,
              "Exchange joint limits given the wrong way round, let joints move by themselves that "
              "cannot follow the one they mimic; each is listed",
              seldom);
  command.add("--fill-inertia MASS[kg]", fill_inertia,
              "Where a joint moves no inertia, its link gets a ball of this mass and the density "
              "of water about its origin; each is listed",
              seldom);
}

std::pair<std::string, std::string> named_value(const std::string& option, const std::string& text,
                                                const std::string& form) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw InputError(fmt::format("{} {}: expected {}", option, text, form));
  return {text.substr(0, equals), text.substr(equals + 1)};
}

std::map<std::string, std::filesystem::path> SceneArguments::package_folders() const {
  std::map<std::string, std::filesystem::path> folders;
  for (const std::string& package : packages) {
    const auto [name, folder] = named_value("--package", package, "NAME=DIR");
    folders[name] = folder;
  }
  return folders;
}

Scene SceneArguments::load() const {
  SceneOverrides given = overrides;
  if (!meshes.empty()) given.meshes.kind = *mesh_kind_from_name(meshes);
  if (!base.empty()) given.base = base == "floating" ? Base::kFloating : Base::kFixed;
  if (!fill_inertia.empty()) given.fill_inertia = mass_of(fill_inertia);
  given.srdf = srdf;
  given.packages = package_folders();
  Scene scene = load_scene(file, given);
  if (!integrator.empty()) scene.options.integrator = *integrator_from_name(integrator);
  if (!contact.empty())
    apply_contact_preset(*contact_preset_from_name(contact), scene.options.contact);
  for (const std::string& setting : settings) {
    const auto [key, value] = named_value("--option", setting, "KEY=VALUE");
    set_option(key, value, scene.options);
  }
  return estimation::with_settings(std::move(scene), set);
}

std::vector<std::string> SceneArguments::words() const {
  std::vector<std::string> out = {file};
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) out.insert(out.end(), {option, value});
  };
  const auto flag = [&](const char* option, bool on) {
    if (on) out.emplace_back(option);
  };
  add("--base", base);
  flag("--ground", overrides.ground);
  for (const std::string& package : packages) add("--package", package);
  add("--srdf", srdf);
  if (overrides.hull_vertices > 0) add("--hull-vertices", std::to_string(overrides.hull_vertices));
  add("--meshes", meshes);
  if (overrides.meshes.tolerance > 0.0)
    add("--mesh-tolerance", fmt::format("{}", overrides.meshes.tolerance));
  add("--integrator", integrator);
  add("--contact", contact);
  flag("--repair-inertias", overrides.repair_inertias);
  flag("--repair-joints", overrides.repair_joints);
  add("--fill-inertia", fill_inertia);
  for (const std::string& setting : settings) add("--option", setting);
  add("--set", set);
  return out;
}

}  // namespace counterpoint::apps
