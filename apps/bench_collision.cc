// Time of every pair function, near contact, of the broad phase, and of a large scene.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "counterpoint/collision/broadphase.h"
#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/pair_contacts.h"
#include "counterpoint/model/mesh.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {
namespace {

// Of 64 points on an ellipsoid.
std::shared_ptr<const ConvexMesh> hull() {
  constexpr int kPoints = 64;
  std::vector<Vector3> points;
  for (int i = 0; i < kPoints; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kPoints;
    const double angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    points.emplace_back(0.4 * r * std::cos(angle), 0.3 * r * std::sin(angle), 0.35 * z);
  }
  return make_convex_hull(points, "benchmark");
}

Shape make_shape(ShapeType type) {
  switch (type) {
    case ShapeType::kSphere: return {type, Vector3(0.4, 0, 0), nullptr};
    case ShapeType::kBox: return {type, Vector3(0.3, 0.5, 0.2), nullptr};
    case ShapeType::kCapsule:
    case ShapeType::kCylinder: return {type, Vector3(0.2, 0.4, 0), nullptr};
    case ShapeType::kConvexMesh: return {type, Vector3::Zero(), hull()};
    case ShapeType::kPlane: break;
  }
  return {ShapeType::kPlane, Vector3::Zero(), nullptr};
}

const char* name(ShapeType type) {
  constexpr const char* kNames[] = {"plane", "sphere", "box", "capsule", "cylinder", "mesh"};
  return kNames[static_cast<int>(type)];
}

// Random attitudes, moved along the centre line until the least gap is `gap`.
void pair(benchmark::State& state, ShapeType type_a, ShapeType type_b, double gap) {
  const Shape a = make_shape(type_a);
  const Shape b = make_shape(type_b);
  std::mt19937 rng(1);
  std::normal_distribution<double> normal;
  std::vector<std::pair<Pose, Pose>> poses;
  collision::Manifold m;
  for (int i = 0; i < 256; ++i) {
    const auto turn = [&] {
      return Quaternion(normal(rng), normal(rng), normal(rng), normal(rng))
          .normalized()
          .toRotationMatrix();
    };
    Pose X_A{type_a == ShapeType::kPlane ? Matrix3(Matrix3::Identity()) : turn(), Vector3::Zero()};
    const Vector3 way =
        type_a == ShapeType::kPlane
            ? Vector3(Vector3::UnitZ())
            : Vector3(Vector3(normal(rng), normal(rng), normal(rng)).normalized());
    Pose X_B{turn(), 0.5 * way};
    for (int k = 0; k < 60; ++k) {
      collision::pair_contacts(a, X_A, b, X_B, 10.0, m);
      double least = 10.0;
      for (int c = 0; c < m.size; ++c) least = std::min(least, m.points[c].gap);
      X_B.translation += 0.7 * (gap - least) * way;
    }
    poses.emplace_back(X_A, X_B);
  }
  std::size_t i = 0;
  for (auto _ : state) {
    const auto& [X_A, X_B] = poses[i++ & 255];
    collision::pair_contacts(a, X_A, b, X_B, 1e-2, m);
    benchmark::DoNotOptimize(m);
  }
}

// A heap of boxes on a plane, about three contacts' reach each.
void heap(benchmark::State& state) {
  const int side = static_cast<int>(state.range(0));
  ModelBuilder builder;
  builder.add_environment("ground", make_shape(ShapeType::kPlane), Pose{}, Material{});
  RobotSpec robot;
  robot.name = "box";
  LinkSpec link;
  link.name = "body";
  link.inertia = {1.0, Vector3::Zero(), Matrix3::Identity()};
  LinkSpec::Collision box;
  box.shape = {ShapeType::kBox, Vector3::Constant(0.1), nullptr};
  link.collisions.push_back(box);
  robot.links.push_back(link);
  std::vector<Pose> X_WB(1);
  for (int i = 0; i < side * side * side; ++i) {
    X_WB.push_back({Matrix3::Identity(), 0.2 * Vector3(i % side, i / side % side,
                                                       i / (side * side) + 0.5)});
    builder.add_robot(robot, Base::kFloating, X_WB.back(), std::to_string(i) + "/");
  }
  const Model model = builder.build();
  collision::Collider collider(model);
  const std::vector<double> margin(X_WB.size(), 1e-3);
  std::vector<collision::Candidate> out;
  for (auto _ : state) collider.compute_candidates(X_WB, margin, out);
  state.counters["boxes"] = side * side * side;
  state.counters["candidates"] = static_cast<double>(out.size());
}

// Boxes of 0.2 m in a cubic grid, or in one column, that move a little every step.
void broadphase(benchmark::State& state, collision::Broadphase::Method method, bool column) {
  const int size = static_cast<int>(state.range(0));
  const int side = column ? 1 : static_cast<int>(std::lround(std::cbrt(size)));
  std::mt19937 rng(1);
  std::normal_distribution<double> normal(0.0, 1e-2);
  std::vector<Vector3> velocity(size);
  for (Vector3& v : velocity) v = Vector3(normal(rng), normal(rng), normal(rng));
  std::vector<collision::Bounds> boxes(size);
  std::vector<std::pair<int, int>> pairs;
  collision::Broadphase phase(method);
  int step = 0;
  for (auto _ : state) {
    const double phase_of_motion = std::sin(0.2 * step++);
    for (int i = 0; i < size; ++i) {
      const Vector3 center = 0.2 * Vector3(i % side, i / side % side, i / (side * side)) +
                             phase_of_motion * velocity[i];
      boxes[i] = {center.array() - 0.101, center.array() + 0.101};
    }
    phase.find_pairs(boxes, pairs);
  }
  state.counters["pairs"] = static_cast<double>(pairs.size());
}

void register_broadphase() {
  using Method = collision::Broadphase::Method;
  for (const bool column : {false, true}) {
    for (const Method method : {Method::kAutomatic, Method::kSweep, Method::kTree}) {
      constexpr const char* kNames[] = {"automatic", "sweep", "tree"};
      const std::string name = std::string("broadphase/") + (column ? "pile/" : "grid/") +
                               kNames[static_cast<int>(method)];
      benchmark::RegisterBenchmark(name.c_str(), broadphase, method, column)
          ->Arg(8)->Arg(125)->Arg(1000)->Arg(10648);
    }
  }
}

}  // namespace
}  // namespace counterpoint

int main(int argc, char** argv) {
  using counterpoint::ShapeType;
  const ShapeType types[] = {ShapeType::kPlane, ShapeType::kSphere, ShapeType::kBox,
                             ShapeType::kCapsule, ShapeType::kCylinder,
                             ShapeType::kConvexMesh};
  for (int i = 0; i < 6; ++i) {
    for (int j = std::max(i, 1); j < 6; ++j) {
      for (const double gap : {-1e-3, 1e-3}) {
        const std::string name = std::string(counterpoint::name(types[i])) + "/" +
                                 counterpoint::name(types[j]) + (gap < 0 ? "/overlap" : "/gap");
        benchmark::RegisterBenchmark(name.c_str(), counterpoint::pair, types[i], types[j], gap);
      }
    }
  }
  benchmark::RegisterBenchmark("heap", counterpoint::heap)->Arg(5)->Arg(10)->Arg(21);
  counterpoint::register_broadphase();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
