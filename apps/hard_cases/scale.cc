// The same motion at other sizes, masses and time steps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "trial.h"

namespace counterpoint::apps {
namespace {

/// Positions divided by the size, one for each of 1000 steps of a drop scene.
std::vector<Vector3> dimensionless(Trial& trial, const std::string& scene, double size) {
  Runner& sim = trial.load(scene);
  std::vector<Vector3> out;
  for (int i = 0; i < 1000; ++i) {
    trial.step(sim);
    out.push_back(sim.state().q.head<3>() / size);
  }
  return out;
}

double apart(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).norm());
  return most;
}

void similarity_size(Trial& trial) {
  const std::vector<Vector3> one = dimensionless(trial, "drop_size_1e0", 1.0);
  trial.chart.x_label = "size [m]";
  trial.plot("off the motion at 1 m, over the size", {},
             {"all lengths and speeds scaled", "contact options as they are"});
  trial.chart.log_x = trial.chart.log_y = true;
  double most = 0.0;
  std::string unscaled;
  for (int exponent = -3; exponent <= 3; ++exponent) {
    if (exponent == 0) continue;  // the reference of the others
    const double size = std::pow(10.0, exponent);
    const double scaled_off =
        apart(dimensionless(trial, fmt::format("drop_size_1e{}", exponent), size), one);
    most = std::max(most, scaled_off);
    trial.chart.curves[0].add(size, scaled_off);
    const double off =
        apart(dimensionless(trial, fmt::format("drop_unscaled_1e{}", exponent), size), one);
    trial.chart.curves[1].add(size, off);
    unscaled += fmt::format("{}{:.2g} at 1e{} m", unscaled.empty() ? "" : ", ", off, exponent);
  }
  trial.chart.levels = {{"1e-6", 1e-6}};
  trial.at_most("off the motion at 1 m, over the size", "1", most, 1e-6,
                "Froude: lengths L, times sqrt(L), speeds sqrt(L) give the same motion");
  trial.remark =
      "With margin (0.01 m), smoothing (1e-13 m), max_recovery_speed (1 m/s) and slip_time (2 s) "
      "left at their defaults, which have dimensions, the motion is off by " +
      unscaled + ".";
}

void similarity_mass(Trial& trial) {
  const std::vector<Vector3> one = dimensionless(trial, "drop_size_1e0", 1.0);
  trial.chart.x_label = "mass [kg]";
  trial.chart.y_label = "off the motion of 1 kg [m]";
  trial.chart.log_x = trial.chart.log_y = true;
  trial.chart.curves.resize(1);
  double most = 0.0;
  for (const int exponent : {-6, -3, 3, 6}) {
    const double off =
        apart(dimensionless(trial, fmt::format("drop_mass_1e{}", exponent), 1.0), one);
    trial.chart.curves[0].add(std::pow(10.0, exponent), off);
    most = std::max(most, off);
  }
  trial.chart.levels = {{"1e-6 m", 1e-6}};
  trial.at_most("off the motion of 1 kg", "m", most, 1e-6, "mass cancels");
}

void time_steps(Trial& trial) {
  const double v0 = 0.4, mu = 0.5;
  trial.chart.x_label = "time step [s]";
  trial.plot("off where Coulomb puts the block [m]", {},
             {"measured", "scheme: h v0/2 + h^2 mu g/8"});
  trial.chart.log_x = trial.chart.log_y = true;
  double worst = 0.0, drifted = 0.0;
  for (const double h : {1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.05}) {
    Runner& sim = trial.load("time_steps");
    sim.set_time_step(h);
    const VectorX start = sim.state().q;
    const double time = h < 5e-6 ? 0.01 : 0.1;  // 1e-6 s: 10,000 steps, still sliding
    trial.run(sim, time);
    const double stop = v0 / (mu * kCaseGravity), moving = std::min(time, stop);
    const double way = v0 * moving - 0.5 * mu * kCaseGravity * moving * moving;
    const double off = std::abs(sim.state().q[0] - way);
    const double bound = 0.5 * h * v0 + h * h * mu * kCaseGravity / 8.0 + 1e-9;
    worst = std::max(worst, off / bound);
    VectorX q = sim.state().q;
    q.head<7>() = start.head<7>();
    drifted = std::max(drifted, drift(sim.model(), q, start));
    trial.chart.curves[0].add(h, off);
    trial.chart.curves[1].add(h, bound);
  }
  trial.at_most("sliding block off Coulomb, over the scheme's error", "1", worst, 1.0,
                "v0^2/(2 mu g); semi-implicit Euler: h v0/2 + h^2 mu g/8");
  trial.at_most("standing cubes drift", "m", drifted, 1e-6, "they stand, at every time step");
}

}  // namespace

std::vector<HardCase> scale_cases() {
  return {
      {"similarity_size", "A millimetre and a kilometre: any length that is fixed shows.",
       similarity_size, false, "drop_size_1e*, drop_unscaled_1e*"},
      {"similarity_mass",
       "A milligram and a thousand tonnes: any mass or force that is fixed shows.", similarity_mass,
       false, "drop_mass_1e*"},
      {"time_steps", "From a microsecond to 50 ms: stiffness that depends on the step shows.",
       time_steps},
  };
}

}  // namespace counterpoint::apps
