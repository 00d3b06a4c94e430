#include "view/input_files.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/geometry.h"
#include "view/packing.h"

namespace counterpoint::view {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxRead = 64'000'000;  // bytes; larger files pack too large

std::string size_text(std::uintmax_t bytes) {
  return fmt::format("{:.3g} MB", static_cast<double>(bytes) / 1e6);
}

/// Collects every file that a scene's text names under the keys for files.
void find_files(const YAML::Node& node, const fs::path& folder, std::vector<fs::path>& out) {
  static constexpr const char* kKeys[] = {"urdf", "srdf", "mesh", "triangle_mesh", "file"};
  if (node.IsSequence())
    for (const YAML::Node& entry : node) find_files(entry, folder, out);
  if (!node.IsMap()) return;
  for (const auto& entry : node) {
    const YAML::Node key = entry.first, value = entry.second;
    const bool names_file =
        key.IsScalar() && value.IsScalar() &&
        std::find(std::begin(kKeys), std::end(kKeys), key.Scalar()) != std::end(kKeys);
    if (names_file)
      out.push_back(folder / value.Scalar());
    else
      find_files(value, folder, out);
  }
}

bool quiet_in_shell(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) ||
         std::string_view("_-./=,:+@%").find(c) != std::string_view::npos;
}

}  // namespace

std::string shell_word(const std::string& word) {
  if (!word.empty() && std::all_of(word.begin(), word.end(), quiet_in_shell)) return word;
  std::string out = "'";
  for (const char c : word) {
    if (c == '\'')
      out += "'\\''";
    else
      out += c;
  }
  out += '\'';
  return out;
}

void InputFiles::add(const fs::path& file) {
  std::error_code error;
  const fs::path known = fs::weakly_canonical(file, error);
  if (error || std::find(seen_.begin(), seen_.end(), known) != seen_.end()) return;
  seen_.push_back(known);
  const std::uintmax_t size = fs::is_regular_file(file, error) ? fs::file_size(file, error) : 0;
  if (error || size == 0) return;
  const std::string name = file.lexically_normal().string();
  if (size > kMaxRead) {
    left_out.push_back(fmt::format("{} ({})", name, size_text(size)));
    return;
  }
  std::ifstream stream(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return;
  if (pack(bytes).size() > kMaxPackedInput)
    left_out.push_back(fmt::format("{} ({})", name, size_text(size)));
  else
    files.push_back({name, std::move(bytes)});
}

void InputFiles::add_scene(const fs::path& file, const Model& model) {
  add(file);
  if (file.extension() == ".yaml" || file.extension() == ".yml") {
    std::vector<fs::path> named;
    // The scene has been read before, so its errors have been reported.
    find_files(YAML::LoadFile(file.string()), file.parent_path(), named);
    for (const fs::path& one : named) add(one);
  }
  for (const Geometry& geometry : model.geometries()) {
    if (geometry.shape.mesh && !geometry.shape.mesh->source.empty())
      add(geometry.shape.mesh->source);
    if (geometry.shape.terrain && !geometry.shape.terrain->source.empty())
      add(geometry.shape.terrain->source);
  }
}

std::string command_line() {
  std::ifstream stream("/proc/self/cmdline", std::ios::binary);
  std::string out, word;
  for (bool first = true; std::getline(stream, word, '\0'); first = false) {
    if (first) word = fs::path(word).filename().string();
    if (!first) out += ' ';
    out += shell_word(word);
  }
  return out;
}

std::vector<std::pair<std::string, std::string>> made_by(const std::string& scene_file,
                                                         const Scene& scene, const Clip& clip) {
  const auto hash = [](const State& state) {
    return state.v.size() > 0 ? std::to_string(state_hash(state)) : std::string("-");
  };
  return {{"command", command_line()},
          {"version", COUNTERPOINT_VERSION},
          {"scene", scene_file},
          {"model hash", std::to_string(model_hash(scene.model))},
          {"options hash", std::to_string(options_hash(scene.options))},
          {"state hash at the start", hash(clip.states.front())},
          {"state hash at the end", hash(clip.states.back())},
          {"frames", fmt::format("{} of {} rows", clip.num_frames(), clip.rows)}};
}

}  // namespace counterpoint::view
