// Problems that others published, with their answers: the IFToMM multibody benchmarks A01 to A05
// (iftomm-multibody.org) and SimBenchmark (Kang, Hwangbo 2018) with its error measures.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "trial.h"

namespace counterpoint::apps {
namespace {

using Equations = std::function<VectorX(const VectorX&)>;

/// Solution of x' = f(x) by the classical Runge-Kutta method, far finer than the runs.
class Reference {
 public:
  Reference(Equations f, VectorX start, double step)
      : f_(std::move(f)), x_(std::move(start)), step_(step) {}

  /// Solution at `time` [s], which must not decrease from call to call.
  const VectorX& at(double time) {
    while (time_ < time - 1e-12) {
      const double h = std::min(step_, time - time_);
      const VectorX k1 = f_(x_), k2 = f_(x_ + 0.5 * h * k1), k3 = f_(x_ + 0.5 * h * k2);
      x_ += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + f_(x_ + h * k3));
      time_ += h;
    }
    return x_;
  }

 private:
  Equations f_;
  VectorX x_;
  double step_, time_ = 0.0;
};

double joint_at(const Runner& sim, const std::string& joint) {
  const Model& model = sim.model();
  for (int i = 0; i < model.num_joints(); ++i)
    if (model.joint(i).name.ends_with(joint)) return sim.state().q[model.body(i + 1).q_index];
  throw InputError("no joint " + joint);
}

/// Steps the scene and returns the largest distance of a point on a circle of 1 m from that at
/// reference angle; `joint` has the angle of the run.
double off_the_circle(Trial& trial, Runner& sim, const std::string& joint, Reference& reference) {
  trial.plot("distance from the reference [m]");
  double most = 0.0;
  trial.run(sim, sim.options().duration, [&](const Runner& s) {
    const double angle = reference.at(s.state().time)[0];
    const double off = 2.0 * std::abs(std::sin(0.5 * (joint_at(s, joint) - angle)));
    most = std::max(most, off);
    trial.draw(s, off);
  });
  return most;
}

Reference pendulum_reference(double stiffness, double angle, double rate) {
  VectorX start(2);
  start << angle, rate;
  const auto equations = [stiffness](const VectorX& x) {
    VectorX out(2);
    out << x[1], stiffness * std::sin(x[0]);
    return out;
  };
  return {equations, start, 1e-4};
}

void pendulum(Trial& trial) {
  Runner& sim = trial.load("../pendulum");
  Reference reference = pendulum_reference(-kCaseGravity, 0.5 * std::numbers::pi, 0.0);
  // First order: h T0 / 2 times the largest speed, sqrt(2 g), after 4.2 periods.
  trial.at_most(
      "point off the reference within 10 s, largest", "m",
      off_the_circle(trial, sim, "swing", reference), 0.01,
      "IFToMM A01: the pendulum's equation by Runge-Kutta 4 at 0.1 ms; 1 % of its length");
}

/// A02. All windows move alike: N + 1 rods turn with an angle from upright, N rods follow the tops.
void windows(Trial& trial, int n) {
  Runner& sim = trial.load(fmt::format("windows_{}", n));
  const double weight = 0.5 * (n + 1) + n, inertia = (n + 1) / 3.0 + n;
  Reference reference = pendulum_reference(kCaseGravity * weight / inertia, 0.0, 1.0);
  View view(sim);
  const double start = view.energy();
  const double off = off_the_circle(trial, sim, "u0", reference);
  view.look();
  trial.at_most("top off the reference within 10 s, largest", "m", off, 0.02,
                "IFToMM A02: one pendulum's equation by Runge-Kutta 4 at 0.1 ms; 2 % of a rod");
  trial.at_most("energy off at 10 s, over m g 1 m", "1",
                std::abs(view.energy() - start) / ((2 * n + 1) * kCaseGravity), 1e-3,
                "IFToMM A02: it is conserved; 0.1 %");
  trial.at_most("closures open at 10 s, largest", "m", closures_open(sim.model(), sim.state().q),
                1e-5, "they are closed; 10 um");
}

void andrews(Trial& trial) {
  Runner& sim = trial.load("andrews");
  sim.input().applied_force[sim.model().body(1).v_index] = 0.033;
  trial.plot("angle beta [rad]");
  trial.run(sim, 0.03, [&](const Runner& s) { trial.draw(s, joint_at(s, "beta")); });
  constexpr std::array<std::pair<const char*, double>, 7> kKnown = {
      {{"beta", 15.81077119629904},
       {"theta", -15.75637105984298},
       {"gamma", 0.04082224013073101},
       {"phi", -0.5347301163226948},
       {"delta", 0.5244099658805304},
       {"omega", 0.5347301163226948},
       {"epsilon", 1.048080741042263}}};
  double off = 0.0;
  for (const auto& [name, known] : kKnown)
    off = std::max(off, std::abs(joint_at(sim, name) - known));
  // Springs of tendons are of order 1: 0.049 rad at 5 us, half of it at 2.5 us.
  trial.at_most("angles at 30 ms off, largest", "rad", off, 0.03,
                "IFToMM A03; solution of the Test Set for IVP Solvers, seven angles of 16 digits; "
                "0.2 % of 15.8 rad");
}

void bricard(Trial& trial) {
  Runner& sim = trial.load("bricard_midpoint");
  View view(sim);
  trial.plot("energy over m g 1 m");
  const double off = watch_energy(trial, sim, view, 5.0 * kCaseGravity).off;
  trial.at_most("energy off within 10 s, over m g 1 m", "1", off, 1e-3,
                "IFToMM A04: it is conserved; 0.1 %");
}

/// A05. By symmetry two unknowns: the slider's height s and the angle a of the rods below the
/// horizontal; the angular momentum about the shaft is conserved.
Reference governor_reference() {
  constexpr double kRod = 0.3, kBall = 5.0, kSlider = 3.0, kMass = kRod + kBall;
  constexpr double kFirst = kRod * 0.5 + kBall;   // first moment of a rod [kg m]
  constexpr double kSecond = kRod / 3.0 + kBall;  // second moment [kg m^2]
  constexpr double kThin = kRod * 1e-4 / 12.0;    // second moment across a rod [kg m^2]
  constexpr double kFixed = 0.3 * 2e-4 / 12.0 + kSlider * 0.02 / 12.0;  // shaft and slider
  constexpr double kOffset = 0.05, kSpring = 8e5, kDamper = 4e4, kRest = 0.5;
  const auto spin_inertia = [](double a) {
    return kFixed +
           2.0 * (kMass * kOffset * kOffset + 2.0 * kOffset * kFirst * std::cos(a) +
                  kSecond * std::cos(a) * std::cos(a) + kThin * (1.0 + std::sin(a) * std::sin(a)));
  };
  const double angle = std::numbers::pi / 6.0;
  const double momentum = spin_inertia(angle) * 2.0 * std::numbers::pi;
  const auto equations = [=](const VectorX& x) {
    const double s = x[0], a = x[1], ds = x[2], da = x[3];
    const double across = 0.5 * std::cos(a), up = 1.0 - 0.5 * std::sin(a) - s;
    const double length = std::hypot(across, up);
    const double by_s = -up / length;
    const double by_a = (across * -0.5 * std::sin(a) + up * -0.5 * std::cos(a)) / length;
    const double pull = kSpring * (length - kRest) + kDamper * (by_s * ds + by_a * da);
    const double rate = momentum / spin_inertia(a);
    const double by_spin = 0.5 * rate * rate *
                           (-4.0 * kOffset * kFirst * std::sin(a) -
                            4.0 * (kSecond - kThin) * std::cos(a) * std::sin(a));
    VectorX out(4);
    out << ds, da, -kCaseGravity - 2.0 * pull * by_s / kSlider,
        (by_spin + 2.0 * kFirst * kCaseGravity * std::cos(a) - 2.0 * pull * by_a) /
            (2.0 * (kSecond + kThin));
    return out;
  };
  VectorX start(4);
  start << 0.5, angle, 0.0, 0.0;
  return {equations, start, 1e-5};
}

void governor(Trial& trial) {
  Runner& sim = trial.load("governor");
  Reference reference = governor_reference();
  trial.plot("height of the slider [m]", {}, {"run", "reference"});
  double most = 0.0;
  trial.run(sim, sim.options().duration, [&](const Runner& s) {
    const double known = reference.at(s.state().time)[0], height = joint_at(s, "slide");
    most = std::max(most, std::abs(height - known));
    trial.draw(s, height);
    trial.draw(s, known, 1);
  });
  // Springs of tendons are of order 1: 13 mm at 1 ms, 1.2 mm at 0.1 ms.
  trial.at_most("slider off the reference within 10 s, largest", "m", most, 5e-3,
                "IFToMM A05: four equations by Runge-Kutta 4 at 10 us; 1 % of its height");
}

/// Mean of f after each step, from the start on.
template <class F>
double mean_of(Trial& trial, Runner& sim, double seconds, F f) {
  double sum = f(sim);
  long count = 1;
  trial.run(sim, seconds, [&](const Runner& s) {
    const double value = f(s);
    trial.draw(s, value);
    sum += value;
    ++count;
  });
  return sum / static_cast<double>(count);
}

void rolling(Trial& trial) {
  Runner& sim = trial.load("rolling_box");
  sim.set_time_step(0.001);
  const int box = v_of(sim.model(), "box/body");
  const double force = 150.0 * std::sqrt(0.5);
  sim.input().applied_force[box] = sim.input().applied_force[box + 1] = force;
  const double a = (150.0 - 0.4 * 35.0 * kCaseGravity) / (10.0 + 25.0 * 2.0 / 7.0);
  const Vector3 direction(std::sqrt(0.5), std::sqrt(0.5), 0.0);
  View view(sim);
  trial.plot("squared error of the velocities [m^2/s^2]");
  const double error = mean_of(trial, sim, 4.0, [&](const Runner& s) {
    view.look();
    const Vector3 known = a * s.state().time * direction;
    return (view.velocity(1) - known).squaredNorm() +
           (view.velocity(2) - 2.0 / 7.0 * known).squaredNorm();
  });
  trial.at_most("squared error of the velocities, mean", "m^2/s^2", error, 4.1e-7,
                "SimBenchmark, rolling, 1 ms: RaiSim's 4.1e-7");
}

/// Mean squared error of the energy of elastic balls.
double energy_error(Trial& trial, Runner& sim, double seconds) {
  View view(sim);
  const double start = view.energy();
  trial.plot("squared error of the energy [J^2]");
  return mean_of(trial, sim, seconds, [&](const Runner&) {
    view.look();
    return std::pow(view.energy() - start, 2);
  });
}

void bouncing_balls(Trial& trial) {
  Runner& sim = trial.load("bouncing_49");
  const double height = 4.9, impacts = 20.0 / (2.0 * std::sqrt(2.0 * height / kCaseGravity));
  const double lost =
      4.0 * sim.options().contact.compliance * impacts * 490.0 * kCaseGravity * height;
  trial.at_most("squared error of the energy, mean", "J^2", energy_error(trial, sim, 20.0),
                1.1 * lost * lost / 3.0,
                "an impact loses 4 eps of its energy, eps the compliance; a loss that grows evenly "
                "has a third of its square as mean; 10 %");
}

void elastic_balls(Trial& trial) {
  Runner& sim = trial.load("elastic_666");
  trial.at_most("squared error of the energy, mean", "J^2", energy_error(trial, sim, 10.0), 8.4,
                "SimBenchmark, elastic 666, 1 ms: RaiSim's 8.4");
}

/// Sum of the squared overlaps of spheres of radius 0.1 m with each other and the ground [m^2].
double squared_overlaps(const Runner& sim) {
  constexpr double kRadius = 0.1;
  double sum = 0.0;
  const VectorX& q = sim.state().q;
  for (Eigen::Index i = 0; i < q.size(); i += 7) {
    sum += std::pow(std::max(kRadius - q[i + 2], 0.0), 2);
    for (Eigen::Index j = i + 7; j < q.size(); j += 7) {
      const double gap = (q.segment<3>(i) - q.segment<3>(j)).norm() - 2.0 * kRadius;
      sum += std::pow(std::min(gap, 0.0), 2);
    }
  }
  return sum;
}

void balls(Trial& trial) {
  Runner& sim = trial.load("balls_666");
  trial.plot("sum of the squared overlaps [m^2]");
  trial.at_most("sum of the squared overlaps, mean", "m^2",
                mean_of(trial, sim, 10.0, squared_overlaps), 1.4e-4,
                "SimBenchmark, 666, 1 ms: RaiSim's 1.35e-4");
}

}  // namespace

