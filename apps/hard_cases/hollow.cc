// Bodies that are not convex, in convex pieces (docs/guide/not-convex.md).
#include <algorithm>
#include <cmath>

#include "trial.h"

namespace counterpoint::apps {
namespace {

/// The scene's own answer: a figure with an upper bound. `value` gets the state, the start and the
/// forces of the last step.
struct Answer {
  const char *quantity, *unit;
  double bound;
  const char* source;
  std::function<double(const Runner&, const VectorX& start, const Forces&)> value;
  bool at_end = false;  ///< the figure counts at the end only, not its largest
};

/// Runs a scene of data/scenes/hollow for `seconds`; not `driven`: nothing may add energy.
void hollow(Trial& trial, const std::string& scene, double seconds, bool driven,
            const Answer& answer) {
  Runner& sim = trial.load(scene);
  View view(sim);
  const VectorX start = sim.state().q;
  const double energy = view.energy(), scale = view.energy_scale();
  double gain = 0.0, error = 0.0, largest = 0.0, figure = 0.0;
  trial.plot(std::string(answer.quantity) + " [" + answer.unit + "]", {{"bound", answer.bound}});
  const long steps = std::lround(seconds / sim.options().time_step);
  for (long i = 0; i < steps; ++i) {
    const Forces forces = trial.step_and_recover(sim);
    if (!(forces.inverse_error <= error)) error = forces.inverse_error;  // keeps not a number
    largest = std::max(largest, forces.largest);
    view.look();
    gain = std::max(gain, view.energy() - energy);
    const double now = answer.value(sim, start, forces);
    figure = answer.at_end ? now : std::max(figure, now);
    trial.draw(sim, now);
  }
  trial.at_most(answer.quantity, answer.unit, figure, answer.bound, answer.source);
  if (!driven) {
    trial.at_most("energy gained, over that of a fall of 1 m", "1", gain / scale, 1e-6,
                  "nothing drives it");
  }
  trial.at_most("overlap, largest", "m", trial.max_penetration, 1e-3, "non-penetration; 1 mm");
  if (std::isnan(error)) return;
  trial.at_most("inverse less applied force, over the largest force", "1", error / largest, 1e-8,
                "the inverse of the step; 1e-8");
}

/// Acceleration of a nut [m/s^2] with the radius of gyration k, k^2 = 21.1 mm^2, down the slope p =
/// 0.199 mm/rad: p g / (p + k^2 / (r tan(atan(p / r) - atan(0.02 / cos(30 degrees))))), r = 3.594
/// mm.
constexpr double kNutAcceleration = 0.01068;

HardCase hollow_case(const std::string& name, const std::string& hard, double seconds, bool driven,
                     const Answer& answer, bool slow = false) {
  const std::string scene = "../hollow/" + name;
  return {name, hard, [=](Trial& trial) { hollow(trial, scene, seconds, driven, answer); }, slow,
          scene};
}

/// Distance of the free body `link` from its start [m].
double moved(const Runner& sim, const VectorX& start, const char* link) {
  const int q = q_of(sim.model(), link);
  return (sim.state().q.segment<3>(q) - start.segment<3>(q)).norm();
}

std::vector<HardCase> resting_cases() {
  return {
      hollow_case("ball_in_bowl", "A ball rolls over the facets of a bowl.", 3.0, false,
                  {"off the plane of its swing", "m", 1e-3, "symmetry; pieces are tilted by 5e-4",
                   [](const Runner& s, const VectorX&, const Forces&) {
                     return std::abs(s.state().q[1]);
                   }}),
      hollow_case(
          "ball_in_cup", "A ball falls into a free cup: it must find the bottom.", 3.0, false,
          {"height of the ball above the bottom, less its radius", "m", 1e-4, "the bottom is flat",
           [](const Runner& s, const VectorX&, const Forces&) {
             return std::abs(s.state().q[9] - s.state().q[2] - 0.025);
           },
           true}),
      hollow_case(
          "chain_20", "Twenty closed links hang in each other.", 3.0, false,
          {"force on the first link over the weight, off by", "1", 0.05, "statics; it still swings",
           [](const Runner& s, const VectorX&, const Forces& forces) {
             const double weight = 20 * 0.05 * s.model().gravity().norm();
             return std::abs(force_between(s.model(), forces, 0, 1).z() / weight - 1.0);
           },
           true},
          true),
      hollow_case("ring_on_peg", "A ring falls over a peg and must stay around it.", 2.0, false,
                  {"distance of the ring's centre from the peg's axis", "m", 0.08 - 0.015 - 0.02,
                   "inner radius of the ring less that of the peg",
                   [](const Runner& s, const VectorX&, const Forces&) {
                     return s.state().q.head<2>().norm();
                   },
                   true}),
      hollow_case("mug_on_hook", "A mug hangs by its handle, two bent rods across each other.", 3.0,
                  false,
                  {"the mug moves by, largest", "m", 2e-3, "it is hung 1 mm above; pieces, 1 mm",
                   [](const Runner& s, const VectorX& start, const Forces&) {
                     return moved(s, start, "mug/body");
                   }}),
      hollow_case("brackets_in_bin", "Thirty brackets hook into each other and come to rest.", 3.0,
                  false,
                  {"speed at the end", "m/s", 1e-4, "friction holds what has edges",
                   [](const Runner& s, const VectorX&, const Forces&) {
                     return s.state().v.cwiseAbs().maxCoeff();
                   },
                   true},
                  true),
  };
}

}  // namespace

std::vector<HardCase> hollow_cases() {
  std::vector<HardCase> cases = resting_cases();
  cases.push_back(
      hollow_case("peg_in_hole",
                  "0.1 mm of play: 2 % of the tilt decide between a peg that slides and one "
                  "that jams.",
                  1.0, false,
                  {"the jammed peg moves, or the other misses the floor, by", "m", 1e-4,
                   "statics of two contacts; the play",
                   [](const Runner& s, const VectorX& start, const Forces&) {
                     const double missed = 0.025 - moved(s, start, "slides/body");
                     return std::max(moved(s, start, "jams/body"), std::abs(missed));
                   },
                   true}));
  cases.push_back(hollow_case(
      "nut_on_bolt", "A nut turns down its bolt: the friction angle decides, along the teeth.", 0.4,
      false,
      {"the turning nut's fall, or the other's over it, off by", "1", 0.15,
       "a slope at the pitch radius; flanks touch up to 10 % off it",
       [](const Runner& s, const VectorX& start, const Forces&) {
         const double fall = moved(s, start, "turns/nut");
         const double expected = 0.5 * kNutAcceleration * std::pow(s.state().time, 2);
         return std::max(std::abs(fall / expected - 1.0), moved(s, start, "stays/nut") / fall);
       },
       true}));
  cases.push_back(hollow_case(
      "hand_on_mug", "Fingers close on a bent handle, far off the centre of mass, and lift.", 3.0,
      true,
      {"rise of the mug less that of the palm", "m", 2e-3, "the palm's while the fingers close",
       [](const Runner& s, const VectorX&, const Forces&) {
         return std::abs(s.state().q[q_of(s.model(), "mug/body") + 2] - s.state().q[0]);
       }}));
  cases.push_back(hollow_case(
      "gears", "Teeth roll on teeth for a minute, braked: none may pass another.", 60.0, true,
      {"pinion's angle less twice the wheel's, largest", "rad", 2e-4 / 0.03, "the backlash",
       [](const Runner& s, const VectorX& start, const Forces&) {
         const VectorX turned = s.state().q - start;
         return std::abs(turned[0] + 2.0 * turned[1]);
       }},
      true));
  return cases;
}

}  // namespace counterpoint::apps
