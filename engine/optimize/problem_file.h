// Problem files: what is wanted of a motion, in YAML (docs/reference/optimization-format.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

/// A problem as read from a file, with what it stands on.
struct ProblemFile {
  std::filesystem::path file, scene_file;
  std::string name;
  std::shared_ptr<const Scene> scene;  ///< whose model the problem points to
  Problem problem;
  Settings settings;           ///< `continuation`, iterations, tolerances as the file has them
  std::vector<VectorX> guess;  ///< frames 0 ... N to start from, noise left out
  double noise = 0.0;  ///< standard deviation of what seeds add to joint coordinates [rad, m]
};

/// steps: in place of the file's. @throws InputError naming file, line, element, what was expected
/// and what to do.
ProblemFile load_problem(const std::filesystem::path& file, std::optional<int> steps = {});

/// The guess with the noise of a seed, on all coordinates of joints that are no free bases; seed 0:
/// as it is. The same seed gives the same bits.
std::vector<VectorX> seeded_guess(const ProblemFile& file, std::uint64_t seed);

/// Is `name` matched by a pattern with '*' for any letters?
bool matches(const std::string& pattern, const std::string& name);

}  // namespace counterpoint::optimization
