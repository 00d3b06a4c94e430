// counterpoint sweep: runs a study of many runs into one table, on one machine or many.
// counterpoint merge: joins the shares of a job array.
#include <fmt/format.h>

#include <filesystem>

#include "command.h"
#include "command_line/interrupt.h"
#include "input/data_folder.h"
#include "report/report.h"
#include "sweep/page.h"
#include "tasks/task_arguments.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

struct SweepArguments {
  std::string study, output, page;
  tasks::TaskArguments tasks;
  Report report;
};

std::string bundled_study(const std::string& name) { return bundled_file(name, {"studies"}); }

fs::path page_file(const SweepArguments& arguments) {
  return arguments.page.empty() ? fs::path(arguments.output).replace_extension(".html")
                                : fs::path(arguments.page);
}

void fill_report(const sweep::Study& study, const sweep::Summary& summary,
                 const tasks::Results& results, SweepArguments& arguments) {
  Report& report = arguments.report;
  report["study"] = study.file.string();
  add_run(results, report);
  report["status"] = summary.failed > 0 ? "failed" : "ok";
  report["failed_tasks"] = summary.failed;
  report["table"] = arguments.output;
  Json reasons = Json::array();
  for (const auto& [task, reason] : summary.reasons)
    reasons.push_back({{"task", task}, {"message", reason}});
  report["failures"] = reasons;
}

int finish(const sweep::Study& study, const tasks::Results& results, SweepArguments& arguments) {
  sweep::Page page(study);
  const sweep::Summary summary =
      sweep::write_table(arguments.output, study, results,
                         [&](std::int64_t task, const sweep::Row& row) { page.add(task, row); });
  write_file(page_file(arguments),
             page.text(summary, fs::path(arguments.output).filename().string()));
  fill_report(study, summary, results, arguments);
  arguments.report.write();
  arguments.report.print(
      "{} tasks, {} failed; {} computed in {:.3g} s on {} rank{} of {} thread{}\n", summary.rows,
      summary.failed, results.computed, results.seconds, results.ranks,
      results.ranks == 1 ? "" : "s", results.threads, results.threads == 1 ? "" : "s");
  arguments.report.print("written: {}, {}\n", arguments.output, page_file(arguments).string());
  for (const auto& [task, reason] : summary.reasons)
    fmt::print(stderr, "failed: task {}: {}\n", task, reason);
  if (summary.failed > static_cast<std::int64_t>(summary.reasons.size()))
    fmt::print(stderr, "failed: {} more; column 'reason' of the table\n",
               summary.failed - static_cast<std::int64_t>(summary.reasons.size()));
  return summary.failed > 0 ? kFailed : kSuccess;
}

int run_sweep(SweepArguments& arguments, tasks::World& world) {
  const sweep::Study study = sweep::load_study(arguments.study);
  sweep::check_metrics(study);
  arguments.tasks.default_parts(arguments.output + ".parts");
  const Interrupt interrupt;
  arguments.report.begin("sweep", study.scene_file);
  const tasks::Results results = arguments.tasks.run_last(
      world, sweep::task_list(study, arguments.output + ".trajectories", Interrupt::wanted),
      Interrupt::wanted, false);
  Interrupt::end();
  return world.is_root() ? finish(study, results, arguments) : kSuccess;
}

/// Copies the journals of the other folders into the first.
void gather_parts(const std::vector<std::string>& folders) {
  for (std::size_t i = 1; i < folders.size(); ++i) {
    for (const auto& entry : fs::directory_iterator(folders[i])) {
      if (entry.path().extension() != ".journal") continue;
      fs::copy_file(
          entry.path(),
          fs::path(folders[0]) / fmt::format("{}.from{}.journal", entry.path().stem().string(), i),
          fs::copy_options::overwrite_existing);
    }
  }
}

int merge(const std::vector<std::string>& folders, CommandLine& line) {
  const tasks::KeptCommand kept = tasks::kept_command(folders.front());
  for (const std::string& folder : folders)
    if (!fs::is_directory(folder))
      throw InputError(folder + ": is no folder; expected one that --tasks has filled");
  gather_parts(folders);
  std::vector<std::string> words{"counterpoint"};
  words.insert(words.end(), kept.words.begin(), kept.words.end());
  words.insert(words.end(), {"--join", "--parts", fs::absolute(folders.front()).string()});
  // Relative file names of the stored command refer to the folder where it ran.
  std::error_code error;
  fs::current_path(kept.folder, error);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  return line.run(static_cast<int>(argv.size()), argv.data());
}

}  // namespace

void add_sweep(CommandLine& line) {
  auto [command, arguments] = line.add<SweepArguments>(
      "sweep", "Run a study: a scene over grids and random draws, into one table",
      "Stopped or cut off, the same command goes on. On a cluster: mpirun -n 64 counterpoint sweep "
      "...,\n"
      "or a job array with --tasks K/N, then counterpoint merge TABLE.parts.\n"
      "Example:\n  counterpoint sweep cube_friction --output friction.csv",
      on_every_rank(run_sweep));
  command.add("STUDY", arguments.study,
              "Study (.yaml, docs/reference/study-format.md), or bundled name",
              becomes(bundled_study), required);
  command.add("--output", arguments.output, "Table to write (.csv, .h5, .npz, .mcap): a row a task",
              required);
  command.add("--page FILE", arguments.page,
              "Page with plots; default: the table's name with .html");
  arguments.tasks.add_to(command, "Folder where finished tasks are kept; default: TABLE.parts");
  arguments.report.add_to(command);
}

void add_merge(CommandLine& line) {
  using Folders = std::vector<std::string>;
  auto [command, folders] = line.add<Folders>(
      "merge", "Join the shares of a job array (--tasks K/N) into the command's results",
      "Example:\n  counterpoint merge friction.csv.parts",
      [&line](const Folders& parts) { return merge(parts, line); });
  command.add("PARTS", folders,
              "Folder that the shares have filled; several are put together in the first",
              required);
}

}  // namespace counterpoint::apps
