// Impacts, fast bodies, bodies inside each other.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "trial.h"

namespace counterpoint::apps {
namespace {

void bouncing(Trial& trial) {
  Runner& sim = trial.load("bouncing");
  const double e = 0.8, height = 1.0, radius = 0.1;
  std::vector<double> peaks;
  double last_speed = -1.0, stopped = -1.0;
  trial.plot("height of the ball above the ground [m]");
  trial.run(sim, 5.0, [&](const Runner& s) {
    const double speed = s.state().v[2];
    if (last_speed > 0.0 && speed <= 0.0) peaks.push_back(s.state().q[2] - radius);
    last_speed = speed;
    if (std::abs(speed) > 1e-3) stopped = s.state().time;
    trial.draw(s, s.state().q[2] - radius);
  });
  // An impact happens up to a step early, from a gap of up to h v. Each changes the height by up to
  // h v, v = sqrt(2 g h_n), and thereby all later ones.
  double off = 0.0;
  for (int n = 1; n <= 5; ++n) {
    const double known = std::pow(e, 2 * n) * height;
    const bool there = peaks.size() >= static_cast<std::size_t>(n);
    const double peak = there ? peaks[static_cast<std::size_t>(n) - 1] : 0.0;
    trial.chart.levels.push_back({fmt::format("e^{} H", 2 * n), known});
    off = std::max(off, std::abs(peak - known) / known);
  }
  trial.at_most("heights 1 ... 5 off e^(2n) H, relative", "1", off, 0.01,
                "Newton's restitution; 1 % is what steps of 0.5 ms allow");
  const double time = std::sqrt(2.0 * height / kCaseGravity) * (1.0 + e) / (1.0 - e);
  trial.equal("comes to rest at", "s", stopped, time, 0.01 * time, "sqrt(2H/g)(1+e)/(1-e)");
}

void overlap(Trial& trial) {
  Runner& sim = trial.load("overlap");
  double fastest = 0.0, apart = 0.0;
  trial.plot("gap between the boxes [m]");
  trial.run(sim, 1.0, [&](const Runner& s) {
    fastest = std::max(fastest, s.state().v[6] - s.state().v[0]);
    apart = s.state().q[7] - s.state().q[0] - 0.2;
    trial.draw(s, apart);
  });
  trial.chart.levels = {{"touching", 0.0}};
  trial.at_least("gap at the end", "m", apart, -1e-6, "they part");
  trial.at_most("speed of parting, largest", "m/s", fastest,
                sim.options().contact.max_recovery_speed * (1.0 + 1e-6),
                "docs/reference/scene-format.md: max_recovery_speed");
  View view(sim);
  trial.at_most("energy at the end", "J", view.kinetic(), 1e-6, "an overlap is no spring: 0");
}

void fast_thin(Trial& trial) {
  Runner& sim = trial.load("fast_thin");
  double deepest = -1e9;
  trial.plot("x of the farthest centre [m]");
  trial.run(sim, 0.5, [&](const Runner& s) {
    double x = -1e9;
    for (int i = 1; i < s.model().num_bodies(); ++i)
      x = std::max(x, s.state().q[s.model().body(i).q_index]);
    deepest = std::max(deepest, x);
    trial.draw(s, x);
  });
  trial.chart.levels = {{"front of the wall", -0.0005}};
  // The bound is half the thickness of the plate, the thinner body.
  trial.at_most("farthest centre, behind the wall's front", "m", deepest + 0.0005, 0.0,
                "a wall is a wall; up to 0.6 m a step against 1 mm");
  View view(sim);
  const double energy = 0.5 * (0.001 + 0.01) * (30.0 * 30.0 + 100.0 * 100.0 + 300.0 * 300.0);
  trial.at_most("kinetic energy at the end over that at the start", "1", view.kinetic() / energy,
                1.0 + 1e-9, "energy");
}

void rolling_box(Trial& trial) {
  Runner& sim = trial.load("rolling_box");
  const int box = v_of(sim.model(), "box/body");
  sim.input().applied_force[box] = 150.0 * std::sqrt(0.5);
  sim.input().applied_force[box + 1] = 150.0 * std::sqrt(0.5);
  View view(sim);
  const double time = 4.0;
  trial.plot("speed [m/s]", {}, {"box", "a ball"});
  trial.run(sim, time, [&](const Runner& s) {
    view.look();
    trial.draw(s, view.velocity(1).norm());
    trial.draw(s, view.velocity(2).norm(), 1);
  });
  // Balance: F - mu (M + n m) g = (M + 2/7 n m) a; a ball rolling on a plate accelerates at 2/7 of
  // the plate's rate.
  const double a = (150.0 - 0.4 * 35.0 * kCaseGravity) / (10.0 + 25.0 * 2.0 / 7.0);
  double off = 0.0;
  for (int i = 2; i <= 26; ++i)
    off = std::max(off, std::abs(view.velocity(i).norm() / time - 2.0 / 7.0 * a));
  trial.chart.levels = {{"0.7385 t", a * time}, {"0.2110 t", 2.0 / 7.0 * a * time}};
  trial.equal("acceleration of the box", "m/s^2", view.velocity(1).norm() / time, a, 1e-4,
              "SimBenchmark (Kang, Hwangbo 2018), rolling: 0.7385");
  trial.at_most("balls off 0.2110 m/s^2, largest", "m/s^2", off, 1e-4,
                "SimBenchmark, rolling: 2/7 of the box's");
}

/// Speeds of the five balls after all impacts.
void cradle(Trial& trial, const char* scene, bool apart) {
  Runner& sim = trial.load(scene);
  trial.chart.y_label = "speed [m/s]";
  trial.chart.curves.resize(5);
  for (std::size_t i = 0; i < 5; ++i) trial.chart.curves[i].name = fmt::format("ball {}", i + 1);
  trial.run(sim, 1.0, [&](const Runner& s) {
    for (std::size_t i = 0; i < 5; ++i)
      trial.chart.curves[i].add(s.state().time, s.state().v[static_cast<int>(6 * i)]);
  });
  const VectorX& v = sim.state().v;
  const double momentum = v[0] + v[6] + v[12] + v[18] + v[24];
  // An impact is solved to the round-off of velocities, 1.1e-16 m/s, divided by the compliance of
  // 1e-6.
  trial.equal("momentum", "kg m/s", momentum, 1.0, 1e-10, "Newton's third law");
  View view(sim);
  trial.at_most("kinetic energy", "J", view.kinetic(), 0.5 + 1e-9, "restitution gains none");
  if (apart) {
    trial.equal("last ball", "m/s", v[24], 1.0, 1e-5,
                "impacts one after the other: each pair swaps its velocities; compliance: some eps "
                "= 1e-6 an impact");
  }
  trial.remark = fmt::format("Velocities after: {:.4f}, {:.4f}, {:.4f}, {:.4f}, {:.4f} m/s.", v[0],
                             v[6], v[12], v[18], v[24]);
  if (!apart) {
    trial.remark +=
        " Newton's law of restitution, each pair by itself and all in one step: a pair that does "
        "not approach before the impact has no speed to give back.";
  }
}

}  // namespace

std::vector<HardCase> impact_cases() {
  return {
      {"bouncing", "Ever more impacts in a finite time (Zeno); each adds its error to the next.",
       bouncing},
      {"overlap", "Bodies that start inside each other are thrown apart by penalty forces.",
       overlap},
      {"fast_thin", "A body crosses six hundred times its wall in one step.", fast_thin},
      {"rolling_box", "25 balls roll on a sliding box: stick and slip at once, coupled.",
       rolling_box},
      {"cradle_touching",
       "One impact through four contacts at once: the law decides, not mechanics.",
       [](Trial& t) { cradle(t, "cradle_touching", false); }},
      {"cradle_apart", "The same balls with air between them: mechanics decides.",
       [](Trial& t) { cradle(t, "cradle_apart", true); }},
  };
}

}  // namespace counterpoint::apps