std::vector<HardCase> published_cases() {
  return {
      {"iftomm_a01", "A pendulum from the horizontal for 10 s: phase errors add up.", pendulum,
       false, "pendulum"},
      {"iftomm_a02", "Two four-bar windows turn over: flat, they have three ways to go on.",
       [](Trial& t) { windows(t, 2); }, false, "windows_2"},
      {"iftomm_a02_40", "The same with 40 windows, 81 rods.", [](Trial& t) { windows(t, 40); },
       true, "windows_40"},
      {"iftomm_a03", "Andrews' squeezer: seven bodies, three loops, 2.5 turns in 30 ms.", andrews,
       false, "andrews"},
      {"iftomm_a04", "Bricard's linkage: by counting constraints it cannot move.", bricard, false,
       "bricard_midpoint"},
      {"iftomm_a05", "A governor with dampers of 40 kN s/m: time constants of 40 us and 1 s.",
       governor, false, "governor"},
      {"simbenchmark_rolling", "Balls roll on a sliding box: both friction forces at work.",
       rolling, false, "rolling_box"},
      {"simbenchmark_bouncing", "49 elastic balls bounce for 20 s: their energy is conserved.",
       bouncing_balls, false, "bouncing_49"},
      {"simbenchmark_666", "216 balls without friction collapse on each other.", balls, true,
       "balls_666"},
      {"simbenchmark_elastic_666", "216 elastic balls fall on each other: energy is conserved.",
       elastic_balls, true, "elastic_666",
       "Newton's restitution in one step for all pairs: those that meet only through the impulses "
       "of "
       "others do not bounce. The balls lose 1560 J of 34500 J where they land, at half the step "
       "650 J."},
  };
}

}  // namespace counterpoint::apps
