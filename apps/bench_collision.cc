// Time of every pair function, near contact, and of a large scene.
#include <benchmark/benchmark.h>

#include <random>
#include <string>

#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/pair_contacts.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {
namespace {

Shape make_shape(ShapeType type) {
  switch (type) {
    case ShapeType::kSphere: return {type, Vector3(0.4, 0, 0), nullptr};
    case ShapeType::kBox: return {type, Vector3(0.3, 0.5, 0.2), nullptr};
    case ShapeType::kCapsule:
    case ShapeType::kCylinder: return {type, Vector3(0.2, 0.4, 0), nullptr};
    case ShapeType::kPlane:
    case ShapeType::kConvexMesh: break;
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

}  // namespace
}  // namespace counterpoint

int main(int argc, char** argv) {
  using counterpoint::ShapeType;
  const ShapeType types[] = {ShapeType::kPlane, ShapeType::kSphere, ShapeType::kBox,
                             ShapeType::kCapsule, ShapeType::kCylinder};
  for (int i = 0; i < 5; ++i) {
    for (int j = std::max(i, 1); j < 5; ++j) {
      for (const double gap : {-1e-3, 1e-3}) {
        const std::string name = std::string(counterpoint::name(types[i])) + "/" +
                                 counterpoint::name(types[j]) + (gap < 0 ? "/overlap" : "/gap");
        benchmark::RegisterBenchmark(name.c_str(), counterpoint::pair, types[i], types[j], gap);
      }
    }
  }
  benchmark::RegisterBenchmark("heap", counterpoint::heap)->Arg(5)->Arg(10)->Arg(21);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
