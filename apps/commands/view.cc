// counterpoint view: makes a page that plays a motion.
#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "command.h"
#include "command_line/interrupt.h"
#include "counterpoint/engine/trajectory.h"
#include "input/motion.h"
#include "input/scene_arguments.h"
#include "report/progress.h"
#include "report/report.h"
#include "view/capture.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

struct ViewArguments {
  SceneArguments scene;
  std::string motion, output, contacts, title, size;
  std::vector<std::string> ghosts, ghost_names;
  std::optional<double> time_step;
  double rate = view::kDefaultRate;
  bool forces = false;
  view::Pictures pictures;
  std::vector<double> gif, webm;
  Report report;
};

/// Parses WIDTHxHEIGHT [pixels].
void set_size(const std::string& text, view::Pictures& pictures) {
  if (text.empty()) return;
  int end = 0;
  const int found = std::sscanf(text.c_str(), "%dx%d%n", &pictures.width, &pictures.height, &end);
  const auto fits = [](int n) { return n >= 16 && n <= 8192; };
  if (found != 2 || end != static_cast<int>(text.size()) || !fits(pictures.width) ||
      !fits(pictures.height))
    throw InputError(fmt::format("--size {}: expected WIDTHxHEIGHT, 16 ... 8192 pixels", text));
}

/// Returns start [s], end [s] and frames per second; nothing if the option is not given.
std::optional<std::vector<double>> moving(const char* option, const std::vector<double>& numbers,
                                          int most) {
  if (numbers.empty()) return std::nullopt;
  const bool fine = numbers.size() == 3 && numbers[1] >= numbers[0] && numbers[2] > 0.0 &&
                    (numbers[1] - numbers[0]) * numbers[2] < most;
  if (fine) return numbers;
  throw InputError(
      fmt::format("{}: expected START,END,FRAMES_PER_SECOND, fewer than {} frames", option, most));
}

/// Reports errors in the arguments before the computation starts.
void check(ViewArguments& arguments) {
  if (!view::can_make_pages()) throw InputError(view::why_no_pages());
  set_size(arguments.size, arguments.pictures);
  arguments.pictures.gif = moving("--gif", arguments.gif, 2000);
  arguments.pictures.webm = moving("--webm", arguments.webm, 20000);
  if (arguments.pictures.webm && (arguments.pictures.width % 2 || arguments.pictures.height % 2))
    throw InputError("--webm: --size must be even");
  if (arguments.pictures.any() && view::find_chromium().empty())
    throw InputError("--png, --gif and --webm draw with Chromium; install chromium (Debian)");
  if (arguments.forces && !arguments.contacts.empty())
    throw InputError("--forces and --contacts: give one of them");
  if (arguments.ghost_names.size() > arguments.ghosts.size())
    throw InputError("--ghost-name: more names than ghosts");
}

view::Clip recorded(const ViewArguments& arguments, const Scene& scene,
                    const Trajectory& trajectory, const std::vector<double>& steps, bool forces) {
  Progress progress(forces ? "recovering forces" : "reading the motion", trajectory.num_steps());
  return view::clip_of(scene, trajectory, steps, arguments.rate, forces, [&](int done) {
    progress.update(done);
    return !Interrupt::wanted();
  });
}

view::Replay make_replay(const ViewArguments& arguments, const Scene& scene) {
  Trajectory trajectory = read_motion(arguments.motion, scene.model);
  std::vector<double> steps;
  if (arguments.forces) {
    steps = step_lengths(trajectory, arguments.time_step, scene.options.time_step);
    find_internal_states(scene.model, scene.options, steps, trajectory);
  }
  view::Clip clip = recorded(arguments, scene, trajectory, steps, arguments.forces);
  clip.name = "motion";
  if (!arguments.contacts.empty()) view::read_contacts(arguments.contacts, scene.model, clip);
  std::vector<view::Clip> ghosts;
  for (size_t i = 0; i < arguments.ghosts.size(); ++i) {
    const Trajectory other = read_motion(arguments.ghosts[i], scene.model);
    ghosts.push_back(recorded(arguments, scene, other, {}, false));
    const bool named = i < arguments.ghost_names.size();
    ghosts.back().name = named                          ? arguments.ghost_names[i]
                         : arguments.ghosts.size() == 1 ? "ghost"
                                                        : arguments.ghosts[i];
  }
  view::Origin origin{arguments.scene.file,
                      {arguments.motion, arguments.contacts},
                      arguments.scene.package_folders(),
                      {{"motion", arguments.motion}}};
  origin.inputs.insert(origin.inputs.end(), arguments.ghosts.begin(), arguments.ghosts.end());
  if (trajectory.altered_rows > 0)
    origin.remarks.emplace_back("rows that are not as simulate wrote them",
                                std::to_string(trajectory.altered_rows));
  view::Replay replay = view::make_replay(scene, origin, std::move(clip), std::move(ghosts));
  if (!arguments.title.empty()) replay.title = arguments.title;
  return replay;
}

