#include "fingerprint.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "counterpoint/engine/io/state_file.h"

namespace counterpoint::apps::tasks {

namespace fs = std::filesystem;

Fingerprint::Fingerprint() { add(std::string_view(COUNTERPOINT_VERSION)); }

void Fingerprint::add_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  add(std::string_view(std::string(std::istreambuf_iterator<char>(stream), {})));
}

void Fingerprint::add_folder(const fs::path& folder, const char* ending) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ending) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    add(std::string_view(file.filename().string()));
    add_file(file);
  }
}

void Fingerprint::add_scene(const Scene& scene) {
  add(model_hash(scene.model));
  add(options_hash(scene.options));
  add(scene.options.duration);
  add(state_hash({0.0, scene.q, scene.v}));
}

}  // namespace counterpoint::apps::tasks
