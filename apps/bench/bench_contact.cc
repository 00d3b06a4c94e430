// Microseconds of the linear algebra of a Newton step of the contact solver: loading an island,
// assembling and factoring M + J'GJ, solving, products with J and M. Usage:
// counterpoint_bench_contact [--benchmark_filter=REGEX]; all benchmarks are registered in main.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "counterpoint/contact/solve/island_system.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

/// The contact problem of a scene's step at `time`.
contact::Problem scene_problem(const std::string& name, double time) {
  const Scene scene =
      load_scene(fs::path(COUNTERPOINT_SOURCE_DIR) / "data/scenes" / (name + ".yaml"));
  Workspace workspace(scene.model);
  Simulator simulator(scene);
  simulator.options().effects.set(Effect::kSleeping, false);
  while (simulator.state().time < time) simulator.step();
  State next = simulator.state();
  step_forward(scene.model, simulator.options(), contact::Settings{}, simulator.state(),
               Input{VectorX::Zero(scene.model.nv()), {}}, workspace, next);
  return workspace.impl().solution.problem;
}

double signed_unit(std::mt19937& random) {
  return 2.0 * static_cast<double>(random()) / 4294967295.0 - 1.0;
}

/// Adds a contact with random normal and point on one or two free bodies.
void add_contact(std::mt19937& random, int a, int b, contact::Problem& problem) {
  contact::Law law;
  law.type = contact::LawType::kFrictionCone;
  law.rows = 3;
  law.coulomb = true;
  law.regularizer = 1e-6;
  law.friction[0] = law.friction[1] = 0.5;
  const int c = problem.add_constraint(law, a, b);
  for (int side = 0; side < (b < 0 ? 1 : 2); ++side) {
    auto jacobian = problem.jacobian(c, side);
    for (int i = 0; i < jacobian.size(); ++i) jacobian.data()[i] = signed_unit(random);
  }
}

/// side^3 bodies on a lattice with about four contacts per body, as in a pile of boxes and balls.
contact::Problem pile(int side) {
  std::mt19937 random(1);
  contact::Problem problem;
  const int count = side * side * side;
  for (int i = 0; i < count; ++i) {
    const int b = problem.add_block(6);
    problem.mass(b).setZero();
    problem.mass(b).diagonal() << 1.0, 1.0, 1.0, 0.01, 0.012, 0.014;
  }
  for (int i = 0; i < count; ++i) {
    const int x = i % side, y = i / side % side, z = i / (side * side);
    const auto touch = [&](int j) {
      for (unsigned k = 0; k < 1 + random() % 2; ++k) add_contact(random, i, j, problem);
    };
    touch(z > 0 ? i - side * side : -1);
    if (x > 0) touch(i - 1);
    if (y > 0) touch(i - side);
  }
  problem.free_velocity().setZero();
  return problem;
}

struct Island {
  contact::Problem problem;
  std::vector<int> blocks, constraints;
  contact::IslandSystem system;
  std::vector<double> hessian, symmetric, w, y, momentum;

  explicit Island(contact::Problem given) : problem(std::move(given)) {
    blocks.resize(problem.num_blocks());
    constraints.resize(problem.num_constraints());
    std::iota(blocks.begin(), blocks.end(), 0);
    std::iota(constraints.begin(), constraints.end(), 0);
    load();
    w.assign(system.size(), 1.0);
    momentum = w;
    y.assign(system.num_rows(), 1.0);
    hessian.resize(system.hessian_size());
    for (const auto& c : system.constraints()) {
      const int n = c.law.rows;
      for (int i = 0; i < n * n; ++i)
        hessian[c.hessian + i] = 1e3 / c.inverse_mass * (i % (n + 1) == 0 ? 1.0 : 0.1);
    }
    symmetric = hessian;
    for (const auto& c : system.constraints())
      if (c.law.rows > 1) hessian[c.hessian + 1] *= -1.0;
  }
  void load() { system.load(problem, blocks, constraints, contact::Factorization::kAutomatic); }
};

template <class Work>
void add(const std::string& problem, const char* what, const std::shared_ptr<Island>& island,
         Work work) {
  benchmark::RegisterBenchmark(fmt::format("{}/{}", problem, what).c_str(),
                               [island, work](benchmark::State& run) {
                                 for (auto _ : run) {
                                   work(*island);
                                   benchmark::ClobberMemory();
                                 }
                                 run.counters["nv"] = island->system.size();
                                 run.counters["rows"] = island->system.num_rows();
                               })
      ->Unit(benchmark::kMicrosecond);
}

void register_problem(const std::string& name, contact::Problem problem) {
  const auto island = std::make_shared<Island>(std::move(problem));
  add(name, "load", island, [](Island& i) { i.load(); });
  add(name, "two_loads_changed", island, [](Island& i) {
    for (int k = 0; k < 2; ++k) {  // a new structure each time; the second restores the first
      std::swap(i.constraints.front(), i.constraints.back());
      i.load();
    }
  });
  add(name, "cholesky", island, [](Island& i) {
    if (!i.system.factor(i.symmetric.data(), false)) throw std::runtime_error("not definite");
  });
  add(name, "lu", island, [](Island& i) {
    if (!i.system.factor(i.hessian.data(), true)) throw std::runtime_error("singular");
  });
  add(name, "solve", island, [](Island& i) {
    std::fill(i.w.begin(), i.w.end(), 1.0);
    i.system.solve(i.w.data());
  });
  add(name, "products", island, [](Island& i) {
    i.system.multiply_jacobian(i.w.data(), i.y.data());
    std::fill(i.w.begin(), i.w.end(), 1.0);
    i.system.add_impulse(i.y.data(), i.w.data());
  });
  add(name, "mass", island,
      [](Island& i) { i.system.multiply_mass(i.w.data(), i.momentum.data()); });
}

void register_all() {
  register_problem("humanoid_landing", scene_problem("humanoid_drop", 0.5));
  register_problem("humanoid_fallen", scene_problem("humanoid_drop", 1.9));
  register_problem("quadruped", scene_problem("quadruped_drop", 1.0));
  register_problem("pyramid_5", scene_problem("pyramid_5", 0.2));
  register_problem("pile_64", pile(4));
  register_problem("pile_216", pile(6));
  register_problem("pile_1000", pile(10));
}

}  // namespace
}  // namespace counterpoint::apps

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  try {
    counterpoint::apps::register_all();
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    fmt::print(stderr, "failed: {}\n", error.what());
    return 1;
  }
  benchmark::Shutdown();
  return 0;
}
