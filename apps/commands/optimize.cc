// counterpoint optimize: finds motions of robots with contact, from a problem file.
#include "counterpoint/engine/optimize/optimize.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <optional>

#include "command.h"
#include "command_line/interrupt.h"
#include "counterpoint/engine/optimize/feedback.h"
#include "counterpoint/engine/optimize/retarget.h"
#include "input/data_folder.h"
#include "optimize/live_search.h"
#include "optimize/page.h"
#include "optimize/run.h"
#include "report/report.h"
#include "tasks/fingerprint.h"
#include "tasks/task_arguments.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

namespace opt = optimization;

struct OptimizeArguments {
  const char* command = "optimize";
  std::string problem, output, folder, from, derivatives, feedback;
  std::string motion, motion_scene, fit_output;  ///< `retarget` has these
  std::optional<int> frames, iterations;
  std::optional<double> smoothing, feedback_smoothing;
  int starts = 1, cycles = 1;
  tasks::TaskArguments tasks;
  std::uint64_t seed = 0;
  bool resume = false, quiet = false, live = false;
  view::ViewOption view;
  Report report;
};

/// Shows progress: on a terminal in one line that is overwritten, else in a line per stage.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0) {}
  ~ProgressLine() {
    if (terminal_ && !last_.empty()) fmt::print(stderr, "\r\x1b[K");
  }
  void show(const opt::Progress& p) {
    if (quiet_) return;
    const bool new_stage = p.stage != stage_ || p.smoothing != smoothing_;
    if (!terminal_ && new_stage && !last_.empty()) fmt::print(stderr, "{}\n", last_);
    last_ = fmt::format(
        "iteration {:4d}  cost {:12.6g}  unactuated {:.2e}  smoothing {:.1e} m  {:.1f} s",
        p.iteration, p.cost, p.unactuated.max, p.smoothing, p.seconds);
    if (terminal_) fmt::print(stderr, "\r{}\x1b[K", last_);
    stage_ = p.stage;
    smoothing_ = p.smoothing;
  }

 private:
  bool quiet_, terminal_;
  int stage_ = -1;
  double smoothing_ = 0.0;
  std::string last_;
};

/// Returns the file, beside the motion, that records how far the continuation has come.
std::string resume_file(const OptimizeArguments& arguments) {
  return arguments.output + ".resume.json";
}

void check(const OptimizeArguments& arguments) {
  arguments.view.check();
  const tasks::RunSettings run = arguments.tasks.settings();
  if (arguments.starts == 1 && !run.folder.empty())
    throw InputError("--tasks, --parts: tasks are the starts; give --starts N, 2 or more");
  if (arguments.starts > 1 && arguments.resume)
    throw InputError("--resume goes on with one start; leave --starts out (--parts keeps starts)");
  if (arguments.starts > 1 && arguments.live)
    throw InputError("--live shows one start; leave --starts out");
  if (arguments.resume && arguments.output.empty())
    throw InputError("--resume: which motion? give its file by --output");
  if (arguments.resume && !arguments.from.empty())
    throw InputError("--resume goes on from --output; --from starts anew: give one of the two");
  if (arguments.resume && !std::filesystem::exists(resume_file(arguments)))
    throw InputError("--resume: there is no " + resume_file(arguments) +
                     "; start without --resume");
}

void apply(const OptimizeArguments& arguments, opt::ProblemFile& file) {
  opt::Settings& settings = file.settings;
  if (arguments.iterations) settings.max_iterations = *arguments.iterations;
  if (arguments.smoothing) settings.continuation.end = arguments.smoothing;
  if (arguments.derivatives == "differences")
    settings.derivatives = DerivativeMethod::kCentralDifferences;
}

/// Saves the motion so far, so that a stopped run has it.
void keep(const OptimizeArguments& arguments, const opt::ProblemFile& file,
          const opt::Result& result) {
  if (arguments.output.empty()) return;
  write_motion(arguments.output, *file.problem.model, result.options.time_step, result);
  const Json json = {{"smoothing_m", result.smoothing},
                     {"outcome", opt::outcome_name(result.outcome)}};
  write_file(resume_file(arguments), json.dump(1) + "\n");
}

