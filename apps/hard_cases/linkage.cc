// Chains, nets, grippers, singular poses.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "trial.h"

namespace counterpoint::apps {
namespace {

void chain(Trial& trial, int n) {
  Runner& sim = trial.load(fmt::format("chain_{}", n));
  const double most = trial.left_alone(sim, sim.options().duration, "link");
  const Forces forces = trial.step_and_recover(sim);
  double error = 0.0;
  for (int k = 0; k < n; ++k) {
    const double known = (n - k) * 0.1 * kCaseGravity;
    const Vector3 tension = forces.closures[static_cast<std::size_t>(k)].force.force;
    error = std::max(error, std::abs(std::abs(tension.z()) / known - 1.0));
  }
  // Each closure yields r F h^2 / beta with r = 100 eps alpha; alpha is at most (2 + 2 * 12 / 4) /
  // m including the rotation of a rod. Summed over the links above.
  const double h = sim.options().time_step;
  const ContactOptions& options = sim.options().contact;
  const double yield = 100.0 * options.compliance * 8.0 / 0.1 * 0.1 * kCaseGravity * h * h /
                       options.stabilization * 0.5 * n * (n + 1);
  trial.chart.levels = {{"what the closures' compliance gives", yield}};
  trial.at_most("tension over the weight below, off by", "1", error, 1e-6, "statics");
  trial.at_most("sag of the end", "m", most, yield,
                "docs/explanation/concepts.md: r F h^2 / beta a closure");
}

void whip(Trial& trial) {
  Runner& sim = trial.load("whip_100");
  View view(sim);
  const double scale = 100 * 0.1 * kCaseGravity * 5.0;  // m g L / 2
  trial.plot("energy over m g L/2", {{"5 % gained", 0.05}});
  const auto [gain, off] = watch_energy(trial, sim, view, scale);
  trial.at_most("energy gained, over m g L/2", "1", gain, 0.05, "nothing drives it; 5 %");
  trial.at_most("energy off, over m g L/2", "1", off, 0.05, "nothing brakes it; 5 %");
}

void net(Trial& trial) {
  Runner& sim = trial.load("net");
  const double h = sim.options().time_step;
  trial.plot("force of the corners over the weight", {{"weight", 1.0}});
  double held = 0.0;
  View view(sim);
  const double weight = 400 * 0.05 * kCaseGravity;
  const long steps = std::lround(sim.options().duration / h);
  for (long i = 0; i < steps; ++i) {
    const Forces forces = trial.step_and_recover(sim);
    held = 0.0;
    for (std::size_t k = 0; k < forces.closures.size(); ++k) {
      if (sim.model().closures()[k].body_a == 0)
        held += std::abs(forces.closures[k].force.force.z());
    }
    trial.draw(sim, held / weight);
  }
  view.look();
  trial.equal("corners carry, over the weight", "1", held / weight, 1.0, 0.01,
              "statics, when drag has calmed it; 1 %");
  trial.at_most("closures open by, largest", "m", closures_open(sim.model(), sim.state().q), 1e-4,
                "they are closed; 0.1 mm");
  trial.at_most("kinetic energy at the end", "J", view.kinetic(), 0.1, "it comes to rest");
}

void gripper(Trial& trial) {
  Runner& sim = trial.load("gripper");
  const double mu = 0.2, mass = 10.0, force = mass * kCaseGravity / (2.0 * mu);
  const int q = q_of(sim.model(), "load/body");
  const auto squeeze = [&](double share) {
    for (const char* name : {"gripper/left_slide", "gripper/right_slide"})
      sim.input().applied_force[v_of(sim.model(), name)] = share * force;
  };
  squeeze(1.05);
  trial.plot("slip of the load [m]");
  trial.run(sim, 60.0, [&](const Runner& s) { trial.draw(s, 1.0 - s.state().q[q + 2]); });
  const double slip = 1.0 - sim.state().q[q + 2];
  // Creep r f of eight contacts, alpha = 1/0.2 + 1/10; 10 % for the smoothing near the cone's edge.
  const double creep = 1.1 * sim.options().contact.compliance * (5.0 + 0.1) * mass * kCaseGravity /
                       8.0 * sim.options().time_step;
  trial.chart.levels = {{"creep of the law", 60.0 * creep}};
  trial.at_most("slip within 60 s, squeezed by 1.05 m g / (2 mu)", "m", slip, 60.0 * creep,
                "Coulomb: held; docs/explanation/concepts.md: creep eps alpha f h");
  sim.reset();
  squeeze(0.95);
  const double time = 0.3;
  trial.run(sim, time);
  // The difference of gravity and friction is 5 % of gravity.
  trial.equal("fall within 0.3 s, squeezed by 0.95 of it", "m", 1.0 - sim.state().q[q + 2],
              0.5 * 0.05 * kCaseGravity * time * (time + sim.options().time_step), 1e-5,
              "Coulomb: a = 0.05 g");
}

void humanoid(Trial& trial) {
  Runner& sim = trial.load("humanoid");
  View view(sim);
  const double start = view.energy();
  double gain = 0.0;
  trial.plot("energy [J]", {{"start", start}});
  trial.run(sim, sim.options().duration, [&](const Runner& s) {
    view.look();
    gain = std::max(gain, view.energy() - start);
    trial.draw(s, view.energy());
  });
  trial.at_most("energy gained", "J", gain, 1e-3 * std::abs(start), "nothing drives it; 0.1 %");
  trial.at_most("penetration, largest", "m", trial.max_penetration, 1e-3, "non-penetration; 1 mm");
  trial.at_most("kinetic energy at the end", "J", view.kinetic(), 1e-3, "damped joints: it rests");
}

void servo_chain(Trial& trial) {
  Runner& sim = trial.load("servo_chain");
  const auto bend = [&](int first) {
    return sim.state().q.segment(first, 10).cwiseAbs().maxCoeff();
  };
  double soft = 0.0;
  trial.plot("largest joint angle [rad]", {}, {"1.1 of the least stiffness", "0.9 of it"});
  trial.chart.log_y = true;
  trial.run(sim, sim.options().duration, [&](const Runner& s) {
    soft = std::max(soft, bend(10));
    trial.draw(s, bend(0));
    trial.draw(s, bend(10), 1);
  });
  trial.chart.levels = {{"start", 0.001}};
  trial.at_most("stiff: joint angle after 30 s", "rad", bend(0), 1e-6,
                "stable iff the stiffness exceeds the largest eigenvalue of gravity's");
  trial.at_least("soft: joint angle, largest", "rad", soft, 0.1,
                 "unstable below it: it buckles; a hundred times the start");
}

void singular_poses(Trial& trial) {
  Runner& sim = trial.load("singular_poses");
  View view(sim);
  trial.plot("energy over m g L", {{"2 %", 0.02}});
  const double off = watch_energy(trial, sim, view, 2 * kCaseGravity * 1.0).off;
  trial.at_most("energy off, over m g L", "1", off, 0.02, "nothing drives or brakes it; 2 %");
  trial.at_most("numbers that are not finite", "1", sim.state().q.allFinite() ? 0.0 : 1.0, 0.0,
                "all poses are legal");
}

void flat_linkage(Trial& trial) {
  trial.plot("energy off [J]", {}, {"2 ms", "10 ms"});
  for (std::size_t i = 0; i < 2; ++i) {
    Runner& sim = trial.load("flat_linkage");
    sim.set_time_step(i == 0 ? 0.002 : 0.01);
    View view(sim);
    double open = 0.0;
    const auto look = [&] { open = std::max(open, closures_open(sim.model(), sim.state().q)); };
    const double off = watch_energy(trial, sim, view, 1.0, look, i).off;
    const std::string& step = trial.chart.curves[i].name;
    trial.at_most("energy off, of 20.5 J, at " + step, "J", off, 1e-3,
                  "nothing drives or brakes it; five turns");
    trial.at_most("closure open, at " + step, "m", open, 1e-5, "it is closed; 10 um");
  }
}

}  // namespace

std::vector<HardCase> linkage_cases() {
  return {
      {"flat_linkage", "A four-bar linkage loses a rank of its closure in every flat pose.",
       flat_linkage},
      {"chain_100", "100 bodies on 100 closures: the first carries a hundred times the last.",
       [](Trial& t) { chain(t, 100); }},
      {"chain_1000", "1000 closures in series; drag calms what they yield to.",
       [](Trial& t) { chain(t, 1000); }, true},
      {"whip_100", "300 degrees of freedom in series whip; energy must neither grow nor vanish.",
       whip, true},
      {"net", "400 bodies in 361 loops of ball closures, folded by their own weight.", net, true},
      {"gripper", "Light fingers, heavy load, 5 % above the least force; creep adds up over 60 s.",
       gripper},
      {"humanoid", "Limbs touch limbs and ground at once, in a tree of 31 degrees of freedom.",
       humanoid},
      {"servo_chain",
       "Ten links on their heads: 10 % of stiffness decide between upright and down.", servo_chain},
      {"singular_poses",
       "Gimbal at its pole, axes through one point, a massless link, links in line.",
       singular_poses},
  };
}

}  // namespace counterpoint::apps
