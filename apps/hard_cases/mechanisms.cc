#include "mechanisms.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "input/inputs.h"

namespace counterpoint::apps {
namespace {

// Violation of the constraints of a mechanism [m or rad, the larger].

double gears_off(const Model& model, const VectorX& q) {
  double most = 0.0;
  for (const Mimic& mimic : model.mimics()) {
    most = std::max(most, std::abs(mimic_error(model, mimic, q)));
  }
  return most;
}

double limits_off(const Model& model, const VectorX& q) {
  double most = 0.0;
  for (int i = 0; i < model.num_joints(); ++i) {
    if (joint_nq(model.body(i + 1).joint_type) != 1) continue;
    const JointInfo& joint = model.joint(i);
    const double at = q[model.body(i + 1).q_index];
    most = std::max({most, joint.lower - at, at - joint.upper});
  }
  return most;
}

/// Largest deviation of a quaternion's norm from one.
double quaternions_off(const Model& model, const VectorX& q) {
  double most = 0.0;
  for (const Body& body : model.bodies()) {
    if (body.parent < 0 || joint_nq(body.joint_type) < 4) continue;
    const int first = body.q_index + joint_nq(body.joint_type) - 4;
    most = std::max(most, std::abs(q.segment<4>(first).norm() - 1.0));
  }
  return most;
}

struct ErrorKind {
  const char* name;
  const char* unit;
  double (*off)(const Model& model, const VectorX& q);
  double allowed;
  /// Largest speed that the constraint has to stop [m/s, rad/s]; it yields by h times compliance
  /// times this.
  double stopped;
  const char* why;
};
constexpr std::array<ErrorKind, 4> kErrorKinds = {
    {{"closures", "m, rad", closures_open, 1e-4, 0.0, "they hold, in every step; by agreement"},
     {"gears", "m, rad", gears_off, 1e-6, 0.0, "they hold, in every step; by agreement"},
     {"joint limits", "m, rad", limits_off, 0.0, 1000.0,
      "in every step; a limit yields by h times compliance times the speed it stops: 1000 rad/s"},
     {"quaternions", "1", quaternions_off, 1e-15, 0.0, "in every step; rounding"}}};

using Errors = std::array<double, kErrorKinds.size()>;

Errors errors(const Model& model, const VectorX& q) {
  Errors off;
  for (std::size_t k = 0; k < kErrorKinds.size(); ++k) off[k] = kErrorKinds[k].off(model, q);
  return off;
}

/// Sums over a tenth of a run.
struct Tenth {
  Errors squares{};
  double energy = 0.0;
  long count = 0;

  void look(const Errors& off, View& view) {
    for (std::size_t k = 0; k < kErrorKinds.size(); ++k) squares[k] += off[k] * off[k];
    view.look();
    energy += view.energy_with_springs();
    ++count;
  }
  double rms(std::size_t k) const { return std::sqrt(squares[k] / static_cast<double>(count)); }
  double mean_energy() const { return energy / static_cast<double>(count); }
};

struct Mechanism {
  const char* name;
  const char* scene;  ///< under data/scenes, without .yaml
  const char* hard;
  double shaken = 0.0;  ///< scale of the random forces; 0: only gravity acts
  const char* known_failure = nullptr;
};

/// Both quantities are largest at extremes of a chaotic motion, so a ratio of 1.5 is allowed.
constexpr double kGrowth = 1.5;

void compare_errors(Trial& trial, const SimulationOptions& options, const Errors& most,
                    const Tenth& first, const Tenth& last) {
  for (std::size_t k = 0; k < kErrorKinds.size(); ++k) {
    const auto& [name, unit, off, allowed, stopped, why] = kErrorKinds[k];
    if (most[k] == 0.0) continue;
    const double yields = options.time_step * options.contact.compliance * stopped;
    trial.at_most(fmt::format("{} off, largest", name), unit, most[k], allowed + yields, why);
    trial.at_most(fmt::format("{} off, rms of the last tenth over that of the first", name), "1",
                  last.rms(k) / first.rms(k), kGrowth, "errors do not add up; chaos: 1.5");
  }
}

void run_mechanism(Trial& trial, const Mechanism& mechanism, const std::string& scenes,
                   long steps) {
  Runner& sim = trial.load(scenes + mechanism.scene);
  const Model& model = sim.model();
  const double h = sim.options().time_step;
  RandomForces random(model, mechanism.shaken, 0.0, 1);
  View view(sim);
  const double scale = view.energy_scale();
  trial.plot("energy [J]");
  Errors most{};
  Tenth first, last;
  for (long i = 0; i < steps; ++i) {
    sim.input().applied_force.setZero();
    random.add_to(sim.state().time, 1e-6 * h, sim.input().applied_force);
    trial.step(sim);
    const Errors off = errors(model, sim.state().q);
    for (std::size_t k = 0; k < off.size(); ++k) most[k] = std::max(most[k], off[k]);
    if (i < steps / 10) first.look(off, view);
    if (i >= steps - steps / 10) last.look(off, view);
    if (i % std::max(steps / 2000, 1L) == 0) {
      view.look();
      trial.draw(sim, view.energy_with_springs());
    }
  }
  compare_errors(trial, sim.options(), most, first, last);
  if (mechanism.shaken == 0.0) {
    trial.at_most("energy, mean of the last tenth less that of the first, over m g 1 m", "1",
                  (last.mean_energy() - first.mean_energy()) / scale, 0.05,
                  "nothing drives it; 5 %. Below zero: what the scheme loses");
  }
}

constexpr Mechanism kMechanisms[] = {
    {"long_pendulum", "pendulum", "A point mass swings: no error of the scheme may add up."},
    {"long_double_pendulum", "double_pendulum", "Two rods, chaotic: energy must not grow."},
    {"long_ball_chain", "hard/ball_chain",
     "Four rods on ball joints whip about: quaternions and energy for long."},
    {"long_ball_chain_midpoint", "hard/ball_chain_midpoint",
     "The same chain by the implicit midpoint rule."},
    {"long_four_bar", "hard/four_bar", "A four-bar linkage swings, its loop closed by a closure."},
    {"long_slider_crank", "hard/slider_crank",
     "A crank turns over and over, through both dead centres."},
    {"long_bricard", "hard/bricard",
     "An overconstrained linkage, six hinges that by counting cannot move."},
    {"long_bricard_midpoint", "hard/bricard_midpoint", "The same by the implicit midpoint rule."},
    {"long_hung_chain", "hard/hung_chain", "A chain of five rods swings on both its ends."},
    {"long_hung_chain_midpoint", "hard/hung_chain_midpoint",
     "The same chain by the implicit midpoint rule."},
    {"long_crane", "hard/crane",
     "Free bodies on three rods, a hook and a weld: nothing but closures holds them."},
    {"long_geared", "hard/geared", "Two pendulums in gear, one twice as fast as the other."},
    {"long_arm7", "arm7", "An arm is thrown against its limits and the ground by random forces.",
     5.0},
};

}  // namespace

std::vector<HardCase> mechanism_cases(const std::string& scenes, long steps, bool slow) {
  std::vector<HardCase> cases;
  for (const Mechanism& mechanism : kMechanisms) {
    cases.push_back({mechanism.name, fmt::format("{} {} steps.", mechanism.hard, steps),
                     [&mechanism, scenes, steps](Trial& trial) {
                       run_mechanism(trial, mechanism, scenes, steps);
                     },
                     slow, mechanism.scene, mechanism.known_failure});
  }
  return cases;
}

}  // namespace counterpoint::apps