OptimizedStart run_start(const OptimizeArguments& arguments, const opt::ProblemFile& file,
                         std::uint64_t seed) {
  opt::Settings settings = file.settings;
  ProgressLine line(arguments.quiet || arguments.starts > 1);
  settings.progress = [&](const opt::Progress& p) {
    line.show(p);
    return !Interrupt::wanted();
  };
  OptimizedStart start;
  const bool shown = arguments.view.wanted() || !arguments.folder.empty();
  settings.stage_done = [&](const opt::Result& result) {
    if (arguments.starts == 1) keep(arguments, file, result);
    if (shown) start.stages.push_back(result);
  };
  const std::string from = arguments.resume ? arguments.output : arguments.from;
  if (arguments.resume) {
    const Json kept = read_json(resume_file(arguments));
    settings.continuation.resume_at = kept.at("smoothing_m").get<double>();
  }
  opt::Problem problem = file.problem;
  const std::vector<VectorX> guess =
      from.empty() ? opt::seeded_guess(file, seed) : frames_from(from, problem);
  std::optional<LiveSearch> live;
  if (arguments.live) live.emplace(file, guess).watch(settings);
  start.seed = seed;
  start.result = opt::optimize(problem, guess, settings);
  if (Interrupt::wanted()) Interrupt::end();  // the next signal ends verifying and saving
  start.verification = opt::verify(*file.problem.model, start.result.options, file.problem.motors,
                                   start.result.q, start.result.v.front());
  if (live) live->end(start);
  return start;
}

/// Returns a clip of a motion whose frames are h [s] apart; `forces`: with the contact forces that
/// the inverse finds.
template <typename Motion>
view::Clip clip_of(const Scene& scene, double h, const Motion& motion, bool forces) {
  view::ClipRecorder recorder(scene, 0.0, forces);
  return recorder.finish(for_each_step(
      motion, h, [&](const State& before, const Input& input, double step, const State& after) {
        recorder.add_step(before, input, step, after);
      }));
}

/// Returns clips of at most kMost stages that led to the motion, the first among them.
std::vector<view::Clip> stage_clips(const Scene& scene, const OptimizedStart& best) {
  constexpr std::size_t kMost = 6;
  std::vector<view::Clip> clips;
  const std::size_t count = best.stages.size();
  for (std::size_t i = 0; i < std::min(kMost, count); ++i) {
    const std::size_t stage = count <= kMost ? i : i * (count - 1) / (kMost - 1);
    const opt::Result& r = best.stages[stage];
    clips.push_back(clip_of(scene, r.options.time_step, r, false));
    clips.back().name = fmt::format("stage {}, smoothing {:.2g} m", stage + 1, r.smoothing);
  }
  return clips;
}

/// Writes the motion repeated as requested, its feedback, and its replay with the stages as ghosts.
void write_outputs(const OptimizeArguments& arguments, const opt::ProblemFile& file,
                   const OptimizedStart& best, Json& json) {
  std::optional<opt::Feedback> feedback;
  if (!arguments.feedback.empty()) {
    opt::FeedbackSettings settings;
    if (arguments.feedback_smoothing) settings.smoothing = *arguments.feedback_smoothing;
    feedback = opt::compute_feedback(file.problem, file.settings, best.result, settings);
    json["feedback_missing_steps"] = feedback->missing;
  }
  if (!arguments.output.empty()) keep(arguments, file, best.result);
  const double h = best.result.options.time_step;
  std::optional<opt::RepeatedMotion> motion;
  if (arguments.cycles > 1 || feedback) {
    motion =
        opt::repeated(file.problem, best.result, feedback ? &*feedback : nullptr, arguments.cycles);
    if (!arguments.output.empty()) write_motion(arguments.output, *file.problem.model, h, *motion);
    if (feedback) opt::write_feedback(arguments.feedback, *file.problem.model, motion->gains);
  }
  const bool linked = !arguments.folder.empty() && view::can_make_pages();
  if (!arguments.view.wanted() && !linked) return;
  Scene scene = *file.scene;
  scene.options = best.result.options;
  const view::Clip clip =
      motion ? clip_of(scene, h, *motion, true) : clip_of(scene, h, best.result, true);
  const std::vector<view::Clip> stages = stage_clips(scene, best);
  const view::Origin origin{file.scene_file.string(), {arguments.problem, arguments.output}};
  if (arguments.view.wanted())
    view::write_replay(arguments.view.file(), scene, origin, clip, stages);
  if (!linked) return;
  make_report_folder(arguments.folder);
  view::write_replay(std::filesystem::path(arguments.folder) / "replay.html", scene, origin, clip,
                     stages);
}

