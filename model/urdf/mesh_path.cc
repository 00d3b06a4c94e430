#include "counterpoint/model/robot_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxPathLength = 4096;  // as Linux has it

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
      // What the end of the path begins with is the package: a folder with a name, not a way up.
      if (*tail.begin() == ".." || *tail.begin() == ".") continue;
      found = {folder / tail, first > 0, folder / *tail.begin()};
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

/// Where symlinks and ".." really lead.
fs::path real_path(const fs::path& path) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(fs::absolute(path, error), error);
  return real.has_filename() ? real : real.parent_path();
}

bool lies_in(const fs::path& file, const fs::path& folder) {
  const fs::path root = real_path(folder);
  if (!root.has_relative_path()) return false;  // "/" would allow everything
  const auto [end, rest] = std::mismatch(root.begin(), root.end(), file.begin(), file.end());
  return end == root.end() && rest != file.end();
}

/// The package that a robot's file is part of: the nearest folder from its own upwards that is
/// marked as one; without a mark, the folder above its own (robots/x.urdf beside meshes/).
fs::path package_root(const fs::path& urdf_folder) {
  const std::vector<fs::path> folders = upwards(urdf_folder);
  for (const fs::path& folder : folders) {
    if (is_file(folder / "package.xml") || is_file(folder / "model.config")) return folder;
  }
  return folders.size() > 1 ? folders[1] : folders.empty() ? urdf_folder : folders[0];
}

/// A robot's file is not to reach into the rest of the machine.
void check_allowed(const fs::path& file, const std::vector<fs::path>& roots,
                   const std::string& name, const std::string& where) {
  const fs::path real = real_path(file);
  for (const fs::path& root : roots) {
    if (lies_in(real, root)) return;
  }
  throw InputError(fmt::format(
      "{}: mesh '{}' is {}, outside the robot's own folder, its package and the packages that are "
      "listed; if that is meant, allow the folder: --package NAME={}, or packages: {{NAME: "
      "FOLDER}} "
      "in a scene",
      where, name, real.string(), real.parent_path().string()));
}

}  // namespace

MeshPath find_mesh(const std::string& name, const fs::path& folder_of_urdf,
                   const std::map<std::string, fs::path>& packages, const std::string& where) {
  const fs::path urdf_folder = folder_of_urdf.empty() ? fs::path(".") : folder_of_urdf;
  std::string rest = name;
  const bool package = take_scheme(rest, "package://") || take_scheme(rest, "model://");
  // file://localhost/path is the long form of file:///path
  if (!package && take_scheme(rest, "file://")) take_scheme(rest, "localhost");
  if (rest.find('\0') != std::string::npos || rest.size() > kMaxPathLength) {
    throw InputError(
        fmt::format("{}: the name of a mesh is longer than {} characters, or holds a "
                    "zero byte",
                    where, kMaxPathLength));
  }
  const fs::path wanted(rest);
  std::vector<fs::path> roots{urdf_folder, package_root(urdf_folder)};
  for (const auto& [package_name, folder] : packages) roots.push_back(folder);
  MeshPath found;
  if (package) {
    const std::string package_name = wanted.begin() == wanted.end() ? "" : wanted.begin()->string();
    const auto listed = packages.find(package_name);
    if (listed != packages.end()) {
      const fs::path file = listed->second / wanted.lexically_relative(package_name);
      if (!is_file(file)) {
        throw InputError(
            fmt::format("{}: mesh '{}': there is no file {}", where, name, file.string()));
      }
      check_allowed(file, roots, name, where);
      return {file, false};
    }
    if (search_upwards(wanted, upwards(urdf_folder), 2, found)) {
      roots.push_back(found.root);
      check_allowed(found.file, roots, name, where);
      return found;
    }
    throw InputError(fmt::format(
        "{}: mesh '{}': package '{}' is not listed, and no folder from {} upwards holds the file; "
        "tell where the package is (packages: {{{}: FOLDER}})",
        where, name, package_name, urdf_folder.string(), package_name));
  }
  if (wanted.is_absolute()) {
    check_allowed(wanted, roots, name, where);
    if (is_file(wanted)) return {wanted, false};
    throw InputError(fmt::format("{}: mesh '{}': there is no such file", where, name));
  }
  if (is_file(urdf_folder / wanted)) {
    check_allowed(urdf_folder / wanted, roots, name, where);
    return {urdf_folder / wanted, false};
  }
  if (search_upwards(wanted, upwards(urdf_folder), 2, found)) {
    roots.push_back(found.root);
    check_allowed(found.file, roots, name, where);
    found.guessed = true;
    return found;
  }
  throw InputError(fmt::format("{}: mesh '{}': not found in {}, nor in the folders above it", where,
                               name, urdf_folder.string()));
}

}  // namespace counterpoint
