// Checks a collection of MJCF files, such as mujoco_menagerie: whether our reader accepts each
// file, whether it simulates, and how the models compare with MuJoCo's. Writes
// docs/measurements/mjcf.md.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "peers/mjcf_compare.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

std::string read_all(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Scene and robot file of a folder: scene.xml has priority over other scenes; the robot is the
/// file that the scene includes.
struct Folder {
  fs::path scene, robot;
};
Folder files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".xml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  const auto is_scene = [](const fs::path& f) { return f.stem().string().starts_with("scene"); };
  std::stable_sort(files.begin(), files.end(), [&](const fs::path& a, const fs::path& b) {
    return (a.filename() == "scene.xml") > (b.filename() == "scene.xml");
  });
  Folder out;
  static const std::regex include("<(?:include|model)[^>]* file=\"([^\"]+)\"");
  for (const fs::path& file : files) {
    if (!is_scene(file)) {
      if (out.robot.empty()) out.robot = file;
      continue;
    }
    const std::string text = read_all(file);
    std::smatch found;
    if (!out.scene.empty() || !std::regex_search(text, found, include)) continue;
    out.scene = file;
    out.robot = folder / found[1].str();
    break;
  }
  return out;
}

/// Simulates a file; returns "" if the command succeeds, else its error or last line.
std::string simulate(const std::string& command, const fs::path& file, double duration) {
  const std::string line = fmt::format("timeout 600 '{}' simulate '{}' --duration {} 2>&1", command,
                                       file.string(), duration);
  std::FILE* pipe = popen(line.c_str(), "r");
  if (!pipe) return "the command cannot be run";
  std::string text;
  std::array<char, 4096> block{};
  while (const std::size_t n = std::fread(block.data(), 1, block.size(), pipe))
    text.append(block.data(), n);
  if (pclose(pipe) == 0) return "";
  const std::size_t error = text.find("error:");
  if (error != std::string::npos) return text.substr(error, text.find('\n', error) - error);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

constexpr LeaveOut kEverything[] = {LeaveOut::kFluid,      LeaveOut::kTendons,
                                    LeaveOut::kActuators,  LeaveOut::kJointForces,
                                    LeaveOut::kEqualities, LeaveOut::kFrictionDirections};

MjcfOptions everything_left_out() {
  MjcfOptions options;
  options.leave_out.insert(std::begin(kEverything), std::end(kEverything));
  return options;
}

/// Writes a scene of the robot without the elements that the engine lacks.
fs::path reduced_scene(const fs::path& robot) {
  std::string words;
  for (const LeaveOut what : kEverything)
    words += (words.empty() ? "" : ", ") + std::string(leave_out_name(what));
  const fs::path file = fs::temp_directory_path() / fmt::format("mjcf_check_{}.yaml", getpid());
  std::ofstream(file) << fmt::format("models: [{{mjcf: {}, leave_out: [{}]}}]\n",
                                     fs::absolute(robot).string(), words);
  return file;
}

std::string metric(double x) { return x == 0.0 ? "0" : fmt::format("{:.0e}", x); }

/// Escapes text for a cell of a table and removes the folder, which differs between machines.
std::string cell(std::string text, const fs::path& folder) {
  for (std::size_t at; (at = text.find(folder.string() + "/")) != std::string::npos;)
    text.erase(at, folder.string().size() + 1);
  text = std::regex_replace(text, std::regex("[|\n]"), "/");
  text = std::regex_replace(text, std::regex("\\. To go on without it[^;]*\\}\\]"), "");
  return std::regex_replace(text, std::regex("<"), "\\<");
}

struct Settings {
  fs::path folder;
  int states;       ///< random states at which both are compared
  double duration;  ///< duration of a simulation [s]
  std::string command;
};

/// Counts of robots and of scenes.
struct Counts {
  int robots = 0, loaded = 0, ran = 0, reduced = 0, scenes = 0, scenes_ran = 0, same = 0, near = 0;
  int same_forces = 0, commanded = 0, servos = 0, without_counterpart = 0, tendons = 0;
};

/// Bounds of the differences.
constexpr double kPoseBound = 1e-12, kBound = 1e-9;

/// Counts a robot that both engines read.
void count_agreement(const MjcfComparison& c, Counts& counts) {
  counts.commanded += c.commanded;
  counts.servos += c.servos;
  counts.without_counterpart += c.without_counterpart;
  counts.tendons += c.tendons;
  if (c.pose > kPoseBound) return;
  counts.near += c.mass_with_theirs <= kBound && c.bias_with_theirs <= kBound;
  counts.same += c.mass <= kBound && c.bias <= kBound;
  counts.same_forces +=
      std::max({c.joint_force, c.actuator_force, c.tendon_length, c.tendon_arms}) <= kBound;
}

/// Differences from MuJoCo, as eleven cells of a table.
std::string metrics_of(const MjcfComparison& c, const fs::path& folder) {
  const std::string blank = " | | | | | | | | | | ";
  if (!c.refused.empty()) return blank;
  if (!c.unreadable.empty()) return cell(c.unreadable, folder) + blank;
  const auto of = [](int count, double x) { return count == 0 ? "-" : metric(x); };
  return fmt::format("{} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {}", metric(c.pose),
                     metric(c.mass), metric(c.bias), metric(c.joint_force),
                     of(c.commanded, c.actuator_force), of(c.tendons, c.tendon_length),
                     of(c.tendons, c.tendon_arms), metric(c.inertia), metric(c.mass_with_theirs),
                     metric(c.bias_with_theirs), c.notes);
}

/// Loads, compares and simulates one robot; returns its row.
std::string check_robot(const Settings& settings, const fs::path& one, bool stands_in,
                        Counts& counts) {
  const std::string name = one.filename().string();
  const Folder files = files_of(one);
  ++counts.robots;
  MjcfComparison c = compare_with_mujoco(files.robot, settings.states);
  const std::string refused = c.refused;
  std::string fate = refused, scene_fate = "none";
  if (refused.empty()) {
    ++counts.loaded;
    fate = simulate(settings.command, files.robot, settings.duration);
    counts.ran += fate.empty();
  } else {
    c = compare_with_mujoco(files.robot, settings.states, everything_left_out());
    const std::string failure =
        c.refused.empty()
            ? simulate(settings.command, reduced_scene(files.robot), settings.duration)
            : c.refused;
    counts.reduced += failure.empty();
    fate += failure.empty() ? "; simulates with that left out" : "; and " + failure;
  }
  if (!files.scene.empty()) {
    ++counts.scenes;
    scene_fate = simulate(settings.command, files.scene, settings.duration);
    counts.scenes_ran += scene_fate.empty();
  }
  if (refused.empty() && c.unreadable.empty()) count_agreement(c, counts);
  const std::string metrics = metrics_of(c, settings.folder);
  fmt::print("{} {} {} | scene: {}\n", name, fate.empty() ? "ran" : fate, metrics,
             scene_fate.empty() ? "ran" : scene_fate);
  std::fflush(stdout);
  return fmt::format("| {}{} | {} | {} | {} | {} | {} |\n", name, stands_in ? "*" : "",
                     files.robot.filename().string(), c.refused.empty() ? std::to_string(c.nv) : "",
                     metrics, fate.empty() ? "yes" : cell(fate, settings.folder),
                     scene_fate.empty() ? "yes" : cell(scene_fate, settings.folder));
}

std::string summary_of(const Counts& n, double duration) {
  std::string out = fmt::format(
      "{} robots: {} load, {} of them simulate {} s without a failed step; so do {} of {} scenes.\n"
      "Mass matrix and bias forces of {} are as MuJoCo {} has them within the bounds, of {} if "
      "the\n"
      "principal axes are MuJoCo's; tendons, actuators and joint forces of {}. Compared are {}\n"
      "tendons, {} actuators with a command of their own, and {} servos and motors of joints and\n"
      "tendons; {} actuators have no counterpart.\n",
      n.robots, n.loaded, n.ran, duration, n.scenes_ran, n.scenes, n.same, mujoco_used(), n.near,
      n.same_forces, n.tendons, n.commanded, n.servos, n.without_counterpart);
  if (n.loaded < n.robots)
    out += fmt::format("{} of those refused simulate with what is lacking left out.\n", n.reduced);
  return out;
}

/// Writes the page; false if it could not be written.
bool write_page(const fs::path& out, const std::string& summary, int states,
                const std::string& rows) {
  std::ofstream stream(out);
  stream
      << "# MJCF files of mujoco_menagerie, robot by robot\n\nWritten by counterpoint_mjcf_check; "
         "how to run it and what it finds is told in [MJCF](../reference/mjcf.md).\n\n"
      << summary
      << fmt::format(
             "\nFigures: the largest differences at {} random states with random controls and\n"
             "activations; joints that follow others do so. Poses of all named bodies [m, or of "
             "the\n"
             "rotation matrix]; mass matrix, M_ij over sqrt(M_ii M_jj); bias forces over the "
             "largest.\n"
             "The next four are over the largest of the same coordinate, actuator or tendon at "
             "any\n"
             "state. Joint forces: springs, dampers, servos, motors and actuators of joints, "
             "tendons and\n"
             "links. Actuators: forces of those with a command of their own (\"-\": none). "
             "Tendons:\n"
             "lengths and moment arms. Bounds: poses 1e-12, all others 1e-9. Rotational inertia of "
             "a\n"
             "body, over its norm: MuJoCo's search for principal axes ends with up to 1e-12 off "
             "the\n"
             "diagonal; and the mass matrix and bias forces again with its inertias in place of "
             "those in\n"
             "the file. \\*: meshes that the stored snapshot lacks are stood in for by boxes.\n\n",
             states)
      << "| robot | file | nv | poses | mass matrix | bias forces | joint forces | actuators | "
         "tendon lengths | moment arms | inertia | mass matrix, its axes | bias forces, its axes | "
         "notes | simulates | its scene |\n"
         "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n"
      << rows;
  return static_cast<bool>(stream);
}

int run(const Settings& settings, const std::string& only, const fs::path& out) {
  const fs::path& folder = settings.folder;
  if (!fs::is_directory(folder)) {
    fmt::print("Skipped: there is no folder {}; fetch mujoco_menagerie and say where it is.\n",
               folder.string());
    return 0;
  }
  std::set<std::string> stand_ins;
  std::istringstream absent(read_all(folder / "ABSENT.txt"));
  for (std::string line; std::getline(absent, line);)
    stand_ins.insert(line.substr(0, line.find('/')));
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && !files_of(entry.path()).robot.empty())
      folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  std::string rows;
  Counts counts;
  for (const fs::path& one : folders) {
    const std::string name = one.filename().string();
    if (!only.empty() && name.find(only) == std::string::npos) continue;
    rows += check_robot(settings, one, stand_ins.count(name) > 0, counts);
  }
  const std::string summary = summary_of(counts, settings.duration);
  fmt::print("{}", summary);
  return out.empty() || write_page(out, summary, settings.states, rows) ? 0 : 1;
}

}  // namespace
}  // namespace counterpoint::apps

int main(int argc, char** argv) {
  CLI::App app(
      "Reads a collection of MJCF files, simulates them, and compares their models with MuJoCo's.");
  std::string folder, command, only, out, plugins;
  int states = 50;
  double duration = 2.0;
  app.add_option("FOLDER", folder, "Of mujoco_menagerie: a folder a robot")->required();
  app.add_option("--counterpoint", command, "The command to simulate with")->required();
  app.add_option("--states", states, "Random states of each robot");
  app.add_option("--duration", duration, "Simulated time [s]");
  app.add_option("--only", only, "Robots whose names hold this");
  app.add_option("--plugins", plugins, "MuJoCo's library of its plugin mujoco.pid");
  app.add_option("--out", out, "Markdown file for the table");
  CLI11_PARSE(app, argc, argv);
  if (!plugins.empty()) counterpoint::apps::load_plugins(plugins);
  return counterpoint::apps::run({folder, states, duration, command}, only, out);
}
