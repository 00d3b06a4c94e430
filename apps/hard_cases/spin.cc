// Spinning bodies: tops, coins, the tumbling racket.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "trial.h"

namespace counterpoint::apps {
namespace {

// Moments of inertia per mass about the tip, of the heavy top of data/robots/hard/top.urdf.
constexpr double kAcross = (3 * 0.1 * 0.1 + 0.02 * 0.02) / 12 + 0.1 * 0.1, kAxial = 0.5 * 0.1 * 0.1;

void top_steady(Trial& trial) {
  Runner& sim = trial.load("top_steady");
  const double theta = 0.5, spin = 100.0;
  const double a = kAcross * std::cos(theta), b = kAxial * spin, c = kCaseGravity * 0.1;
  const double rate = (b - std::sqrt(b * b - 4.0 * a * c)) / (2.0 * a);
  View view(sim);
  double lean_off = 0.0, turned = 0.0, last = 0.0;
  trial.plot("lean [rad]", {{"0.5 rad", theta}});
  trial.run(sim, 5.0, [&](const Runner& s) {
    view.look();
    const Vector3 axis = view.pose("top/top").rotation.col(2);
    const double lean = std::acos(std::clamp(axis.z(), -1.0, 1.0));
    lean_off = std::max(lean_off, std::abs(lean - theta));
    const double azimuth = std::atan2(axis.y(), axis.x());
    turned += std::remainder(azimuth - last, 2.0 * std::numbers::pi);
    last = azimuth;
    trial.draw(s, lean);
  });
  trial.equal("precession, mean of 5 s", "rad/s", turned / 5.0, rate, 0.01 * rate,
              "I1 W^2 cos - I3 w3 W + m g l = 0; 1 %");
  trial.at_most("lean off 0.5, largest", "rad", lean_off, 0.01, "steady: the lean stays; 0.01 rad");
}

void top_sleeping(Trial& trial) {
  Runner& sim = trial.load("top_sleeping");
  View view(sim);
  double fast = 0.0, slow = 0.0;
  trial.plot("lean [rad]", {}, {"1.1 of the critical spin", "0.9 of it"});
  const auto lean = [&](const char* link) {
    return std::acos(std::clamp(view.pose(link).rotation(2, 2), -1.0, 1.0));
  };
  trial.run(sim, 5.0, [&](const Runner& s) {
    view.look();
    fast = std::max(fast, lean("fast/top"));
    slow = std::max(slow, lean("slow/top"));
    trial.draw(s, lean("fast/top"));
    trial.draw(s, lean("slow/top"), 1);
  });
  trial.chart.levels = {{"0.1 rad", 0.1}};
  trial.at_most("lean above the critical spin, largest", "rad", fast, 0.1,
                "sleeps iff I3^2 w3^2 > 4 I1 m g l; starts at 0.01 rad");
  trial.at_least("lean below it, largest", "rad", slow, 0.3, "unstable if I3^2 w3^2 < 4 I1 m g l");
}

void dzhanibekov(Trial& trial) {
  Runner& sim = trial.load("dzhanibekov");
  View view(sim);
  const double energy = view.kinetic();
  const Vector3 momentum = view.momentum().torque;
  // Principal moments in ascending order; Landau and Lifshitz, Mechanics, section 37.
  double A = 0.05 / 3, B = 0.1 / 3, C = 0.13 / 3;
  const double L2 = momentum.squaredNorm();
  if (L2 < 2.0 * energy * B) std::swap(A, C);
  const double k2 = (B - A) * (2.0 * energy * C - L2) / ((C - B) * (L2 - 2.0 * energy * A));
  const double period = 4.0 * std::comp_ellint_1(std::sqrt(k2)) *
                        std::sqrt(A * B * C / ((C - B) * (L2 - 2.0 * energy * A)));
  double energy_off = 0.0, momentum_off = 0.0, last = 1.0;
  std::vector<double> rises;
  trial.plot("energy off, relative");
  trial.chart.log_y = true;
  trial.run(sim, 60.0, [&](const Runner& s) {
    view.look();
    energy_off = std::max(energy_off, std::abs(view.kinetic() / energy - 1.0));
    momentum_off =
        std::max(momentum_off, (view.momentum().torque - momentum).norm() / momentum.norm());
    const double now = s.state().v[4];
    if (last < 0.0 && now >= 0.0)
      rises.push_back(s.state().time - s.options().time_step * now / (now - last));
    last = now;
    trial.draw(s, std::abs(view.kinetic() / energy - 1.0));
  });
  trial.chart.levels = {{"1e-9", 1e-9}};
  trial.at_most("energy off within 60 s, relative", "1", energy_off, 1e-9,
                "free body: energy is constant; rounding of 30000 steps");
  trial.at_most("angular momentum off, relative", "1", momentum_off,
                0.5 * sim.options().time_step * 5.0,
                "free body: momentum is constant; its direction by h |w|/2, as attitude and "
                "velocity of the scheme are half a step apart");
  const double measured =
      rises.size() < 2 ? 0.0
                       : (rises.back() - rises.front()) / static_cast<double>(rises.size() - 1);
  trial.equal("period", "s", measured, period, 0.01 * period,
              "4 K(k) sqrt(ABC / ((C - B)(L^2 - 2EA))), Landau & Lifshitz section 37; 1 %");
}

/// Largest gain of energy, divided by the kinetic energy at the start.
double energy_gain(Trial& trial, Runner& sim, View& view, const std::function<void()>& after = {}) {
  trial.plot("energy over that at the start, relative", {{"no gain", 0.0}});
  return watch_energy(trial, sim, view, view.kinetic(), after).gain;
}

void coin(Trial& trial) {
  Runner& sim = trial.load("coin");
  View view(sim);
  const double gain = energy_gain(trial, sim, view);
  trial.at_most("energy gained, over the spin's", "1", gain, 1e-6, "friction only takes");
  trial.equal("height of its centre at the end", "m", view.center(1).z(), 0.005, 1e-5,
              "lies flat on a face");
}

void fast_spin(Trial& trial) {
  Runner& sim = trial.load("fast_spin");
  View view(sim);
  double height = 0.0;
  const double gain =
      energy_gain(trial, sim, view, [&] { height = std::max(height, view.center(1).z() - 0.01); });
  trial.at_most("energy gained, over the spin's", "1", gain, 1e-9, "friction only takes");
  trial.at_most("lying disk rises by", "m", height, 1e-6, "it lies");
}

void tippe_top(Trial& trial) {
  Runner& sim = trial.load("tippe_top");
  View view(sim);
  double height = 0.0;
  const double low = view.center(1).z();
  const double gain =
      energy_gain(trial, sim, view, [&] { height = std::max(height, view.center(1).z() - low); });
  trial.at_most("energy gained, over the spin's", "1", gain, 1e-4, "friction only takes");
  trial.at_least("centre of mass rises by", "m", height, 0.9 * 2.0 * 0.004,
                 "inverts if 1 - e/R < A/C < 1 + e/R and it spins fast (Ebenfeld, Scheck 1995)");
}

}  // namespace

std::vector<HardCase> spin_cases() {
  return {
      {"top_steady", "Gyroscopic forces a hundred times gravity must balance it exactly.",
       top_steady},
      {"top_sleeping", "Whether an upright top stays up depends on its spin alone.", top_sleeping},
      {"dzhanibekov", "An unstable axis: energy errors change the period at once.", dzhanibekov},
      {"coin", "One moving contact point, ever faster while the coin lies down (Euler's disk).",
       coin},
      {"fast_spin", "1e4 rad/s: three turns a step.", fast_spin},
      {"tippe_top", "Friction at one sliding point lifts the centre of mass.", tippe_top},
  };
}

}  // namespace counterpoint::apps