/// Prints the entry of a start in the report.
void print_start(const Json& start, bool free_duration, const Report& report) {
  report.print(
      "{}, effort {:.0f} % of the limits\n",
      format_entries(
          "{outcome} (seed {seed}): cost {cost:.6g} after {iterations} Newton steps in "
          "{wall_seconds:.2f} s, smoothing {smoothing_end_m:.1e} m\n"
          "  forces without a motor {unactuated_force_relative_max:.2e} of the weight; forward "
          "steps land within {forward_check_max:.1e}; overlap {overlap_max_m:.1e} m, stance slips "
          "{stance_slip_max_m:.1e} m a step, landings {landing_slip_max_m:.1e} m",
          start),
      100.0 * start["effort_share_max"].get<double>());
  if (free_duration)
    report.print("  duration found: {}\n",
                 format_entries("{duration_s:.6g} s, steps of {time_step_s:.6g} s", start));
}

/// Returns the list of starts, a task each. Both arguments must outlive it.
tasks::TaskList task_list(const OptimizeArguments& arguments, const opt::ProblemFile& file) {
  tasks::TaskList list;
  list.name = "starts";
  list.count = arguments.starts;
  tasks::Fingerprint hash;
  hash.add_file(arguments.problem);
  for (const auto& read : file.read_files) hash.add_file(read);
  hash.add_scene(*file.scene);
  if (!arguments.from.empty()) hash.add_file(arguments.from);
  hash.add(file.problem.steps);
  hash.add(file.settings.max_iterations);
  hash.add(file.settings.continuation.end.value_or(-1.0));
  hash.add(std::string_view(arguments.derivatives));
  hash.add(static_cast<std::uint64_t>(arguments.seed));
  hash.add(static_cast<int>(arguments.view.wanted() || !arguments.folder.empty()));
  list.fingerprint = hash.value();
  list.make_task = [&arguments, &file]() -> tasks::Task {
    return [&arguments, &file](std::int64_t i) {
      const OptimizedStart start =
          run_start(arguments, file, arguments.seed + static_cast<std::uint64_t>(i));
      return tasks::Outcome{bytes_of(start), start.result.outcome != opt::Outcome::kStopped};
    };
  };
  return list;
}

/// Gives the threads left over by the starts to the work within each; results are the same to the
/// bit.
void deal_threads(OptimizeArguments& arguments, const tasks::World& world,
                  opt::Settings& settings) {
  const int threads = arguments.tasks.threads(world);
  const std::int64_t processes = world.size() * arguments.tasks.settings().share.of;
  const std::int64_t each = (arguments.starts + processes - 1) / processes;
  const auto at_once = static_cast<int>(std::min<std::int64_t>(threads, each));
  arguments.tasks.set_threads(at_once);
  settings.threads = threads / at_once;
}

/// Runs all starts; returns them on rank 0. After Ctrl-C these are the starts that were begun.
std::vector<OptimizedStart> run_starts(OptimizeArguments& arguments, tasks::World& world,
                                       opt::ProblemFile& file) {
  deal_threads(arguments, world, file.settings);
  std::vector<OptimizedStart> starts;
  if (arguments.starts == 1) {  // a single start shows its progress
    if (world.is_root()) starts.push_back(run_start(arguments, file, arguments.seed));
    return starts;
  }
  const tasks::Results results =
      arguments.tasks.run_last(world, task_list(arguments, file), Interrupt::wanted, true);
  if (!world.is_root()) return starts;
  add_run(results, arguments.report);
  results.for_each([&](std::int64_t, std::string&& bytes) { starts.push_back(start_of(bytes)); });
  return starts;
}

int optimize(OptimizeArguments& arguments, tasks::World& world) {
  check(arguments);
  opt::ProblemFile file = opt::load_problem(arguments.problem, arguments.frames,
                                            {arguments.motion, arguments.motion_scene});
  apply(arguments, file);
  std::optional<opt::Fit> fit;
  if (file.retargeting != nullptr) fit = opt::fit_motion(file);
  Report& report = arguments.report;
  report.begin(arguments.command, file.scene_file.string());
  report["problem"] = arguments.problem;
  const Interrupt interrupt;
  const std::vector<OptimizedStart> starts = run_starts(arguments, world, file);
  Interrupt::end();
  if (!world.is_root()) return kSuccess;
  if (starts.empty()) {
    report["status"] = "stopped";
    report.write();
    return end_stopped(" before any start was begun");
  }
  std::size_t best = 0;
  Json list = Json::array();
  for (std::size_t i = 0; i < starts.size(); ++i) {
    fill_report(starts[i], list.emplace_back());
    print_start(list.back(), file.problem.duration.has_value(), report);
    if (is_better(starts[i], starts[best])) best = i;
  }
  report.json().update(list[best]);
  if (fit) {
    fill_fit(*fit, file, starts[best], report.json());
    print_fit(report);
    if (!arguments.fit_output.empty()) write_fit(arguments.fit_output, file, *fit);
  }
  if (starts.size() > 1) report["starts"] = list;
  write_outputs(arguments, file, starts[best], report.json());
  if (!arguments.folder.empty())
    write_optimization_page(arguments.folder, file, starts, best,
                            view::can_make_pages() ? "replay.html" : "");
  report.write();
  if (!Interrupt::wanted()) return starts[best].feasible() ? kSuccess : kFailed;
  if (arguments.output.empty()) return end_stopped("");
  return end_stopped("; {} is the motion so far, --resume goes on from it", arguments.output);
}

