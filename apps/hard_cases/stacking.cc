// Stacks and mass ratios: loads that pass through many contacts.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "trial.h"

namespace counterpoint::apps {
namespace {

void mass_ratio(Trial& trial) {
  Runner& sim = trial.load("mass_ratio");
  const Model& model = sim.model();
  const VectorX start = sim.state().q;
  trial.left_alone(sim, 9.0, "box");
  const VectorX settled = sim.state().q;
  trial.run(sim, 1.0);
  const double jitter = drift(model, sim.state().q, settled);
  // Sinking under the heaviest load: eps alpha F h^2 / (4 beta) for four contacts, times mu^2 = 1/4
  // for the friction, with alpha = 1 / m of the light box and F = 1e6 m g. The contacts below and
  // above it sink alike; 1 % for its upper side.
  const ContactOptions& options = sim.options().contact;
  const double h = sim.options().time_step;
  const double sink = 1.01 * 2.0 * 0.25 * options.compliance * 1e6 * kCaseGravity * h * h / 4.0 /
                      options.stabilization;
  trial.chart.levels = {{"what the compliance gives", sink}};
  const Forces forces = trial.step_and_recover(sim);
  View view(sim);
  const double masses[] = {1001.0, 1e6 + 1.0, 1001.0, 1e6 + 1.0};
  const char* names[] = {"1000 on 1", "1e6 on 1", "1 on 1000", "1 on 1e6"};
  for (int i = 0; i < 4; ++i) {
    const double force =
        force_between(model, forces, 0, view.body(fmt::format("below{}/body", i))).z();
    trial.equal(fmt::format("ground under {}, over its weight", names[i]), "1",
                force / (masses[i] * kCaseGravity), 1.0, 1e-6, "statics: (m1 + m2) g");
  }
  trial.at_most("sinks, the most of all", "m", drift(model, settled, start), sink,
                "docs/explanation/concepts.md: eps alpha F h^2 over beta; a rigid body: 0");
  trial.at_most("moves from 9 to 10 s", "m", jitter, 1e-9, "statics: rests");
}

void tower(Trial& trial, int n) {
  Runner& sim = trial.load(fmt::format("tower_{}", n));
  const Model& model = sim.model();
  trial.chart.levels = {{"1e-6 m", 1e-6}};
  const double most = trial.left_alone(sim, 10.0, "box");
  const Forces forces = trial.step_and_recover(sim);
  double error = 0.0;
  for (int k = 0; k < n; ++k) {
    const double known = (n - k) * kCaseGravity;
    error = std::max(error, std::abs(force_between(model, forces, k, k + 1).z() / known - 1.0));
  }
  trial.at_most("drift within 10 s, largest", "m", most, 1e-6, "stands; micrometre by agreement");
  trial.at_most("force at level k over (N - k) m g, off by", "1", error, 1e-6, "statics");
}

void pyramid(Trial& trial) {
  constexpr int kLayers = 20, kBoxes = kLayers * (kLayers + 1) / 2;
  Runner& sim = trial.load("pyramid_20");
  const Model& model = sim.model();
  trial.chart.levels = {{"1e-6 m", 1e-6}};
  const double most = trial.left_alone(sim, 10.0, "box");
  const Forces forces = trial.step_and_recover(sim);
  double ground = 0.0;
  for (int i = 1; i < model.num_bodies(); ++i) ground += force_between(model, forces, 0, i).z();
  trial.at_most("drift within 10 s, largest", "m", most, 1e-6, "stands; micrometre by agreement");
  trial.equal("ground force over the weight", "1", ground / (kBoxes * kCaseGravity), 1.0, 1e-6,
              "statics");
}

void contact_points(Trial& trial) {
  Runner& sim = trial.load("contact_points");
  const Model& model = sim.model();
  const char* names[] = {"feet_4", "feet_16", "feet_100"};
  trial.chart.y_label = "x [m]";
  trial.chart.curves.resize(3);
  for (std::size_t i = 0; i < 3; ++i) trial.chart.curves[i].name = names[i];
  View view(sim);
  trial.run(sim, 1.0, [&](const Runner& s) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int q = model.body(static_cast<int>(i) + 1).q_index;
      trial.chart.curves[i].add(s.state().time, s.state().q[q]);
    }
  });
  const Forces forces = trial.step_and_recover(sim);
  Vector3 first = Vector3::Zero();
  double apart = 0.0, weight = 0.0;
  for (int i = 0; i < 3; ++i) {
    const Vector3 p =
        sim.state().q.segment<3>(model.body(i + 1).q_index) - Vector3(0.0, 2.0 * i, 0.0);
    if (i == 0) first = p;
    apart = std::max(apart, (p - first).norm());
    weight = std::max(
        weight, std::abs(force_between(model, forces, 0, i + 1).z() / (2.0 * kCaseGravity) - 1.0));
  }
  trial.at_most("rests apart from the one on 4 feet", "m", apart, 1e-8,
                "rigid: the motion does not depend on the number of points");
  trial.at_most("sum of the forces over m g, off by", "1", weight, 1e-8, "statics");
}

}  // namespace

std::vector<HardCase> stacking_cases() {
  return {
      {"mass_ratio",
       "Iterative solvers need as many sweeps as the mass ratio is large; springs sink.",
       mass_ratio},
      {"tower_10", "Every contact carries all that is above it.", [](Trial& t) { tower(t, 10); }},
      {"tower_30", "Every contact carries all that is above it.", [](Trial& t) { tower(t, 30); }},
      {"tower_100", "A hundred levels: an error at the foot is a lean at the top.",
       [](Trial& t) { tower(t, 100); }},
      {"tower_200", "Two hundred levels, forty metres on a foot of 0.2 m.",
       [](Trial& t) { tower(t, 200); }},
      {"pyramid_20", "210 cubes, and more contacts than equations: how they share is not unique.",
       pyramid, true},
      {"contact_points", "Statically indeterminate: 100 points share what 3 could carry.",
       contact_points},
  };
}

}  // namespace counterpoint::apps
