// Cards and arches, which stand or fall by friction and geometry alone.
#include <algorithm>
#include <cmath>

#include "trial.h"

namespace counterpoint::apps {
namespace {

void stands(Trial& trial, const char* scene, double bound, const char* source) {
  Runner& sim = trial.load(scene);
  const double most = trial.left_alone(sim, sim.options().duration, "block");
  trial.chart.levels = {{"bound", bound}};
  trial.at_most("drift, largest", "m", most, bound, source);
}

void card_pair_stands(Trial& trial) {
  stands(trial, "card_pair_stands", 1e-6,
         "statics: stands iff mu >= l sin/(t + 2 l cos) (thin card: tan/2); here 1.02 times it");
}

void card_pair_slides(Trial& trial) {
  Runner& sim = trial.load("card_pair_slides");
  const double before = sim.state().q[2];
  trial.left_alone(sim, sim.options().duration, "block");
  trial.chart.levels = {{"fallen", 0.05}};
  trial.at_least(
      "centre of a card falls by", "m", before - sim.state().q[2], 0.05,
      "statics: slides if mu < l sin/(t + 2 l cos) (thin card: tan/2); here 0.98 times it");
}

void card_pair_sharp(Trial& trial) {
  stands(trial, "card_pair_sharp", 1e-6,
         "statics: stands iff mu >= (tan(theta) - t/L)/2; here 1.02 times it");
}

void card_house(Trial& trial) {
  stands(trial, "card_house", 1e-6, "statics: mu = 0.6 is over three times tan(20 deg)/2");
}

void arch_stands(Trial& trial) {
  stands(trial, "arch_stands", 1e-6,
         "a half circle stands from thickness/radius 0.1075 on (Milankovitch 1907; Heyman 1969)");
}

void arch_falls(Trial& trial) {
  Runner& sim = trial.load("arch_falls");
  const int crown = sim.model().body(10).q_index;
  const double before = sim.state().q[crown + 2];
  trial.left_alone(sim, sim.options().duration, "block");
  trial.chart.levels = {{"fallen", 0.5}};
  trial.at_least(
      "crown falls by", "m", before - sim.state().q[crown + 2], 0.5,
      "a half circle falls below thickness/radius 0.1075 (Milankovitch 1907; Heyman 1969)");
}

}  // namespace

std::vector<HardCase> masonry_cases() {
  return {
      {"card_pair_stands", "Two edges lean on each other, 2 % inside the limit of friction.",
       "card_pair_stands", card_pair_stands},
      {"card_pair_slides", "The same pair 2 % outside: it must not stick.", "card_pair_slides",
       card_pair_slides},
      {"card_pair_sharp", "Two sharp edges in one line: the normal between them is not defined.",
       "card_pair_sharp", card_pair_sharp},
      {"card_house", "Fifteen thin cards on edges; nothing but friction holds any of them.",
       "card_house", card_house},
      {"arch_stands", "Loose wedges, thrust through all joints, 12 % inside the limit.",
       "arch_stands", arch_stands},
      {"arch_falls", "The same arch 16 % too thin: it must find its hinges and fall.", "arch_falls",
       arch_falls},
  };
}

}  // namespace counterpoint::apps