/// Writes replay_1.25.png ... replay.gif, replay.webm for replay.html.
std::vector<std::string> write_pictures(const ViewArguments& arguments) {
  std::vector<std::string> names;
  if (!arguments.pictures.any()) return names;
  Progress progress("drawing pictures in Chromium", 1);
  const view::Drawn drawn = view::draw(arguments.output, arguments.pictures, [&] {
    progress.show_time();
    return !Interrupt::wanted();
  });
  progress.wipe();
  std::filesystem::path stem = arguments.output;
  stem.replace_extension();
  for (size_t i = 0; i < drawn.png.size(); ++i) {
    names.push_back(fmt::format("{}_{}.png", stem.string(), arguments.pictures.times[i]));
    view::write_whole(names.back(), drawn.png[i]);
  }
  for (const auto& [ending, bytes] : {std::pair(".gif", &drawn.gif), {".webm", &drawn.webm}}) {
    if (bytes->empty()) continue;
    names.push_back(stem.string() + ending);
    view::write_whole(names.back(), *bytes);
  }
  return names;
}

int view_motion(ViewArguments& arguments) {
  check(arguments);
  const Scene scene = arguments.scene.load();
  const Interrupt interrupt;
  const view::Replay replay = make_replay(arguments, scene);
  if (Interrupt::wanted()) Interrupt::end();
  const std::string page = view::replay_page(replay);
  view::write_whole(arguments.output, page);
  const std::vector<std::string> pictures =
      Interrupt::wanted() ? std::vector<std::string>() : write_pictures(arguments);
  const bool stopped = Interrupt::wanted();

  const view::Clip& clip = replay.clip;
  Report& report = arguments.report;
  report.begin("view", arguments.scene.file);
  report["status"] = stopped ? "stopped" : "ok";
  report["page"] = arguments.output;
  report["page_bytes"] = page.size();
  report["rows"] = clip.rows;
  report["frames"] = clip.num_frames();
  report["start_time_s"] = clip.states.front().time;
  report["end_time_s"] = clip.states.back().time;
  report["bodies"] = scene.model.num_bodies() - 1;
  report["shapes"] = scene.model.geometries().size();
  report["visuals"] = replay.visuals.shapes.size();
  report["contact_forces"] = clip.contacts.size();
  report["closure_forces"] = clip.closure_forces.size();
  report["notes"] = replay.visuals.notes;
  report["position_resolution_m"] = view::resolution_of(replay).position;
  report["pictures"] = pictures;
  report.write();
  report.print("{}: {:.3g} MB, ", arguments.output, static_cast<double>(page.size()) / 1e6);
  report.print_entries(
      "{frames} frames of {rows} rows, {start_time_s:.6g} ... {end_time_s:.6g} s\n");
  for (const std::string& note : replay.visuals.notes) fmt::print(stderr, "note: {}\n", note);
  for (const std::string& name : pictures) report.print("{}\n", name);
  if (!stopped) return kSuccess;
  return end_stopped(
      ": {} has the motion up to {:.6g} s{}", arguments.output, clip.states.back().time,
      arguments.pictures.any() && pictures.empty() ? ", no pictures were drawn" : "");
}

}  // namespace

void add_view(CommandLine& line) {
  auto [command, arguments] = line.add<ViewArguments>(
      "view", "Write a motion as one HTML page that plays it, without network",
      "Example:\n  counterpoint simulate data/scenes/humanoid_drop.yaml --output fall.csv\n"
      "  counterpoint view data/scenes/humanoid_drop.yaml fall.csv --forces --output fall.html",
      view_motion);
  arguments.scene.add_to(command);
  command.add("MOTION", arguments.motion, "Motion as `simulate --output` writes it", required);
  command.add("--output FILE", arguments.output, "Page to write", required);
  command.add("--contacts FILE", arguments.contacts,
              "Contact forces, as `inverse --contacts` writes them");
  command.add("--forces", arguments.forces,
              "Contact forces as `inverse` recovers them from the motion");
  command.add("--timestep", arguments.time_step,
              "With --forces: time step [s] of a motion that does not say it");
  command.add("--ghost FILE", arguments.ghosts,
              "Second motion of the scene, drawn translucent; of several one at a time",
              one_value_each);
  command.add("--ghost-name", arguments.ghost_names,
              "What the legend calls it; as often as --ghost", one_value_each);
  command.add("--rate", arguments.rate, "Frames a second of the page [1/s]; 0: every row",
              not_negative, show_default);
  command.add("--title", arguments.title, "Default: the scene's name");
  command.add("--png T1,T2,...", arguments.pictures.times,
              "Times [s] of pictures to write beside the page: PAGE_TIME.png (Chromium)",
              comma_separated);
  command.add("--gif START,END,RATE", arguments.gif,
              "Moving picture to write beside the page: start [s], end [s], frames a second",
              comma_separated);
  command.add("--webm START,END,RATE", arguments.webm, "The same as a video (VP9), much smaller",
              comma_separated);
  command.add("--size WxH", arguments.size, "Of pictures [pixels]; default 960x540");
  command.add("--link SETTINGS", arguments.pictures.link,
              "How pictures look, as in the page's address: 'follow=pelvis&theme=dark'");
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
