#include "task_arguments.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <csignal>
#include <fstream>

#include "command_line/command_line.h"
#include "counterpoint/model/spatial.h"
#include "report/report.h"

namespace counterpoint::apps::tasks {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCommandFile = "command.json";
/// More tasks would not fit into a table.
constexpr std::int64_t kMostShares = 1'000'000;

/// Redirects standard output and standard error to /dev/null.
class Silence {
 public:
  explicit Silence(bool wanted) {
    if (!wanted) return;
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) dup2(nowhere, stream);
    close(nowhere);
  }
};

Share parse_share(const std::string& text) {
  Share share;
  const char* end = text.data() + text.size();
  const auto [slash, error] = std::from_chars(text.data(), end, share.index);
  if (error == std::errc() && slash != end && *slash == '/') {
    const auto [stop, second] = std::from_chars(slash + 1, end, share.of);
    if (second == std::errc() && stop == end && share.index >= 1 && share.index <= share.of &&
        share.of <= kMostShares) {
      --share.index;
      return share;
    }
  }
  throw InputError(
      fmt::format("--tasks {}: expected K/N, share K of N, K from 1 to N: --tasks 3/10. In a job "
                  "array of Slurm: "
                  "--array=1-10, --tasks $SLURM_ARRAY_TASK_ID/10",
                  text));
}

std::vector<std::string> own_command_line() {
  std::ifstream stream("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(stream, word, '\0');) words.push_back(word);
  if (!words.empty()) words.erase(words.begin());
  return words;
}

}  // namespace

void TaskArguments::add_to(Command& command, const std::string& parts_help) {
  command.add("--threads", threads_,
              "Number of threads; default 0: one for every core that this process (each rank of "
              "mpirun) may use. Results do not depend on it",
              range(0, 4096));
  command.add("--tasks K/N", share_,
              "Run share K of N only, of a job array; `merge` then joins the shares");
  command.add("--parts DIR", parts_,
              parts_help.empty() ? "Folder where finished tasks are kept: a run that was stopped "
                                   "goes on, and shares meet"
                                 : parts_help);
  command.add("--join", join_, "Compute nothing: join what --parts has (`merge` does it)", seldom);
}

void TaskArguments::default_parts(const std::string& folder) {
  if (parts_.empty()) parts_ = folder;
}

RunSettings TaskArguments::settings(std::function<bool()> stop) const {
  RunSettings settings;
  settings.threads = threads_;
  if (!share_.empty()) {
    settings.share = parse_share(share_);
    if (parts_.empty())
      throw InputError("--tasks: give --parts DIR too, the folder where the shares meet");
  }
  if (join_ && parts_.empty()) throw InputError("--join: give --parts DIR too");
  settings.folder = parts_;
  settings.compute = !join_;
  settings.stop = std::move(stop);
  return settings;
}

int TaskArguments::in_world(Report& report, const std::function<int(World&)>& work) {
  // Ignores the signal for the file size limit; write() then returns an error, as for a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
  const std::unique_ptr<World> world = join_world();
  const auto run_work = [&] {
    try {
      return work(*world);
    } catch (const Incomplete& incomplete) {
      return world->is_root() ? explain(incomplete, report) : 0;
    }
  };
  if (world->size() == 1) return run_work();
  const Silence silence(!world->is_root());
  int code = 0;
  try {
    std::string failure;
    bool bad_input = false;
    try {
      code = run_work();
    } catch (const WorldFailed&) {
      throw;
    } catch (const InputError& error) {
      failure = error.what();
      bad_input = true;
    } catch (const std::exception& error) {
      failure = error.what();
    }
    agree(*world, failure, bad_input);
  } catch (const WorldFailed& failed) {  // on all ranks
    if (!world->is_root()) return 0;
    if (failed.bad_input()) throw InputError(failed.what());
    throw std::runtime_error(failed.what());
  }
  return world->is_root() ? code : 0;
}

Results TaskArguments::run(World& world, const TaskList& list, std::function<bool()> stop,
                           bool everywhere) const {
  RunSettings run = settings(std::move(stop));
  run.everywhere = everywhere;
  if (world.is_root() && !join_ && !parts_.empty()) keep_command_line();
  return run_tasks(world, list, run);
}

