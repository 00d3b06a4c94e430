// The SCENE argument and its options, the same in every subcommand.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/scene.h"

namespace counterpoint::apps {

class Command;

/// Splits the value of an option such as NAME=FILE at its first '='. @throws InputError naming the
/// option and this form.
std::pair<std::string, std::string> named_value(const std::string& option, const std::string& text,
                                                const std::string& form);

struct SceneArguments {
  std::string file;
  SceneOverrides overrides;
  std::string base, srdf, meshes, fill_inertia;  ///< a mass, with or without "kg"
  std::vector<std::string> packages;             ///< NAME=DIR
  std::string integrator, contact;
  std::vector<std::string> settings;  ///< KEY=VALUE
  std::string set;                    ///< parameters to set: KIND[:ELEMENT]=VALUE,..., or @FILE

  void add_to(Command& command);
  /// Folder of each package name. @throws InputError for an argument that is not NAME=DIR
  std::map<std::string, std::filesystem::path> package_folders() const;
  /// @throws InputError as load_scene and with_settings do, and for a package that is not NAME=DIR
  Scene load() const;
  /// The argument and its options as words of a command line.
  std::vector<std::string> words() const;
};

}  // namespace counterpoint::apps
