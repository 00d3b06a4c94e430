#include "fingerprint.h"

#include <fstream>
#include <iterator>
#include <string>

#include "counterpoint/engine/trajectory.h"

namespace counterpoint::apps::tasks {

namespace fs = std::filesystem;

Fingerprint::Fingerprint() { add(std::string_view(COUNTERPOINT_VERSION)); }

void Fingerprint::add_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  add(std::string_view(std::string(std::istreambuf_iterator<char>(stream), {})));
}

void Fingerprint::add_scene(const Scene& scene) {
  add(model_hash(scene.model));
  add(options_hash(scene.options));
  add(scene.options.duration);
  add(state_hash({0.0, scene.q, scene.v}));
}

}  // namespace counterpoint::apps::tasks
