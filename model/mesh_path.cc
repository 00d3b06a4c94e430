#include "counterpoint/model/mesh_path.h"

#include <fmt/format.h>

#include <vector>

#include "counterpoint/model/types.h"

namespace counterpoint {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

/// The folder and those above it, nearest first.
std::vector<fs::path> upwards(const fs::path& folder) {
  std::error_code error;
  fs::path at = fs::absolute(folder, error).lexically_normal();
  if (!at.has_filename()) at = at.parent_path();
  std::vector<fs::path> folders;
  while (at.has_relative_path()) {
    folders.push_back(at);
    at = at.parent_path();
  }
  return folders;
}

/// Longest end of the path first, so that the most of what the file said is honoured; among equals
/// the nearest folder. `shortest`: least number of path elements that still counts as evidence.
bool search_upwards(const fs::path& wanted, const std::vector<fs::path>& folders, size_t shortest,
                    MeshPath& found) {
  const std::vector<fs::path> elements(wanted.begin(), wanted.end());
  for (size_t first = 0; first + shortest <= elements.size(); ++first) {
    fs::path tail;
    for (size_t i = first; i < elements.size(); ++i) tail /= elements[i];
    for (const fs::path& folder : folders) {
      if (!is_file(folder / tail)) continue;
      found = {folder / tail, first > 0};
      return true;
    }
  }
  return false;
}

bool take_scheme(std::string& name, const std::string& scheme) {
  if (name.compare(0, scheme.size(), scheme) != 0) return false;
  name.erase(0, scheme.size());
  return true;
}

}  // namespace

MeshPath find_mesh(const std::string& name, const fs::path& urdf_folder,
                   const std::map<std::string, fs::path>& packages, const std::string& where) {
  std::string rest = name;
  const bool package = take_scheme(rest, "package://") || take_scheme(rest, "model://");
  if (!package && take_scheme(rest, "file://") && take_scheme(rest, "localhost")) {
    // file://localhost/path is the long form of file:///path
  }
  const fs::path wanted(rest);
  MeshPath found;
  if (package) {
    const std::string package_name = wanted.begin() == wanted.end() ? "" : wanted.begin()->string();
    const auto listed = packages.find(package_name);
    if (listed != packages.end()) {
      const fs::path file = listed->second / wanted.lexically_relative(package_name);
      if (is_file(file)) return {file, false};
      throw InputError(
          fmt::format("{}: mesh '{}': there is no file {}", where, name, file.string()));
    }
    if (search_upwards(wanted, upwards(urdf_folder), 2, found)) return found;
    throw InputError(fmt::format(
        "{}: mesh '{}': package '{}' is not listed, and no folder from {} upwards holds the file; "
        "tell where the package is (packages: {{{}: FOLDER}})",
        where, name, package_name, urdf_folder.string(), package_name));
  }
  if (wanted.is_absolute()) {
    if (is_file(wanted)) return {wanted, false};
    throw InputError(fmt::format("{}: mesh '{}': there is no such file", where, name));
  }
  if (is_file(urdf_folder / wanted)) return {urdf_folder / wanted, false};
  if (search_upwards(wanted, upwards(urdf_folder), 2, found)) {
    found.guessed = true;
    return found;
  }
  throw InputError(fmt::format("{}: mesh '{}': not found in {}, nor in the folders above it", where,
                               name, urdf_folder.string()));
}

}  // namespace counterpoint
