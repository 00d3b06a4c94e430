// Steps forward and inverse compared with MuJoCo's mj_step and mj_inverse: each engine along its
// own trajectory of the same scene, in turns of a few steps.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "runners.h"

namespace counterpoint::apps {
namespace {

/// Scene of `count` of our robots, in rows of at most ten: place(row, size) returns the position of
/// a row. The ground has the robots' friction, so that MuJoCo can choose pairs without an explicit
/// list of all of them.
template <class Place>
Scene many(const PeerOptions& options, const std::string& robot, double friction, int count,
           Place place) {
  const std::string urdf = (options.scenes / ".." / "robots" / robot).lexically_normal().string();
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("counterpoint_bench_{}.yaml", getpid());
  {
    std::ofstream out(file);
    out << fmt::format("time_step: 0.002\nduration: 2\nground: {{friction: {}}}\nmodels:\n",
                       friction);
    for (int row = 0; row * 10 < count; ++row)
      out << fmt::format("  - {{urdf: {}, name: row{}_, base: floating, {}}}\n", urdf, row,
                         place(row, std::min(10, count - 10 * row)));
  }
  Scene scene = load_scene(file);
  std::filesystem::remove(file);
  return scene;
}

Scene humanoids(const PeerOptions& options, int count) {
  return many(options, "humanoid.urdf", 0.8, count, [](int row, int size) {
    return fmt::format("position: [0, {}, 0.96], count: {}, spacing: [2, 0, 0]", 2 * row, size);
  });
}

/// Columns of ten boxes.
Scene boxes(const PeerOptions& options, int count) {
  return many(options, "cube.urdf", 0.5, count, [](int row, int size) {
    const int line = row / 16;
    return fmt::format("position: [{:.1f}, {:.1f}, 0.101], count: {}, spacing: [0, 0, 0.201]",
                       0.4 * (row % 16), 0.4 * line, size);
  });
}

}  // namespace

void compare_steps(const PeerOptions& options, PeerTable& table) {
  for (const std::string& name : kKnownScenes) {
    const Scene scene = load_scene(options.scenes / (name + ".yaml"));
    try_scene(scene, {"steps", name, steps_of(scene, options), options.step_rounds}, table);
  }
  for (const char* name : {"anymal.urdf", "solo12.urdf", "go2.urdf"}) {
    const std::filesystem::path urdf = find_robot(options, name);
    if (urdf.empty()) continue;
    const Scene scene = dropped(urdf);
    try_scene(scene, {"steps", urdf.stem().string(), steps_of(scene, options), options.step_rounds},
              table);
  }
}

namespace {

/// Steps our engine in all sizes in turns of a few steps: seconds per robot, and the ratio to the
/// first size.
void compare_sizes(const char* what, const std::vector<int>& counts, int steps,
                   Scene make(const PeerOptions&, int), const PeerOptions& options,
                   PeerTable& table) {
  Runners runners;
  for (const int count : counts) runners.push_back(our_runner(make(options, count)));
  const Timing timing = time_rounds(runners, steps, options.step_rounds,
                                    [](Runner& runner, int, int count) { runner.steps(count); });
  for (std::size_t i = 0; i < runners.size(); ++i)
    table.add({"growth", fmt::format("{} {}", counts[i], what), "step of one", runners[i]->name(),
               timing.seconds[i] / counts[i], 1.0, "over the first",
               timing.ratio[i] * counts[0] / counts[i], 0, ""});
}

}  // namespace

void compare_scale(const PeerOptions& options, PeerTable& table) {
  const auto rounds = [&](int count, int few) { return count < few ? options.step_rounds : 1; };
  const std::vector<int> humanoid_counts = {1, 4, 22, 100, 300, 1000};
  const std::vector<int> box_counts = {100, 400, 1000, 4000, 10000};
  compare_sizes("humanoids", humanoid_counts, 250, humanoids, options, table);
  compare_sizes("boxes", box_counts, 50, boxes, options, table);
  for (const int count : humanoid_counts)
    try_scene(humanoids(options, count),
              {"scale", fmt::format("{} humanoids", count), 250, rounds(count, 100)}, table);
  for (const int count : box_counts)
    try_scene(boxes(options, count),
              {"scale", fmt::format("{} boxes", count), 50, rounds(count, 1000)}, table);
}

}  // namespace counterpoint::apps
