// Hash of everything that the results of tasks depend on; results with another hash are refused
// (journal.h).
#pragma once

#include <filesystem>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::apps::tasks {

class Fingerprint : public Hash {
 public:
  Fingerprint();  ///< starts with the version
  using Hash::add;
  /// Adds the content of a file, not its name: changed content changes the hash.
  void add_file(const std::filesystem::path& file);
  /// Adds model, start, options and duration.
  void add_scene(const Scene& scene);
};

}  // namespace counterpoint::apps::tasks
