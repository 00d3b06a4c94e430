// counterpoint optimize: motions of robots that push against the world, from a problem file.
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <memory>
#include <optional>

#include "command.h"
#include "optimize/run.h"
#include "report.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

namespace opt = optimization;

struct Arguments {
  std::string problem, output, folder, from, derivatives;
  std::optional<int> frames, iterations;
  std::optional<double> smoothing;
  int threads = 0, starts = 1;
  std::uint64_t seed = 0;
  bool resume = false, quiet = false;
  view::ViewOption view;
  Report report;
};

std::atomic<bool> interrupted{false};
void interrupt(int) { interrupted = true; }

/// One line that is written over and over, where a person looks on; else a line for every stage.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0) {}
  ~ProgressLine() {
    if (terminal_ && drawn_) fmt::print(stderr, "\r\x1b[K");
  }
  void show(const opt::Progress& p) {
    const bool new_stage = p.stage != stage_ || p.smoothing != smoothing_;
    if (quiet_) return;
    if (terminal_) {
      fmt::print(stderr, "\r{}\x1b[K", text(p));
      drawn_ = true;
    } else if (new_stage && !last_.empty()) {
      fmt::print(stderr, "{}\n", last_);
    }
    last_ = text(p);
    stage_ = p.stage;
    smoothing_ = p.smoothing;
  }

 private:
  static std::string text(const opt::Progress& p) {
    return fmt::format(
        "iteration {:4d}  cost {:12.6g}  unactuated {:.2e}  violation {:.2e}  smoothing {:.1e} m  "
        "{:.1f} s",
        p.iteration, p.cost, p.unactuated.max, p.violation.max, p.smoothing, p.seconds);
  }
  bool quiet_, terminal_, drawn_ = false;
  int stage_ = -1;
  double smoothing_ = 0.0;
  std::string last_;
};

void apply(const Arguments& arguments, opt::ProblemFile& file) {
  opt::Settings& settings = file.settings;
  settings.threads = arguments.threads;
  if (arguments.iterations) settings.max_iterations = *arguments.iterations;
  if (arguments.smoothing) settings.continuation.end = arguments.smoothing;
  if (arguments.derivatives == "differences")
    settings.derivatives = DerivativeMethod::kCentralDifferences;
}

OptimizedStart run_start(const Arguments& arguments, const opt::ProblemFile& file,
                         std::uint64_t seed) {
  opt::Settings settings = file.settings;
  ProgressLine line(arguments.quiet);
  settings.progress = [&](const opt::Progress& p) {
    line.show(p);
    return !interrupted;
  };
  const std::vector<VectorX> guess = arguments.from.empty()
                                         ? opt::seeded_guess(file, seed)
                                         : frames_from(arguments.from, file.problem);
  OptimizedStart start;
  start.seed = seed;
  start.result = opt::optimize(file.problem, guess, settings);
  start.verification = opt::verify(*file.problem.model, start.result.options, file.problem.motors,
                                   start.result.q, start.result.v.front());
  return start;
}

int optimize(Arguments& arguments) {
  opt::ProblemFile file = opt::load_problem(arguments.problem);
  apply(arguments, file);
  std::signal(SIGINT, interrupt);
  std::optional<OptimizedStart> best;
  Json starts = Json::array();
  for (int i = 0; i < arguments.starts && !interrupted; ++i) {
    OptimizedStart start =
        run_start(arguments, file, arguments.seed + static_cast<std::uint64_t>(i));
    Json entry;
    fill_report(start, entry);
    starts.push_back(entry);
    if (!best || is_better(start, *best)) best = std::move(start);
  }
  if (!arguments.output.empty()) write_motion(arguments.output, file, best->result);
  Report& report = arguments.report;
  report.begin("optimize", file.scene_file.string());
  report["problem"] = arguments.problem;
  fill_report(*best, report.json());
  if (arguments.starts > 1) report["starts"] = starts;
  report.write();
  fmt::print(report.text(), "{}\n", report.json().dump(1));
  for (std::size_t i = 0; i < file.problem.terms.size(); ++i)
    fmt::print(report.text(), "  {} {:.4g}\n", file.problem.terms[i].name,
               best->result.cost_by_term[static_cast<Eigen::Index>(i)]);
  return best->feasible() ? kSuccess : kFailed;
}

}  // namespace

void add_optimize(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& command = *app.add_subcommand(
      "optimize", "Find a motion through contact: forces follow from positions by the inverse");
  command.add_option("PROBLEM", arguments->problem, "Problem file (docs/optimization-format.md)")
      ->required();
  command.add_option("--output", arguments->output, "CSV to write: the motion and its forces");
  command.add_option("--from", arguments->from, "CSV of a motion to start from");
  command
      .add_option("--smoothing", arguments->smoothing,
                  "Smoothing [m] of the last stage; default: the problem's, or the scene's")
      ->check(CLI::PositiveNumber);
  command.add_option("--iterations", arguments->iterations, "Most Newton steps")
      ->check(CLI::PositiveNumber);
  command.add_option("--threads", arguments->threads, "0, the default: one a core")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--starts", arguments->starts, "So many starts, from seeds one apart")
      ->check(CLI::PositiveNumber);
  command.add_option("--seed", arguments->seed, "Of the noise on the guess; 0: none");
  command
      .add_option("--derivatives", arguments->derivatives,
                  "analytic (default), or central differences, to compare")
      ->check(CLI::IsMember({"analytic", "differences"}));
  command.add_flag("--quiet", arguments->quiet, "No progress line");
  arguments->report.add_to(command);
  command.footer(
      "Example:\n  counterpoint optimize data/scenes/optimize/humanoid_walk.yaml --output "
      "walk.csv");
  command.callback([arguments, &action] { action = [arguments] { return optimize(*arguments); }; });
}

}  // namespace counterpoint::apps
