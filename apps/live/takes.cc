#include "live/takes.h"

#include <fmt/format.h>

#include "report/report.h"
#include "view/input_files.h"

namespace counterpoint::live {

Takes::Takes(std::filesystem::path file, const Model& model, InputColumns columns)
    : file_(std::move(file)), model_(model), columns_(std::move(columns)) {}

Takes::~Takes() {
  try {
    end();
  } catch (const std::exception&) {
    // The rows so far are in the file.
  }
}

/// Name of a file that belongs to the present recording: motion_2.csv becomes motion_2 + ending.
std::filesystem::path Takes::beside(const char* ending) const {
  return current_.parent_path() / (current_.stem().string() + ending);
}

std::string Takes::command() const {
  return fmt::format("{} --resume {} --inputs {} --duration {}", command_,
                     view::shell_word(beside(".state.csv").string()),
                     view::shell_word(current_.string()), h_ * static_cast<double>(steps_));
}

void Takes::write_command() const { apps::write_file(beside(".txt"), command() + "\n"); }

void Takes::begin(const State& start, const SimulationOptions& options,
                  const std::string& command) {
  end();
  ++count_;
  current_ = count_ == 1 ? file_
                         : file_.parent_path() / fmt::format("{}_{}{}", file_.stem().string(),
                                                             count_, file_.extension().string());
  command_ = command;
  steps_ = 0;
  h_ = options.time_step;
  last_ = start;
  writer_ = std::make_unique<TrajectoryWriter>(current_, model_, columns_);
  write_state(beside(".state.csv"), model_, options, start);
  write_command();
}

void Takes::add(const State& before, const Input& input, double h, const State& after,
                const StepReport& report) {
  if (!writer_) return;
  find_taut_links(after, taut_links_);
  writer_->write_step(before, input, h, report.softening, taut_links_);
  last_.time = after.time;
  last_.q = after.q;
  last_.v = after.v;
  last_.z = after.z;
  ++steps_;
}

void Takes::end() {
  if (!writer_) return;
  const std::unique_ptr<TrajectoryWriter> writer = std::move(writer_);
  writer->write_end(last_);
  write_command();
}

}  // namespace counterpoint::live
