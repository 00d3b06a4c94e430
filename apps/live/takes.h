// Recordings of a live session: each a motion from a given state with one set of options, that
// `simulate` repeats to the bit (docs/reference/live.md, Recordings).
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "counterpoint/engine/step.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::live {

class Takes {
 public:
  /// file: the first recording, "motion.csv"; the others are "motion_2.csv" ... Empty: none can be
  /// made. columns: inputs to record beside applied forces. The model must outlive the takes.
  Takes(std::filesystem::path file, const Model& model, InputColumns columns);
  ~Takes();

  bool possible() const { return !file_.empty(); }
  bool running() const { return writer_ != nullptr; }
  /// File of the present recording, or of the last one; empty before the first.
  const std::filesystem::path& file() const { return current_; }
  long steps() const { return steps_; }  ///< in that file

  /// Starts the next recording. command: the command line that repeats its options. @throws
  /// InputError if a file cannot be written.
  void begin(const State& start, const SimulationOptions& options, const std::string& command);
  void add(const State& before, const Input& input, double h, const State& after,
           const StepReport& report);
  /// Ends the recording, if there is one.
  void end();
  /// The command line that repeats the present recording so far, or the last one.
  std::string command() const;

 private:
  std::filesystem::path beside(const char* ending) const;
  void write_command() const;

  const std::filesystem::path file_;
  const Model& model_;
  const InputColumns columns_;
  std::unique_ptr<TrajectoryWriter> writer_;
  std::filesystem::path current_;
  std::string command_;
  State last_;
  std::vector<TautLink> taut_links_;
  double h_ = 0.0;  ///< [s]
  long steps_ = 0;
  int count_ = 0;  ///< recordings begun
};

}  // namespace counterpoint::live
