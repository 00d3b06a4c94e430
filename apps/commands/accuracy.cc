// counterpoint accuracy: measures what accuracy costs in time on a scene, and recommends a setting.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "accuracy/findings.h"
#include "command.h"
#include "command_line/interrupt.h"
#include "input/scene_arguments.h"
#include "tasks/fingerprint.h"
#include "tasks/task_arguments.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

struct AccuracyArguments {
  SceneArguments scene;
  std::optional<double> duration, time_step;
  std::vector<std::string> vary = accuracy::usual_items();
  std::string reference = "auto", folder;
  std::vector<double> wants = {1e-3};
  double piece = 0.0;
  int pieces = 10, finer = 64, repeats = 5;
  tasks::TaskArguments tasks;
  Report report;
};

void check_options(const AccuracyArguments& arguments, SimulationOptions& options) {
  options.time_step = arguments.time_step.value_or(options.time_step);
  options.duration = arguments.duration.value_or(options.duration);
  const double h = options.time_step;
  if (!(h > 0.0 && std::isfinite(h)))
    throw InputError(fmt::format("time step {} s: expected a positive number", h));
  if (!(options.duration > 0.0 && options.duration / h * arguments.finer < 1e9)) {
    throw InputError(fmt::format(
        "duration {} s: expected more than 0, and fewer than 1e9 steps of the reference",
        options.duration));
  }
  for (const double want : arguments.wants)
    if (!(want > 0.0 && std::isfinite(want)))
      throw InputError(fmt::format("--want {}: expected an error, a positive number", want));
}

accuracy::ReferenceKind reference_kind(const std::string& name) {
  if (name == "analytic") return accuracy::ReferenceKind::kAnalytic;
  return name == "fine" ? accuracy::ReferenceKind::kFine : accuracy::ReferenceKind::kAutomatic;
}

/// Returns the motion at a setting with about 100 frames per second, up to the end or the first
/// failure.
view::Clip clip_at(const Scene& scene, const accuracy::Setting& setting, double time_step) {
  const double h = setting.engine ? setting.engine->options.time_step : time_step;
  const double frame = h * std::max(1.0, std::round(1.0 / (view::kDefaultRate * h)));
  const auto adapter = setting.make();
  view::Clip clip;
  clip.name = setting.label;
  clip.states.push_back({0.0, scene.q, scene.v});
  while (clip.states.back().time + 0.5 * frame < scene.options.duration) {
    const accuracy::Passage passage = adapter->advance(clip.states.back(), frame);
    if (!passage.failure.empty()) break;
    clip.states.push_back(passage.end);
  }
  clip.rows = clip.num_frames();
  return clip;
}

/// Writes a replay of the recommended setting. Its ghosts are the recommendations for other errors
/// and the most accurate and the cheapest setting of the Pareto front. Returns the page's name;
/// empty if there is nothing to show.
std::string write_settings_replay(const AccuracyArguments& arguments,
                                  const accuracy::Findings& findings) {
  constexpr double kMostSeconds = 60.0;  // limit on the computing time of a ghost [s]
  const Scene& scene = findings.scene;
  if (!view::can_make_pages() || !findings.recommendations[0].place) return "";
  std::vector<accuracy::Place> places;
  const auto add = [&](const accuracy::Place& place) {
    const bool slow = findings.at(place).cost * scene.options.duration > kMostSeconds;
    if ((places.empty() || !slow) && std::find(places.begin(), places.end(), place) == places.end())
      places.push_back(place);
  };
  for (const accuracy::Recommendation& r : findings.recommendations)
    if (r.place) add(*r.place);
  if (!findings.front.empty()) {
    add(findings.front.back());
    add(findings.front.front());
  }
  std::vector<view::Clip> clips;
  for (const accuracy::Place& place : places)
    clips.push_back(clip_at(scene, findings.at(place).setting, findings.plan.time_step));
  view::Clip first = std::move(clips.front());
  clips.erase(clips.begin());
  make_report_folder(arguments.folder);
  view::write_replay(std::filesystem::path(arguments.folder) / "replay.html", scene,
                     {arguments.scene.file, {}, arguments.scene.package_folders()},
                     std::move(first), std::move(clips));
  return "replay.html";
}

std::uint64_t fingerprint(const AccuracyArguments& arguments, const Scene& scene) {
  tasks::Fingerprint hash;
  hash.add_scene(scene);
  for (const std::string& item : arguments.vary) hash.add(std::string_view(item));
  hash.add(std::string_view(arguments.reference));
  hash.add(arguments.piece);
  hash.add(arguments.pieces);
  hash.add(arguments.finer);
  return hash.value();
}

