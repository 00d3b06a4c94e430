// Cards and arches, which stand or fall by friction and geometry alone.
#include "trial.h"

namespace counterpoint::apps {
namespace {

/// A structure that must not move.
HardCase stands(const char* name, const char* hard, const char* source) {
  return {name, hard, [=](Trial& trial) {
            constexpr double kBound = 1e-6;  // [m]
            Runner& sim = trial.load(name);
            const double most = trial.left_alone(sim, sim.options().duration, "block");
            trial.chart.levels = {{"bound", kBound}};
            trial.at_most("drift, largest", "m", most, kBound, source);
          }};
}

/// A structure of which a body must fall by a distance [m].
HardCase falls(const char* name, const char* hard, int body, const char* quantity, double distance,
               const char* source) {
  return {name, hard, [=](Trial& trial) {
            Runner& sim = trial.load(name);
            const int z = sim.model().body(body).q_index + 2;
            const double before = sim.state().q[z];
            trial.left_alone(sim, sim.options().duration, "block");
            trial.chart.levels = {{"fallen", distance}};
            trial.at_least(quantity, "m", before - sim.state().q[z], distance, source);
          }};
}

}  // namespace

std::vector<HardCase> masonry_cases() {
  return {
      stands(
          "card_pair_stands", "Two edges lean on each other, 2 % inside the limit of friction.",
          "statics: stands iff mu >= l sin/(t + 2 l cos) (thin card: tan/2); here 1.02 times it"),
      falls("card_pair_slides", "The same pair 2 % outside: it must not stick.", 1,
            "centre of a card falls by", 0.05,
            "statics: slides if mu < l sin/(t + 2 l cos) (thin card: tan/2); here 0.98 times it"),
      stands("card_pair_sharp",
             "Two sharp edges in one line: the normal between them is not defined.",
             "statics: stands iff mu >= (tan(theta) - t/L)/2; here 1.02 times it"),
      stands("card_house", "Fifteen thin cards on edges; nothing but friction holds any of them.",
             "statics: mu = 0.6 is over three times tan(20 deg)/2"),
      stands(
          "arch_stands", "Loose wedges, thrust through all joints, 12 % inside the limit.",
          "a half circle stands from thickness/radius 0.1075 on (Milankovitch 1907; Heyman 1969)"),
      falls("arch_falls", "The same arch 16 % too thin: it must find its hinges and fall.", 10,
            "crown falls by", 0.5,
            "a half circle falls below thickness/radius 0.1075 (Milankovitch 1907; Heyman 1969)"),
  };
}

}  // namespace counterpoint::apps
