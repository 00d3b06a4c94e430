// Time of the broad phase for 10 to 10,000 bodies at the same density.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "counterpoint/collision/broadphase.h"

namespace counterpoint {
namespace {

using Method = collision::Broadphase::Method;

struct Layout {
  const char* name;
  int dimensions;   // of the grid
  double pitch;     // of boxes of 0.2 m [m]
};

// Boxes that move a little every step; the counter is what one of them costs.
void broadphase(benchmark::State& state, Method method, Layout layout) {
  const int size = static_cast<int>(state.range(0));
  const int side = static_cast<int>(std::ceil(std::pow(size, 1.0 / layout.dimensions) - 1e-9));
  std::mt19937 rng(1);
  std::normal_distribution<double> normal(0.0, 1e-2);
  std::vector<Vector3> center(size), swing(size);
  for (int i = 0; i < size; ++i) {
    center[i] = layout.pitch * Vector3(i % side, i / side % side, i / side / side);
    swing[i] = Vector3(normal(rng), normal(rng), normal(rng));
  }
  std::vector<collision::Bounds> boxes(size);
  std::vector<std::pair<int, int>> pairs;
  collision::Broadphase phase(method);
  int step = 0;
  for (auto _ : state) {
    const double now = std::sin(0.2 * step++);
    for (int i = 0; i < size; ++i) {
      const Vector3 c = center[i] + now * swing[i];
      boxes[i] = {c.array() - 0.101, c.array() + 0.101};
    }
    phase.find_pairs(boxes, pairs);
  }
  state.counters["pairs"] = static_cast<double>(pairs.size());
  state.counters["per_body"] = benchmark::Counter(
      size, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

}  // namespace
}  // namespace counterpoint

int main(int argc, char** argv) {
  using counterpoint::Layout;
  using counterpoint::Method;
  const Layout layouts[] = {{"floor", 2, 0.25}, {"pile", 1, 0.2}, {"heap", 3, 0.2}};
  const std::pair<const char*, Method> methods[] = {
      {"automatic", Method::kAutomatic}, {"sweep", Method::kSweep}, {"tree", Method::kTree}};
  for (const Layout& layout : layouts) {
    for (const auto& [name, method] : methods) {
      const std::string title = std::string(layout.name) + "/" + name;
      benchmark::RegisterBenchmark(title.c_str(), counterpoint::broadphase, method, layout)
          ->Arg(10)->Arg(100)->Arg(1000)->Arg(10000);
    }
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
