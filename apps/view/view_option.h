// --view FILE of commands that make a motion: a replay of it.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "view/clip.h"
#include "view/replay.h"

namespace counterpoint::view {

class ViewOption {
 public:
  void add_to(CLI::App& command);
  bool wanted() const { return !file_.empty(); }
  /// Refuses at once what would only fail at the end. @throws InputError.
  void check() const;
  double rate() const { return rate_; }

  /// Writes the replay; further inputs of the motion are kept in it. @throws InputError.
  void write(const Scene& scene, const std::string& scene_file, Clip clip,
             std::optional<Clip> ghost = std::nullopt,
             const std::vector<std::string>& inputs = {}) const;

 private:
  std::string file_;
  double rate_ = kDefaultRate;
};

}  // namespace counterpoint::view
