// Time of every pair function near contact, compared with FCL's, and of a large scene.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model_builder.h"
#include "support/fcl_shapes.h"
#include "support/sphere_points.h"

namespace counterpoint {
namespace {

// Convex hull of points on an ellipsoid.
Shape hull(int num_points) {
  std::vector<Vector3> points = test::sphere_points(num_points);
  for (Vector3& p : points) p = p.cwiseProduct(Vector3(0.4, 0.3, 0.35));
  return {ShapeType::kConvexMesh, Vector3::Zero(), make_convex_hull(points, "benchmark")};
}

Shape plane() { return {ShapeType::kPlane, Vector3::Zero(), nullptr}; }

struct Named {
  std::string name;
  Shape shape;
};

std::vector<Named> shapes() {
  return {{"plane", plane()},
          {"sphere", {ShapeType::kSphere, Vector3(0.4, 0, 0), nullptr}},
          {"box", {ShapeType::kBox, Vector3(0.3, 0.5, 0.2), nullptr}},
          {"capsule", {ShapeType::kCapsule, Vector3(0.2, 0.4, 0), nullptr}},
          {"cylinder", {ShapeType::kCylinder, Vector3(0.2, 0.4, 0), nullptr}},
          {"hull32", hull(32)},
          {"hull64", hull(64)}};
}

using Poses = std::vector<std::pair<Pose, Pose>>;

// Draws random attitudes and moves the shapes along the centre line until the least gap is `gap`.
Poses draw_poses(const Shape& a, const Shape& b, double gap) {
  std::mt19937 rng(1);
  std::normal_distribution<double> normal;
  Poses poses;
  collision::Manifold m;
  for (int i = 0; i < 256; ++i) {
    const auto turn = [&] {
      return Quaternion(normal(rng), normal(rng), normal(rng), normal(rng))
          .normalized()
          .toRotationMatrix();
    };
    const bool on_plane = a.type == ShapeType::kPlane;
    Pose X_A{on_plane ? Matrix3(Matrix3::Identity()) : turn(), Vector3::Zero()};
    const Vector3 way = on_plane
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
  return poses;
}

// Sets the same counters for every benchmark: comma-separated output has a single table.
void count(benchmark::State& state, double boxes, double points) {
  state.counters["boxes"] = boxes;
  state.counters["points"] = points;
}

// Times the search for all contact points within 1 cm.
void pair(benchmark::State& state, const Shape& a, const Shape& b, double gap) {
  const Poses poses = draw_poses(a, b, gap);
  collision::Manifold m;
  std::size_t i = 0;
  for (auto _ : state) {
    const auto& [X_A, X_B] = poses[i++ & 255];
    collision::pair_contacts(a, X_A, b, X_B, 1e-2, m);
    benchmark::DoNotOptimize(m);
  }
  int points = 0;
  for (const auto& [X_A, X_B] : poses) {
    collision::pair_contacts(a, X_A, b, X_B, 1e-2, m);
    points += m.size;
  }
  count(state, 0, static_cast<double>(points) / static_cast<double>(poses.size()));
}

// Times FCL at its defaults: the distance of separated shapes, up to four contacts of overlapping
// ones.
void fcl_pair(benchmark::State& state, const Shape& a, const Shape& b, double gap) {
  const Poses poses = draw_poses(a, b, gap);
  std::vector<std::pair<fcl::Transform3d, fcl::Transform3d>> placed;
  for (const auto& [X_A, X_B] : poses)
    placed.emplace_back(test::fcl_pose(X_A), test::fcl_pose(X_B));
  const auto fcl_a = test::fcl_geometry(a);
  const auto fcl_b = test::fcl_geometry(b);
  std::size_t i = 0;
  std::size_t points = 0;
  for (auto _ : state) {
    const auto& [T_A, T_B] = placed[i++ & 255];
    if (gap > 0.0) {
      fcl::DistanceResultd result;
      fcl::distance(fcl_a.get(), T_A, fcl_b.get(), T_B, fcl::DistanceRequestd(true), result);
      benchmark::DoNotOptimize(result);
      ++points;
    } else {
      fcl::CollisionResultd result;
      fcl::collide(fcl_a.get(), T_A, fcl_b.get(), T_B, fcl::CollisionRequestd(4, true), result);
      benchmark::DoNotOptimize(result);
      points += result.numContacts();
    }
  }
  count(state, 0, static_cast<double>(points) / static_cast<double>(state.iterations()));
}

void register_pairs() {
  const std::vector<Named> all = shapes();
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t j = std::max<std::size_t>(i, 1); j < all.size(); ++j) {
      for (const double gap : {-1e-3, 1e-3}) {
        const std::string name =
            all[i].name + "/" + all[j].name + (gap < 0.0 ? "/overlap" : "/gap");
        benchmark::RegisterBenchmark(name.c_str(), pair, all[i].shape, all[j].shape, gap);
        // FCL's distance of a half-space from some shapes crashes.
        if (i == 0 && gap > 0.0) continue;
        benchmark::RegisterBenchmark((name + "/fcl").c_str(), fcl_pair, all[i].shape, all[j].shape,
                                     gap);
      }
    }
  }
}

// Times the collider on a heap of touching boxes on a plane.
void heap(benchmark::State& state) {
  const int side = static_cast<int>(state.range(0));
  ModelBuilder builder;
  builder.add_environment("ground", plane(), Pose{}, Material{});
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
    const int row = i / side, floor = row / side;
    X_WB.push_back({Matrix3::Identity(), 0.2 * Vector3(i % side, row % side, floor + 0.5)});
    builder.add_robot(robot, Base::kFloating, X_WB.back(), std::to_string(i) + "/");
  }
  const Model model = builder.build();
  collision::Collider collider(model);
  const std::vector<double> margin(X_WB.size(), 1e-3);
  std::vector<collision::Candidate> out;
  for (auto _ : state) collider.compute_candidates(X_WB, margin, out);
  count(state, side * side * side, static_cast<double>(out.size()));
}

}  // namespace
}  // namespace counterpoint

int main(int argc, char** argv) {
  counterpoint::register_pairs();
  benchmark::RegisterBenchmark("heap", counterpoint::heap)->Arg(5)->Arg(10)->Arg(21);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
