// Time of the broad phase, alone and within the collider, for 10 to 10,000 bodies at constant
// density.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "counterpoint/collision/broadphase/broadphase.h"
#include "counterpoint/collision/collider.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {
namespace {

using Method = collision::Broadphase::Method;

struct Layout {
  const char* name;
  int dimensions;  // dimensions of the grid
  double pitch;    // between boxes of 0.2 m [m]
  int group = 1;   // boxes at each grid point, in two rows that touch
};

// Centres of the bodies, which move a little every step.
class Crowd {
 public:
  Crowd(int size, const Layout& layout) : center_(size), swing_(size) {
    const double places = std::ceil(static_cast<double>(size) / layout.group);
    const int side = static_cast<int>(std::ceil(std::pow(places, 1.0 / layout.dimensions) - 1e-9));
    std::mt19937 rng(1);
    std::normal_distribution<double> normal(0.0, 1e-2);
    for (int i = 0; i < size; ++i) {
      const int p = i / layout.group, k = i % layout.group;
      const int row = p / side, floor = row / side, pair = k / 2;
      center_[i] = layout.pitch * Vector3(p % side, row % side, floor + 5.0) +
                   0.2 * Vector3(pair, k % 2, 0.0);
      swing_[i] = Vector3(normal(rng), normal(rng), normal(rng));
    }
  }
  Vector3 at(int i, double swing) const { return center_[i] + swing * swing_[i]; }

 private:
  std::vector<Vector3> center_, swing_;
};

// Displacement factor of a step; its period of 16 steps makes the mean independent of the number of
// repetitions.
double swing_at(int step) { return std::sin(0.4 * (step % 16)); }

// Counters: time per body and time per pair.
void count(benchmark::State& state, double pairs) {
  const auto flags = benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert;
  state.counters["pairs_per_body"] = pairs / static_cast<double>(state.range(0));
  state.counters["per_body"] = benchmark::Counter(static_cast<double>(state.range(0)), flags);
  state.counters["per_pair"] = benchmark::Counter(std::max(pairs, 1.0), flags);
}

void broadphase(benchmark::State& state, Method method, Layout layout) {
  const int size = static_cast<int>(state.range(0));
  const Crowd crowd(size, layout);
  std::vector<collision::Bounds> boxes(size);
  std::vector<std::pair<int, int>> pairs;
  collision::Broadphase phase(method);
  int step = 0;
  double found = 0.0;
  for (auto _ : state) {
    const double swing = swing_at(step++);
    for (int i = 0; i < size; ++i) {
      const Vector3 c = crowd.at(i, swing);
      boxes[i] = {c.array() - 0.101, c.array() + 0.101};
    }
    phase.find_pairs(boxes, pairs);
    found += static_cast<double>(pairs.size());
  }
  count(state, found / static_cast<double>(state.iterations()));
}

// Times the whole collider with balls above a plane, at the layout's pitch close to their
// neighbours and out of the reach of the plane.
void collider(benchmark::State& state, Layout layout) {
  const int size = static_cast<int>(state.range(0));
  ModelBuilder builder;
  builder.add_environment("ground", {ShapeType::kPlane, Vector3::Zero(), nullptr}, Pose{},
                          Material{});
  RobotSpec robot;
  robot.name = "ball";
  LinkSpec link;
  link.name = "body";
  link.inertia = {1.0, Vector3::Zero(), Matrix3::Identity()};
  LinkSpec::Collision ball;
  ball.shape = {ShapeType::kSphere, Vector3(0.101, 0.0, 0.0), nullptr};
  link.collisions.push_back(ball);
  robot.links.push_back(link);
  const Crowd crowd(size, layout);
  for (int i = 0; i < size; ++i) {
    builder.add_robot(robot, Base::kFloating, {Matrix3::Identity(), crowd.at(i, 0)},
                      std::to_string(i) + "/");
  }
  const Model model = builder.build();
  std::vector<Pose> X_WB(size + 1);
  collision::Collider collider(model);
  const std::vector<double> margin(size + 1, 0.0);
  std::vector<collision::Candidate> out;
  int step = 0;
  double found = 0.0;
  for (auto _ : state) {
    const double swing = swing_at(step++);
    for (int i = 0; i < size; ++i) X_WB[i + 1].translation = crowd.at(i, swing);
    collider.compute_candidates(X_WB, margin, out);
    found += static_cast<double>(out.size());
  }
  count(state, found / static_cast<double>(state.iterations()));
}

}  // namespace
}  // namespace counterpoint

int main(int argc, char** argv) {
  using counterpoint::Layout;
  using counterpoint::Method;
  const Layout layouts[] = {{"floor", 2, 0.25},
                            {"pile", 1, 0.2},
                            {"heap", 3, 0.2},
                            // Constant number of neighbours per box.
                            {"groups", 3, 1.5, 10}};
  const std::pair<const char*, Method> methods[] = {{"automatic", Method::kAutomatic},
                                                    {"grid", Method::kGrid},
                                                    {"sweep", Method::kSweep},
                                                    {"tree", Method::kTree}};
  for (const Layout& layout : layouts) {
    for (const auto& [name, method] : methods) {
      const std::string title = std::string(layout.name) + "/" + name;
      benchmark::RegisterBenchmark(title.c_str(), counterpoint::broadphase, method, layout)
          ->Arg(10)
          ->Arg(100)
          ->Arg(1000)
          ->Arg(10000);
    }
  }
  for (const Layout& layout : layouts) {
    const std::string title = std::string(layout.name) + "/collider";
    benchmark::RegisterBenchmark(title.c_str(), counterpoint::collider, layout)
        ->Arg(10)
        ->Arg(100)
        ->Arg(1000)
        ->Arg(10000);
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
