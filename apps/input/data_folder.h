// The scenes and robots that come with the command.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace counterpoint::apps {

/// $COUNTERPOINT_DATA; else <prefix>/share/counterpoint of an installed command; else the sources'.
/// @throws InputError where there is none.
std::filesystem::path data_folder();

/// A file as given, or, of a word without ending that is no file ("humanoid_drop",
/// "hard/arch_falls"), the bundled file of that name in one of the folders below data_folder().
/// @throws InputError that names what is alike.
std::string bundled_file(const std::string& name, const std::vector<std::string>& folders);

/// scenes/, its folders, and robots/.
std::string bundled_scene(const std::string& name);

/// A bundled file, as bundled_file takes its name, and the first comment in it.
struct Bundled {
  std::string name, about;
};
/// Of one folder below data_folder(), sorted; with the files of its folders, "hard/arch_falls".
std::vector<Bundled> bundled_in(const std::string& folder, const std::string& ending);

}  // namespace counterpoint::apps
