// A study: a scene, varied quantities and recorded results (docs/reference/study-format.md).
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/tables.h"
#include "counterpoint/model/scene.h"
#include "recordings/estimation.h"

namespace counterpoint::apps::sweep {

enum class Distribution { kUniform, kLogUniform, kNormal };

struct AxisValue {
  double number = 0.0;
  std::string word = {};
  bool operator==(const AxisValue&) const = default;
};

class Trial;

/// One varied quantity: over a list of numbers or words, which forms a grid with the other lists,
/// or drawn at random.
struct Axis {
  std::string name;
  /// Sets a value of a quantity of the run; empty: the quantity belongs to the scene. @throws
  /// InputError for an invalid value
  std::function<void(const AxisValue&, Trial&)> set = {};
  /// Varied parameter of the scene; without it and `set` the contact preset varies.
  std::optional<Parameter> parameter = {};
  bool takes_words = false, takes_files = false;  ///< a file is a word that names it
  std::vector<double> numbers = {};
  std::vector<std::string> words = {};
  Distribution distribution = Distribution::kUniform;
  double a = 0.0, b = 0.0;  ///< low and high, or mean and standard deviation
  bool random = false;

  bool changes_scene() const { return !set; }
  bool has_words() const { return !words.empty(); }
  std::int64_t levels() const {
    return random ? 1 : static_cast<std::int64_t>(std::max(numbers.size(), words.size()));
  }
  /// Level of a value of a list.
  std::size_t level_of(const AxisValue& value) const {
    const auto at = has_words()
                        ? std::find(words.begin(), words.end(), value.word) - words.begin()
                        : std::find(numbers.begin(), numbers.end(), value.number) - numbers.begin();
    return static_cast<std::size_t>(at);
  }
};

/// A column of the motion, reduced to one number.
struct RecordedColumn {
  enum class Of { kEnd, kMin, kMax, kMean };
  std::string name;  ///< text of the study: "cube.z", "max(cube.z)"
  Of of = Of::kEnd;
  bool velocity = false;
  int index = 0;
};

struct Record {
  bool final_state = true, trajectories = false;
  std::vector<RecordedColumn> columns;
  std::vector<std::string> metrics;  ///< names in the report of `simulate`
};

struct Study {
  std::filesystem::path file;
  std::string scene_file;
  Scene scene;  ///< with duration, time step and `set` applied
  std::uint64_t seed = 0;
  std::int64_t draws = 1;
  std::string inputs;
  double random_inputs = 0.0, random_wrenches = 0.0;
  std::vector<Axis> axes;
  Record record;
  std::uint64_t fingerprint = 0;  ///< hash of the file, the scene and the input files

  std::int64_t num_tasks() const;
};

/// Reads a study. @throws InputError naming file and line, the expected content and a remedy
Study load_study(const std::filesystem::path& file);

}  // namespace counterpoint::apps::sweep
