// counterpoint live: runs a scene while pages in a browser watch it, and obeys one of them.
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <unistd.h>

#include <cstdlib>
#include <optional>

#include "command.h"
#include "command_line/interrupt.h"
#include "counterpoint/collision/collider.h"
#include "input/applied_inputs.h"
#include "input/scene_arguments.h"
#include "live/session.h"
#include "report/report.h"
#include "view/replay.h"

namespace counterpoint::apps {
namespace {

struct LiveArguments {
  SceneArguments scene;
  std::optional<double> duration, time_step;
  live::SessionOptions session;
  std::optional<int> port;
  bool no_browser = false;
  Report report;
};

/// Opens an address in the user's browser, if there is a desktop. The browser has a process group
/// of its own, which Ctrl-C does not reach; std::system would lose a Ctrl-C that arrives meanwhile.
void open_browser(const std::string& address) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  std::string program = "xdg-open", page = address;
  char* const words[] = {program.data(), page.data(), nullptr};
  posix_spawn_file_actions_t silent;
  posix_spawn_file_actions_init(&silent);
  posix_spawn_file_actions_addopen(&silent, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  for (const int output : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&silent, output, "/dev/null", O_WRONLY, 0);
  posix_spawnattr_t apart;
  posix_spawnattr_init(&apart);
  posix_spawnattr_setflags(&apart, POSIX_SPAWN_SETPGROUP);
  pid_t child = 0;
  if (posix_spawnp(&child, words[0], &silent, &apart, words, environ) != 0)
    fmt::print(stderr, "note: no browser could be opened\n");
  posix_spawnattr_destroy(&apart);
  posix_spawn_file_actions_destroy(&silent);
}

int run(LiveArguments& arguments) {
  constexpr int kPort = 8890;
  if (!view::can_make_pages()) throw InputError(view::why_no_pages());
  live::SessionOptions& options = arguments.session;
  Scene scene = arguments.scene.load();
  // These options come through --option, so that the recordings' commands have them.
  if (arguments.time_step) {
    override_times({}, arguments.time_step, scene.options);
    arguments.scene.settings.push_back(fmt::format("time_step={}", *arguments.time_step));
  }
  options.duration = arguments.duration.value_or(0.0);
  options.server.port = arguments.port.value_or(kPort);
  options.server.any_port = !arguments.port;
  options.scene_file = arguments.scene.file;
  options.scene_words = arguments.scene.words();
  options.packages = arguments.scene.package_folders();
  for (const Note& note : collision::all_notes(scene.model))
    fmt::print(stderr, "note: {}: {}\n", note.where, note.message);
  if (scene.options.step_control)
    fmt::print(stderr, "note: a live run makes steps of time_step; step_control is off\n");
  live::Session session(std::move(scene), options);
  const Interrupt interrupt;
  arguments.report.print("{}\nCtrl-C ends it.\n", session.address());
  std::fflush(arguments.report.text());
  if (!arguments.no_browser) open_browser(session.address());
  session.run(Interrupt::wanted);
  Interrupt::end();

  Report& report = arguments.report;
  report.begin("live", arguments.scene.file);
  report["status"] = "ok";
  report["steps"] = session.steps();
  report["time_s"] = session.simulator().state().time;
  report["state_hash"] = std::to_string(state_hash(session.simulator().state()));
  if (!session.takes().file().empty()) {
    report["recording"] = session.takes().file().string();
    report["recording_command"] = session.takes().command();
    report.print("to repeat the last recording: {}\n", session.takes().command());
  }
  report.write();
  report.print("{} steps; state hash {}\n", session.steps(),
               state_hash(session.simulator().state()));
  return kSuccess;
}

}  // namespace

void add_live(CommandLine& line) {
  auto [command, arguments] = line.add<LiveArguments>(
      "live", "Run a scene in the browser: watch, poke, change settings, record",
      "Example:\n  counterpoint live humanoid_drop --record motion.csv", run);
  arguments.scene.add_to(command);
  add_times(command, arguments.duration, arguments.time_step);
  command.add("--port N", arguments.port,
              "Port of the server; default 8890, or any free one if that is taken; 0: any free one",
              range(0, 65535));
  command.add("--host ADDRESS", arguments.session.server.host,
              "Address to listen at; any but 127.0.0.1 and ::1 needs the token in the printed "
              "address; default 127.0.0.1",
              seldom);
  command.add("--no-browser", arguments.no_browser, "Print the address, and open no browser");
  command.add("--paused", arguments.session.paused, "Wait for the page's play button");
  command.add("--record FILE", arguments.session.record,
              "Trajectory to write, from the start; others beside it after each rewind and change "
              "of a setting (docs/reference/live.md)");
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