std::string bundled_problem(const std::string& name) {
  return bundled_file(name, {"scenes/optimize", "scenes/retarget"});
}

/// Adds the options of the search for a motion; from_help describes --from.
void add_search(Command& command, OptimizeArguments& arguments, const char* from_help) {
  command.add("--report DIR", arguments.folder, "Folder to write: a page with figures and charts");
  command.add("--from", arguments.from, from_help);
  command.add("--frames", arguments.frames, "Steps of the motion; default: the problem's",
              range(4, 100'000));
  command.add("--smoothing", arguments.smoothing,
              "Smoothing [m] of the last stage; default: the problem's, or the scene's", positive);
  command.add("--iterations", arguments.iterations, "Most Newton steps", positive);
  command.add("--live", arguments.live,
              "Serve a page that shows the search, and can end it; the address is printed");
}

void add_feedback(Command& command, OptimizeArguments& arguments) {
  command.add("--feedback", arguments.feedback,
              "Table to write: feedback gains along the motion, for simulate --follow");
  command.add("--feedback-smoothing", arguments.feedback_smoothing,
              "Smoothing [m] of the contacts that gains are found with; default 1e-4", positive);
}

}  // namespace

void add_optimize(CommandLine& line) {
  auto [command, arguments] = line.add<OptimizeArguments>(
      "optimize", "Find a motion through contact: forces follow from positions by the inverse",
      "Example:\n  counterpoint optimize data/scenes/optimize/humanoid_walk.yaml --output "
      "walk.csv --report walk",
      on_every_rank(optimize));
  command.add("PROBLEM", arguments.problem, "Problem file (.yaml), or bundled name (list problems)",
              becomes(bundled_problem), required);
  command.add("--output", arguments.output,
              "Table to write (.csv, .h5, .npz, .mcap): the motion and its forces");
  add_search(command, arguments, "Table of a motion to start from");
  command.add("--starts", arguments.starts,
              "So many starts, from seeds one apart; the best is kept", positive);
  command.add("--seed", arguments.seed, "Of the noise on the guess; 0, the default: none");
  command.add("--resume", arguments.resume, "Go on from --output, where a run was stopped");
  command.add("--derivatives analytic|differences", arguments.derivatives,
              "analytic (default), or central differences, to compare");
  command.add("--cycles", arguments.cycles, "Write a periodic motion so many times over", positive);
  add_feedback(command, arguments);
  arguments.tasks.add_to(command,
                         "Folder where finished starts are kept: a run that was stopped goes on");
  command.add("--quiet", arguments.quiet, "No progress line");
  arguments.view.add_to(command);
  arguments.report.add_to(command);
}

void add_retarget(CommandLine& line) {
  auto [command, arguments] = line.add<OptimizeArguments>(
      "retarget", "Turn a motion given by kinematics into one that a robot can do",
      "Example:\n  counterpoint retarget human_walk --motion recording_raw.csv --motion-scene "
      "scene.yaml --output walk.csv",
      on_every_rank(optimize));
  arguments.command = "retarget";
  command.add("PROBLEM", arguments.problem,
              "Problem file (.yaml) with the key 'retarget', or bundled name (list retarget)",
              becomes(bundled_problem), required);
  command.add("--motion", arguments.motion,
              "File of the motion to follow: coordinates of its scene, a skeleton (.bvh), markers "
              "(.trc, .c3d, .csv); default: the problem's");
  command.add("--motion-scene", arguments.motion_scene,
              "Scene, or robot, whose coordinates these are; default: the problem's");
  command.add("--output", arguments.output,
              "Table to write (.csv, .h5, .npz, .mcap): the motion and its forces");
  command.add("--fit-output", arguments.fit_output,
              "Table to write: the kinematic fit, which the motion follows");
  add_search(command, arguments, "Table of a motion to start from; default: the fit");
  add_feedback(command, arguments);
  command.add("--quiet", arguments.quiet, "No progress line");
  arguments.view.add_to(command);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