Results TaskArguments::run_last(World& world, const TaskList& list, std::function<bool()> stop,
                                bool partial) const {
  Results results = run(world, list, std::move(stop));
  if (is_share() || !(results.complete() || (partial && results.stopped)))
    throw Incomplete{std::move(results), list.name};
  return results;
}

ListResults RunSeries::run(const TaskList& list) {
  last_ = arguments_.run(world_, list, stop_, true);
  const bool stopped_share = arguments_.is_share() && last_.stopped;
  if (!last_.complete() && (!last_.stopped || stopped_share))
    throw Incomplete{last_, list.name, list.name != last_name_};
  ListResults results(static_cast<std::size_t>(list.count));
  last_.for_each([&](std::int64_t number, std::string&& bytes) {
    if (!bytes.empty()) results[static_cast<std::size_t>(number)] = std::move(bytes);
  });
  return results;
}

void RunSeries::finish() const {
  if (arguments_.is_share()) throw Incomplete{last_, last_name_};
}

void TaskArguments::keep_command_line() const {
  std::error_code error;
  fs::create_directories(parts_, error);
  if (error)
    throw InputError(fmt::format(
        "{}: finished tasks cannot be kept here ({}); expected a folder that can be written",
        parts_, error.message()));
  Json words = Json::array();
  bool skip = false;
  for (const std::string& word : own_command_line()) {
    const std::string name = word.substr(0, word.find('='));
    const bool left_out = name == "--tasks" || name == "--parts";  // merge sets the folder
    if (!skip && !left_out) words.push_back(word);
    skip = left_out && name == word;
  }
  // Several shares may write the same content at once: each writes its own file and renames it.
  const fs::path file = fs::path(parts_) / kCommandFile;
  const fs::path own = fs::path(parts_) / fmt::format("{}.{}", kCommandFile, getpid());
  write_file(own, Json{{"command", words}, {"folder", fs::current_path().string()}}.dump(1) + "\n");
  fs::rename(own, file);
}

KeptCommand kept_command(const fs::path& parts) {
  std::ifstream stream(parts / kCommandFile);
  const Json json = Json::parse(stream, nullptr, false);
  if (json.is_discarded() || !json.contains("command") || !json.contains("folder"))
    throw InputError(
        fmt::format("{}: holds no finished tasks ({} is missing); expected a folder that --tasks "
                    "or --parts has "
                    "filled, TABLE.parts say",
                    parts.string(), kCommandFile));
  return {json["command"].get<std::vector<std::string>>(), json["folder"].get<std::string>()};
}

int TaskArguments::explain(const Incomplete& incomplete, Report& report) const {
  const Results& results = incomplete.results;
  add_run(results, report);
  report["status"] = results.stopped ? "stopped" : "incomplete";
  report.write();
  const std::string how =
      fmt::format("{} of {} {} are done", results.finished, results.count, incomplete.name);
  if (is_share() && !results.stopped) {
    fmt::print(report.text(),
               "share {} of {} is done: {} tasks in {:.3g} s. When all shares are: {}\n", share_,
               incomplete.name, results.computed, results.seconds,
               incomplete.followed ? "run them again, for what follows from these"
                                   : "counterpoint merge " + parts_);
    return 0;
  }
  if (join_) {
    fmt::print(stderr,
               "error: {}: {}; run the missing shares again, or the command without --tasks\n",
               parts_, how);
    return 1;
  }
  fmt::print(stderr, "stopped: {}{}\n", how,
             parts_.empty() ? "" : "; the same command goes on from there (" + parts_ + ")");
  return 1;
}

void add_run(const Results& results, Report& report) {
  report["tasks"] = results.count;
  report["finished_tasks"] = results.finished;
  report["computed_tasks"] = results.computed;
  report["ranks"] = results.ranks;
  report["threads"] = results.threads;
  report["wall_seconds"] = results.seconds;
  report["tasks_per_second"] =
      results.seconds > 0.0 ? static_cast<double>(results.computed) / results.seconds : 0.0;
}

}  // namespace counterpoint::apps::tasks
