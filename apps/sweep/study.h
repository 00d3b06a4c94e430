// A study: a scene, what varies, what is recorded of each run (docs/reference/study-format.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/motion_files.h"
#include "counterpoint/model/scene.h"
#include "recordings/estimation.h"

namespace counterpoint::apps::sweep {

/// What an axis changes.
enum class Place {
  kParameter,  ///< a figure of the scene (recordings/parameters.h)
  kPosition,   ///< a coordinate of q at the start
  kVelocity,   ///< of v
  kAngle,      ///< roll, pitch or yaw of a free body at the start, the other two of them 0 unless
               ///< varied
  kTimeStep,
  kDuration,
  kRandomInputs,
  kRandomWrenches,
  kInputSeed,
  kIntegrator,
  kFrictionModel,
  kContact,  ///< preset
  kInputs,   ///< a file of applied forces
};

enum class Distribution { kUniform, kLogUniform, kNormal };

/// One thing that varies: over a list of numbers or words, which with the other lists make a grid;
/// or drawn at random.
struct Axis {
  std::string name, where;  ///< where: "study.yaml:7", for messages
  Place place = Place::kParameter;
  int index =
      0;  ///< of the coordinate; of the first of a quaternion; kAngle: 0 roll, 1 pitch, 2 yaw
  int angle = 0;
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

/// A column of the motion, made one number.
struct RecordedColumn {
  enum class Of { kEnd, kMin, kMax, kMean };
  std::string name;  ///< as written: "cube.z", "max(cube.z)"
  Of of = Of::kEnd;
  bool velocity = false;
  int index = 0;
};

struct Record {
  bool final_state = true, trajectories = false;
  std::vector<RecordedColumn> columns;
  std::vector<std::string> figures;  ///< of the report of `simulate`
};

struct Study {
  std::filesystem::path file;
  std::string scene_file;
  Scene scene;  ///< with duration, time step and `set`
  std::uint64_t seed = 0;
  std::int64_t draws = 1;
  std::string inputs;
  double random_inputs = 0.0, random_wrenches = 0.0;
  std::vector<Axis> axes;
  Record record;
  std::uint64_t fingerprint = 0;  ///< of the file, the scene and the files of inputs

  std::int64_t num_tasks() const;
};

/// @throws InputError naming file, line, what was expected and what to do.
Study load_study(const std::filesystem::path& file);

}  // namespace counterpoint::apps::sweep
