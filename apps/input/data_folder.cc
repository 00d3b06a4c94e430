#include "data_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "command_line/command_line.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kSceneFolders = {"scenes",       "scenes/accuracy",   "scenes/hard",
                                                "scenes/piles", "scenes/recordings", "robots"};

std::string first_comment(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line.rfind("# ", 0) == 0 ? line.substr(2) : std::string();
}

}  // namespace

fs::path data_folder() {
  std::vector<fs::path> candidates;
  if (const char* given = std::getenv("COUNTERPOINT_DATA")) candidates.emplace_back(given);
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) candidates.push_back(program.parent_path().parent_path() / "share/counterpoint");
  candidates.emplace_back(COUNTERPOINT_DATA_SOURCE);
  for (const fs::path& folder : candidates)
    if (fs::is_directory(folder / "scenes", error)) return folder;
  throw InputError(fmt::format("the bundled scenes are not in {}; COUNTERPOINT_DATA says where",
                               candidates.back().string()));
}

std::vector<Bundled> bundled_in(const std::string& folder, const std::string& ending) {
  const fs::path root = data_folder() / folder;
  std::vector<Bundled> found;
  for (const auto& entry : fs::recursive_directory_iterator(root))
    if (entry.path().extension() == ending)
      found.push_back({entry.path().lexically_relative(root).replace_extension().string(),
                       first_comment(entry.path())});
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return found;
}

std::string bundled_file(const std::string& name, const std::vector<std::string>& folders) {
  const fs::path given(name);
  std::error_code error;
  if (fs::exists(given, error) || given.has_extension() || given.is_absolute()) return name;
  const fs::path data = data_folder();
  std::vector<std::string> names;
  for (const std::string& folder : folders) {
    const std::string ending = folder == "robots" ? ".urdf" : ".yaml";
    const fs::path file = data / folder / (name + ending);
    if (fs::exists(file, error)) return file.string();
    for (const Bundled& bundled : bundled_in(folder, ending)) names.push_back(bundled.name);
  }
  throw InputError(
      fmt::format("there is no file '{}', and nothing bundled of that name{}\n'counterpoint list' "
                  "names what is.",
                  name, did_you_mean(name, names)));
}

std::string bundled_scene(const std::string& name) { return bundled_file(name, kSceneFolders); }

}  // namespace counterpoint::apps
