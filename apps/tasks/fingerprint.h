// What results of tasks depend on, as one number: those of something else are refused (journal.h).
#pragma once

#include <filesystem>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint::apps::tasks {

class Fingerprint : public Hash {
 public:
  Fingerprint();  ///< begins with the version
  using Hash::add;
  /// What the file holds, not its name: a file that is written anew is another one.
  void add_file(const std::filesystem::path& file);
  /// Model, start, options and duration.
  void add_scene(const Scene& scene);
};

}  // namespace counterpoint::apps::tasks
