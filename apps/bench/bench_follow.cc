// Milliseconds per row of following a recording in a window of 30 rows, on one core: robots that
// drop, 100 rows per second, noise of 1 mm and 1 mrad. Usage: counterpoint_bench_follow
// [--benchmark_filter=REGEX]
#include <benchmark/benchmark.h>

#include <random>
#include <string>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/motion_follower.h"
#include "counterpoint/engine/simulator.h"

namespace counterpoint::apps {
namespace {

constexpr int kRows = 150;
constexpr double kInterval = 0.01, kNoise = 1e-3;  ///< [s], [m, rad]

std::vector<VectorX> noisy_rows(const Scene& scene) {
  Simulator simulator(scene);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<VectorX> rows;
  VectorX by(scene.model.nv()), q(scene.model.nq());
  for (int row = 0; row < kRows; ++row) {
    for (double& x : by) x = kNoise * normal(random);
    integrate_configuration(scene.model, simulator.state().q, by, 1.0, q);
    rows.push_back(q);
    while (simulator.state().time < (row + 1) * kInterval - 1e-9) simulator.step();
  }
  return rows;
}

void follow(benchmark::State& state, const std::string& name) {
  const Scene scene =
      load_scene(std::string(COUNTERPOINT_SOURCE_DIR) + "/data/scenes/" + name + ".yaml");
  const std::vector<VectorX> rows = noisy_rows(scene);
  estimation::ColumnMap map;
  for (int i = 0; i < scene.model.nq(); ++i)
    map.entries.push_back({estimation::ColumnMap::Entry::Kind::kPosition, i, "q", {"q", 1.0, 0.0}});
  estimation::FollowOptions options;
  options.errors = estimation::RecordingErrors::kWhite;
  for (auto _ : state) {
    state.PauseTiming();
    estimation::MotionFollower follower(scene, map, options);
    for (int row = 0; row < estimation::kFollowedRows; ++row)
      follower.push(row * kInterval, rows[static_cast<std::size_t>(row)]);
    state.ResumeTiming();
    for (int row = estimation::kFollowedRows; row < kRows; ++row)
      follower.push(row * kInterval, rows[static_cast<std::size_t>(row)]);
  }
  state.counters["rows_per_second"] = benchmark::Counter(
      kRows - estimation::kFollowedRows, benchmark::Counter::kIsIterationInvariantRate);
}

}  // namespace
}  // namespace counterpoint::apps

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  for (const char* name : {"quadruped_drop", "humanoid_drop"})
    benchmark::RegisterBenchmark(name, [=](benchmark::State& state) {
      counterpoint::apps::follow(state, name);
    })->Unit(benchmark::kMillisecond);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
