// Counterpoint compared with MuJoCo and Pinocchio on the same models, in turn, in one process.
// docs/measurements/performance.md gives the commands and the results.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "peers/mujoco.h"
#include "peers/pinocchio.h"
#include "report/chart.h"
#include "tables.h"

namespace counterpoint::apps {
namespace {

struct Arguments {
  PeerOptions options;
  std::vector<std::string> tables = {"algorithms", "steps", "scale"};
  std::filesystem::path csv, svg;
};

using Compare = void (*)(const PeerOptions&, PeerTable&);
const std::map<std::string, Compare> kTables = {
    {"algorithms", compare_algorithms}, {"derivatives", compare_derivatives},
    {"steps", compare_steps},           {"scale", compare_scale},
    {"piles", compare_piles},           {"robots", compare_robots},
    {"softness", compare_softness}};

std::vector<std::string> table_names() {
  std::vector<std::string> names;
  for (const auto& [name, compare] : kTables) names.push_back(name);
  return names;
}

/// Draws time over the number of velocities, one curve for each engine and quantity.
void write_svg(const std::filesystem::path& file, const std::vector<PeerRow>& rows) {
  Chart chart;
  chart.title = "One thread, medians: time over velocities";
  chart.x_label = "velocities";
  chart.y_label = "time [us]";
  chart.log_x = chart.log_y = chart.legend_beside = true;
  std::set<std::string> seen;
  for (const PeerRow& row : rows) {
    const std::string name = row.table + ": " + row.engine + ", " + row.quantity;
    if (!std::isfinite(row.seconds) || !seen.insert(name).second) continue;
    Curve curve;
    curve.name = name;
    curve.marks = true;
    curve.line = row.table != "steps";
    std::vector<std::pair<int, double>> points;
    for (const PeerRow& other : rows)
      if (other.table == row.table && other.engine == row.engine && other.quantity == row.quantity)
        points.emplace_back(other.nv, 1e6 * other.seconds);
    std::sort(points.begin(), points.end());
    for (const auto& [nv, time] : points) curve.add(nv, time);
    chart.curves.push_back(curve);
  }
  open_metrics(file, std::ios::trunc) << svg(chart);
}

int run(int argc, char** argv) {
  Arguments arguments;
  PeerOptions& options = arguments.options;
  options.scenes = COUNTERPOINT_SOURCE_DIR "/data/scenes";
  CLI::App app("Counterpoint beside MuJoCo and Pinocchio, on the same models in turn");
  app.add_option("--robots", options.robots, "Folder below which URDFs of robots are looked for");
  app.add_option("--tables", arguments.tables,
                 "algorithms, steps, scale (these by default), derivatives, piles, robots, "
                 "softness (piles, robots and known scenes, ours as soft as MuJoCo)")
      ->check(CLI::IsMember(table_names()))
      ->delimiter(',');
  app.add_option("--rounds", options.rounds, "Rounds of algorithms (default 21)");
  app.add_option("--step-rounds", options.step_rounds, "Rounds of trajectories (default 5)");
  app.add_option("--duration", options.duration, "Longest trajectory [s] (default 2)");
  app.add_option("--robot-count", options.robot_count,
                 "Robots in a table at most (default 25; MuJoCo refuses some)");
  app.add_option(
      "--limit", options.limit,
      "Seconds an engine may take for the trajectory of a pile or robot before it is cut "
      "short (default 60)");
  app.add_option("--csv", arguments.csv, "Write every figure to this file");
  app.add_option("--svg", arguments.svg, "Draw time over velocities into this file");
  app.footer(
      "Example:\n  counterpoint_bench_peers --tables piles,robots --robots ~/robots --csv "
      "out/piles.csv");
  CLI11_PARSE(app, argc, argv);

  const auto named = [](const std::string& version) {
    return version.empty() ? "not found when this was built" : version;
  };
  fmt::print("Counterpoint: {}\nPinocchio: {}\nMuJoCo: {}\n", COUNTERPOINT_FLAGS,
             named(peers::pinocchio_version()), named(peers::mujoco_version()));
  PeerTable metrics(arguments.csv);
  for (const std::string& table : arguments.tables) kTables.at(table)(options, metrics);
  if (!arguments.svg.empty()) write_svg(arguments.svg, metrics.rows());
  return 0;
}

}  // namespace
}  // namespace counterpoint::apps

int main(int argc, char** argv) {
  try {
    return counterpoint::apps::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "failed: {}\n", error.what());
    return 1;
  }
}
