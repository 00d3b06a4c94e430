// A study: a scene, varied quantities and recorded results (docs/reference/study-format.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/tables.h"
#include "counterpoint/model/scene.h"
#include "recordings/estimation.h"

namespace counterpoint::apps::sweep {

/// Kind of quantity that an axis varies.
enum class Place {
  kParameter,  ///< parameter of the scene (recordings/parameters.h)
  kPosition,   ///< initial value of a coordinate of q
  kVelocity,   ///< initial value of a coordinate of v
  kAngle,      ///< initial roll, pitch or yaw of a free body; the two others are 0 unless varied
  kTimeStep,
  kDuration,
  kRandomInputs,
  kRandomWrenches,
  kInputSeed,
  kIntegrator,
  kFrictionModel,
  kContact,  ///< contact preset
  kInputs,   ///< file of applied forces
};

enum class Distribution { kUniform, kLogUniform, kNormal };

/// One varied quantity: over a list of numbers or words, which forms a grid with the other lists,
/// or drawn at random.
struct Axis {
  std::string name, where;  ///< where: "study.yaml:7", for messages
  Place place = Place::kParameter;
  int index = 0;  ///< index of the coordinate; kAngle: of the first quaternion coordinate
  int angle = 0;  ///< kAngle: 0 roll, 1 pitch, 2 yaw
  Parameter parameter;
  std::vector<double> numbers;
  std::vector<std::string> words;
  Distribution distribution = Distribution::kUniform;
  double a = 0.0, b = 0.0;  ///< low and high, or mean and standard deviation
  bool random = false;

  bool has_words() const { return !words.empty(); }
  std::int64_t levels() const {
    return random ? 1 : static_cast<std::int64_t>(std::max(numbers.size(), words.size()));
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