int finish(AccuracyArguments& arguments, accuracy::Findings& findings) {
  const bool stopped = Interrupt::wanted();
  Report& report = arguments.report;
  const bool ok = !findings.front.empty() && findings.reference.warning.empty();
  report["status"] = stopped ? "stopped" : ok ? "ok" : "failed";
  accuracy::add_to(report, findings);
  accuracy::print(report.text(), findings);
  if (!arguments.folder.empty()) {
    if (!stopped) findings.replay = write_settings_replay(arguments, findings);
    accuracy::write_report(arguments.folder, findings);
  }
  report.write();
  if (stopped)
    return end_stopped(": settings not reached are left out, times are of fewer repeats{}",
                       arguments.folder.empty() ? "" : "; " + arguments.folder + " has the report");
  return ok ? kSuccess : kFailed;
}

int measure_accuracy(AccuracyArguments& arguments, tasks::World& world) {
  Scene scene = arguments.scene.load();
  check_options(arguments, scene.options);
  const accuracy::Plan plan =
      accuracy::plan_pieces(scene.options, arguments.pieces, arguments.piece);
  const accuracy::Families families = accuracy::make_families(scene, plan, arguments.vary);
  arguments.report.begin("accuracy", arguments.scene.file);
  tasks::RunSeries series(arguments.tasks, world, Interrupt::wanted, "settings");
  accuracy::MeasureOptions options;
  options.repeats = arguments.repeats;
  options.contacts = accuracy::rows_of(scene).contacts;
  options.run = series.runner();
  options.fingerprint = fingerprint(arguments, scene);
  // Every process computes the reference, so that none has to wait for another.
  const accuracy::Reference reference =
      accuracy::make_reference(scene, plan, reference_kind(arguments.reference), arguments.finer);
  const Interrupt interrupt;  // not earlier: before, there are no results to keep
  options.stop = Interrupt::wanted;
  std::vector<accuracy::MeasuredFamily> measured =
      accuracy::measure_errors(scene, plan, reference, families.families, options);
  series.finish();
  if (!world.is_root()) return kSuccess;
  accuracy::measure_times(plan, reference, options, measured);
  add_run(series.last(), arguments.report);
  accuracy::Findings findings{scene, plan, reference,       std::move(measured), families.left_out,
                              {},    {},   arguments.wants, arguments.repeats};
  findings.front = accuracy::pareto_front(findings.measured);
  for (const double want : arguments.wants)
    findings.recommendations.push_back(
        accuracy::recommend(findings.measured, want, reference.error));
  for (accuracy::Recommendation& r : findings.recommendations) {
    if (!r.place || Interrupt::wanted()) continue;
    accuracy::Point& point = findings.measured[r.place->family].points[r.place->point];
    try {
      accuracy::add_physics(scene, plan, reference, options, point);
    } catch (const accuracy::Stopped&) {
      break;
    }
    r.words += accuracy::block_words(point);
  }
  Interrupt::end();
  return finish(arguments, findings);
}

}  // namespace

void add_accuracy(CommandLine& line) {
  auto [command, arguments] = line.add<AccuracyArguments>(
      "accuracy", "What accuracy costs in time on a scene; which setting to take",
      "Example:\n  counterpoint accuracy data/scenes/accuracy/double_pendulum.yaml --want 1e-6 "
      "--report report",
      on_every_rank(measure_accuracy));
  arguments.scene.add_to(command);
  command.add(
      "--vary ITEM,...", arguments.vary,
      fmt::format(
          "What to vary, separated by commas: {}; default: all but law, adaptive and mujoco",
          fmt::join(accuracy::vary_items(), ",")),
      comma_separated);
  command.add("--reference auto|analytic|fine", arguments.reference,
              "analytic (closed form), fine (the engine at a small step), or auto");
  command.add("--finer", arguments.finer,
              "The reference's step is the scene's over this; default 64", range(2, 1'000'000));
  command.add("--want ERROR,...", arguments.wants,
              "Error to recommend a setting for, several separated by commas; default 1e-3",
              comma_separated);
  command.add("--pieces", arguments.pieces, "Pieces of the motion; default 10", range(1, 100'000));
  command.add("--piece", arguments.piece, "Their length [s]; default: as there is room", positive);
  command.add("--repeats", arguments.repeats, "Runs of which the time is the median; default 5",
              range(1, 10'000));
  command.add("--duration", arguments.duration, "Simulated time [s]; default: the scene's");
  command.add("--timestep", arguments.time_step,
              "Time step that is varied [s]; default: the scene's");
  command.add("--report DIR", arguments.folder,
              "Write accuracy.html with all tables and pictures, accuracy.csv, and pictures");
  arguments.tasks.add_to(command);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
