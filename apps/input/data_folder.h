// Scenes and robots that are installed with the command.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace counterpoint::apps {

/// Folder of the bundled data: $COUNTERPOINT_DATA; else <prefix>/share/counterpoint of an installed
/// command; else that of the sources. @throws InputError where there is none.
std::filesystem::path data_folder();

/// Returns a file as given; or, for a name without extension that is no file ("humanoid_drop",
/// "hard/arch_falls"), the bundled file of that name in one of the folders below data_folder().
/// @throws InputError that suggests similar names.
std::string bundled_file(const std::string& name, const std::vector<std::string>& folders);

/// Bundled file in scenes/, its subfolders, or robots/.
std::string bundled_scene(const std::string& name);

/// Name of a bundled file, as bundled_file takes it, and the first comment in the file.
struct Bundled {
  std::string name, about;
};
/// Bundled files of one folder below data_folder() and its subfolders ("hard/arch_falls"), sorted.
std::vector<Bundled> bundled_in(const std::string& folder, const std::string& ending);

}  // namespace counterpoint::apps
