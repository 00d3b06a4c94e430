#include <fmt/format.h>
#include <strings.h>

#include <algorithm>
#include <vector>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxPathLength = 4096;  // PATH_MAX of Linux
constexpr const char* kMeshExtensions[] = {".stl", ".obj", ".dae", ".msh"};

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

/// A folder and the folders above it except the root, nearest first.
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

/// Searches the folders for the longest possible end of the path `wanted`, so that as much of the
/// path as possible is used; for equal lengths the nearest folder. `shortest`: the least number of
/// path elements that still counts as evidence.
bool search_upwards(const fs::path& wanted, const std::vector<fs::path>& folders, size_t shortest,
                    MeshPath& found) {
  const std::vector<fs::path> elements(wanted.begin(), wanted.end());
  for (size_t first = 0; first + shortest <= elements.size(); ++first) {
    fs::path tail;
    for (size_t i = first; i < elements.size(); ++i) tail /= elements[i];
    for (const fs::path& folder : folders) {
      if (!is_file(folder / tail)) continue;
      // The first element of this end is the package: a folder name, not ".." or ".".
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

/// The path with symlinks and ".." resolved.
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

/// Root of the package of a robot's file: the nearest folder, from its own upwards, with a
/// package.xml or model.config; without one, the folder above its own (robots/x.urdf beside
/// meshes/).
fs::path package_root(const fs::path& urdf_folder) {
  const std::vector<fs::path> folders = upwards(urdf_folder);
  for (const fs::path& folder : folders) {
    if (is_file(folder / "package.xml") || is_file(folder / "model.config")) return folder;
  }
  return folders.size() > 1 ? folders[1] : folders.empty() ? urdf_folder : folders[0];
}

/// Number of leading ".." of a name.
long ways_up(const fs::path& name) {
  return std::distance(
      name.begin(),
      std::find_if(name.begin(), name.end(), [](const fs::path& part) { return part != ".."; }));
}

/// The folder that the leading ".." of a name lead to; without them, the folder of the file.
fs::path reached(const fs::path& name, const fs::path& urdf_folder, const fs::path& file) {
  const long up = ways_up(name);
  if (up == 0) return real_path(file).parent_path();
  fs::path folder = urdf_folder;
  for (long i = 0; i < up; ++i) folder /= "..";
  return real_path(folder);
}

/// Whether a name refers to a shared part in a collection of robots: a mesh, by its extension, in a
/// subfolder of the folder two above, as when robots/assembly/x/x.urdf names ../../arms/y/y.obj.
bool is_of_collection(const fs::path& name) {
  const std::string extension = name.extension().string();
  const bool mesh =
      std::any_of(std::begin(kMeshExtensions), std::end(kMeshExtensions),
                  [&](const char* known) { return strcasecmp(known, extension.c_str()) == 0; });
  return mesh && ways_up(name) == 2 && std::count(name.begin(), name.end(), "..") == 2 &&
         std::distance(name.begin(), name.end()) >= 4;
}

/// The search for one file: the folders that may hold it, and its name in messages.
struct Search {
  const std::string& name;
  const std::string& where;
  const char* kind;
  fs::path folder;
  std::vector<fs::path> roots;

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: {} '{}': {}", where, kind, name, what));
  }

  /// @throws InputError if a file is outside these folders: a robot's file must not reach other
  /// files of the machine.
  const fs::path& allowed(const fs::path& file) const {
    const fs::path real = real_path(file);
    for (const fs::path& root : roots)
      if (lies_in(real, root)) return file;
    fail(fmt::format(
        "it is {}, outside the robot's own folder, its package and the packages that are listed; "
        "if that "
        "is meant, allow the folder: --package NAME={}, or packages: {{NAME: FOLDER}} in a scene",
        real.string(), reached(name, folder, file).string()));
  }
};

}  // namespace

MeshPath find_mesh(const std::string& name, const fs::path& folder_of_urdf,
                   const std::map<std::string, fs::path>& packages, const std::string& where,
                   const char* kind) {
  const fs::path urdf_folder = folder_of_urdf.empty() ? fs::path(".") : folder_of_urdf;
  Search search{name, where, kind, urdf_folder, {urdf_folder, package_root(urdf_folder)}};
  std::string rest = name;
  const bool package = take_scheme(rest, "package://") || take_scheme(rest, "model://");
  // file://localhost/path is the long form of file:///path
  if (!package && take_scheme(rest, "file://")) take_scheme(rest, "localhost");
  if (rest.find('\0') != std::string::npos || rest.size() > kMaxPathLength) {
    throw InputError(
        fmt::format("{}: the name of a {} is longer than {} characters, or holds a zero byte",
                    where, kind, kMaxPathLength));
  }
  const fs::path wanted(rest);
  for (const auto& [package_name, folder] : packages) search.roots.push_back(folder);
  MeshPath found;
  if (package) {
    const std::string package_name = wanted.begin() == wanted.end() ? "" : wanted.begin()->string();
    const auto listed = packages.find(package_name);
    if (listed != packages.end()) {
      const fs::path file = listed->second / wanted.lexically_relative(package_name);
      if (!is_file(file)) search.fail(fmt::format("there is no file {}", file.string()));
      return {search.allowed(file), false};
    }
    if (search_upwards(wanted, upwards(urdf_folder), 2, found)) {
      search.roots.push_back(found.root);
      search.allowed(found.file);
      return found;
    }
    search.fail(fmt::format(
        "package '{}' is not listed, and no folder from {} upwards holds the file; tell where the "
        "package is: --package {}=FOLDER, or packages: {{{}: FOLDER}} in a scene",
        package_name, urdf_folder.string(), package_name, package_name));
  }
  if (wanted.is_absolute()) {
    search.allowed(wanted);
    if (is_file(wanted)) return {wanted, false};
    search.fail("there is no such file");
  }
  if (is_of_collection(wanted)) search.roots.push_back(urdf_folder / ".." / "..");
  if (is_file(urdf_folder / wanted)) return {search.allowed(urdf_folder / wanted), false};
  if (search_upwards(wanted, upwards(urdf_folder), 2, found)) {
    search.roots.push_back(found.root);
    search.allowed(found.file);
    found.guessed = true;
    return found;
  }
  search.fail(fmt::format("not found in {}, nor in the folders above it", urdf_folder.string()));
}

}  // namespace counterpoint
