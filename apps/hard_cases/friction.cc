// Friction inside the cone, outside it, and at the transition.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "trial.h"

namespace counterpoint::apps {
namespace {

/// Rests: tan(theta) = 0.4 < mu = 0.5.
void slope_rest(Trial& trial) {
  Runner& sim = trial.load("slope_rest");
  const ContactOptions& options = sim.options().contact;
  const double h = sim.options().time_step, sine = 0.4 / std::hypot(1.0, 0.4);
  const int q = q_of(sim.model(), "block/body"), v = v_of(sim.model(), "block/body");
  // Sum of the regularizer's eps g h sin(theta) and the smoothing's delta / h; 1 % for the factor
  // of the latter.
  const double bound =
      1.01 * (options.compliance * kCaseGravity * h * sine + options.smoothing / h);
  trial.plot("speed [m/s]", {{"eps g h sin(theta) + delta/h", bound}});
  trial.chart.log_y = true;
  trial.run(sim, 1.0);
  const Vector3 before = sim.state().q.segment<3>(q);
  trial.run(sim, 9.0, [&](const Runner& s) { trial.draw(s, s.state().v.segment<3>(v).norm()); });
  trial.at_most(
      "creep, mean of 9 s", "m/s", (sim.state().q.segment<3>(q) - before).norm() / 9.0, bound,
      "rigid Coulomb: 0; of this law, docs/explanation/concepts.md: eps g h sin(theta) + delta/h");
}

/// Slides: tan(theta) = 0.6 > mu = 0.5.
void slope_slide(Trial& trial) {
  Runner& sim = trial.load("slope_slide");
  const double cosine = 1.0 / std::hypot(1.0, 0.6), sine = 0.6 * cosine;
  const double a = kCaseGravity * (sine - 0.5 * cosine);
  const Vector3 normal(sine, 0.0, cosine);
  const int q = q_of(sim.model(), "block/body"), v = v_of(sim.model(), "block/body");
  double hover = 0.0;
  trial.plot("speed [m/s]", {{"g (sin - mu cos) t at 1 s", a}});
  trial.run(sim, 1.0, [&](const Runner& s) {
    hover = std::max(hover, s.state().q.segment<3>(q).dot(normal) - 0.1);
    trial.draw(s, s.state().v.segment<3>(v).norm());
  });
  // The force is constant, so the scheme's velocities are exact up to smoothing and compliance.
  trial.equal("speed after 1 s", "m/s", sim.state().v.segment<3>(v).norm(), a, 1e-6,
              "Newton and Coulomb: a = g (sin - mu cos)");
  trial.at_most("hover, largest", "m", hover, 1e-9, "Coulomb friction does not hop");
}

void sliding_stop(Trial& trial) {
  Runner& sim = trial.load("sliding_stop");
  const double v0 = 2.0, mu = 0.5, h = sim.options().time_step;
  const double way = v0 * v0 / (2.0 * mu * kCaseGravity);
  const int q = q_of(sim.model(), "block/body");
  double hover = 0.0;
  trial.plot("x [m]", {{"v0^2 / (2 mu g)", way}});
  trial.run(sim, 1.0, [&](const Runner& s) {
    hover = std::max(hover, s.state().q[q + 2] - 0.1);
    trial.draw(s, s.state().q[q]);
  });
  // Each step moves with the velocity at its end: h v0 / 2 less, and an error within the last step.
  trial.equal("stopping distance", "m", sim.state().q[q], way - 0.5 * h * v0,
              h * h * mu * kCaseGravity / 8.0 + 1e-8,
              "Coulomb: v0^2/(2 mu g), less the scheme's h v0/2");
  trial.at_most("sideways", "m", std::abs(sim.state().q[q + 1]), 1e-9, "symmetry");
  trial.at_most("hover, largest", "m", hover, 1e-9, "Coulomb friction does not hop");
}

void seams(Trial& trial) {
  Runner& sim = trial.load("seams");
  const double v0 = 2.0, mu = 0.2, h = sim.options().time_step;
  const double way = v0 * v0 / (2.0 * mu * kCaseGravity);
  const Model& model = sim.model();
  const std::array<const char*, 3> names = {"block", "plate", "can"};
  std::array<int, 3> q{};  // first coordinate of each
  for (std::size_t k = 0; k < names.size(); ++k)
    q[k] = q_of(model, std::string(names[k]) + "/body");
  const VectorX start = sim.state().q;
  double rise = 0.0;
  trial.plot("x of the block [m]", {{"v0^2 / (2 mu g)", way}});
  trial.run(sim, 1.1, [&](const Runner& s) {
    for (const int i : q) rise = std::max(rise, s.state().q[i + 2] - start[i + 2]);
    trial.draw(s, s.state().q[q[0]]);
  });
  for (std::size_t k = 0; k < names.size(); ++k) {
    trial.equal(std::string("stopping distance, ") + names[k], "m", sim.state().q[q[k]],
                way - 0.5 * h * v0, h * h * mu * kCaseGravity / 8.0 + 1e-8,
                "as on one plane: v0^2/(2 mu g), less the scheme's h v0/2");
  }
  trial.at_most("rise, largest", "m", rise, 1e-9, "tiles of one height are one plane");
  // The ball's edge contact ahead is tilted by about the distance of a step divided by its radius.
  trial.equal("speed of the ball", "m/s", sim.state().v[v_of(model, "ball/body")], 5.0 / 7.0 * v0,
              0.01 * v0, "5 v0/7 when rolling; 1 % of v0 by agreement");
}

void headings(Trial& trial) {
  Runner& sim = trial.load("headings");
  const VectorX start = sim.state().q;
  trial.run(sim, 0.6);
  double least = 1e9, most = 0.0, sum = 0.0, turned = 0.0;
  trial.chart.x_label = "heading [deg]";
  trial.plot("stopping distance [m]");
  for (int k = 0; k < 12; ++k) {
    const int q = q_of(sim.model(), "block" + std::to_string(k) + "/body");
    const Vector3 way = sim.state().q.segment<3>(q) - start.segment<3>(q);
    const double angle = std::numbers::pi / 6.0 * k;
    least = std::min(least, way.norm());
    most = std::max(most, way.norm());
    sum += way.norm() / 12.0;
    turned = std::max(turned, std::abs(way.x() * std::sin(angle) - way.y() * std::cos(angle)));
    trial.chart.curves[0].add(30.0 * k, way.norm());
  }
  trial.chart.levels = {{"v0^2 / (2 mu g)", 4.0 / kCaseGravity}};
  trial.at_most("spread of stopping distance, relative", "1", (most - least) / sum, 1e-8,
                "the cone is round: the same in every direction");
  trial.at_most("sideways, largest", "m", turned, 1e-8, "friction opposes the velocity");
  trial.equal("stopping distance, mean", "m", sum, 4.0 / kCaseGravity, 0.5 * 0.002 * 2.0 * 1.01,
              "Coulomb: v0^2/(2 mu g); h v0/2 of the scheme");
}

void push_ramp(Trial& trial) {
  Runner& sim = trial.load("push_ramp");
  const double mu = 0.4, h = sim.options().time_step, slip = mu * kCaseGravity / 20.0;
  const int q = q_of(sim.model(), "block/body"), v = v_of(sim.model(), "block/body");
  double slipped = -1.0;
  trial.plot("speed [m/s]");
  const long steps = std::lround(1.0 / h);
  for (long k = 0; k < steps; ++k) {
    sim.input().applied_force[v] = 20.0 * (static_cast<double>(k) + 0.5) * h;  // mean of the step
    trial.step(sim);
    const double speed = sim.state().v[v];
    if (slipped < 0.0 && speed > 1e-5) slipped = sim.state().time;
    trial.draw(sim, speed);
  }
  const double rest = 1.0 - slip;
  const double speed = 10.0 * (1.0 - slip * slip) - mu * kCaseGravity * rest;
  // Integral of 10 (t^2 - s^2) - mu g (t - s) from s to 1, with mu g = 20 s: 10 / 3 (1 - s)^3.
  const double way = 10.0 / 3.0 * rest * rest * rest;
  trial.chart.levels = {{"6.461 m/s at 1 s", speed}};
  trial.equal("slips at", "s", slipped, slip, 1.5 * h, "Coulomb: mu m g = 20 t N");
  trial.equal("speed at 1 s", "m/s", sim.state().v[v], speed, 1e-4, "its integral");
  trial.equal("way at 1 s", "m", sim.state().q[q], way, 0.51 * h * speed,
              "its integral; h v/2 of the scheme");
}

void sphere_rolls(Trial& trial) {
  Runner& sim = trial.load("sphere_rolls");
  const double v0 = 2.0, mu = 0.3, radius = 0.1;
  const double time = 2.0 * v0 / (7.0 * mu * kCaseGravity), speed = 5.0 / 7.0 * v0;
  const int v = v_of(sim.model(), "ball/body");
  double rolls = -1.0;
  trial.plot("speed [m/s]", {{"5/7 v0", speed}}, {"centre", "spin times radius"});
  View view(sim);
  trial.run(sim, 1.0, [&](const Runner& s) {
    view.look();
    const double centre = s.state().v[v], rim = view.spin(1).y() * radius;
    if (rolls < 0.0 && centre - rim < 1e-6) rolls = s.state().time;
    trial.draw(s, centre);
    trial.draw(s, rim, 1);
  });
  trial.equal("rolls from", "s", rolls, time, 1.5 * sim.options().time_step, "2 v0/(7 mu g)");
  trial.equal("speed when rolling", "m/s", sim.state().v[v], speed, 1e-6, "5 v0/7");
}

/// Friction 1.5 and 3 at a lean of 1 rad, where Painleve's bound is 1.37; sliding towards and away
/// from the lean.
void painleve_rod(Trial& trial) {
  Runner& sim = trial.load("painleve_rod");
  View view(sim);
  const double fastest = std::sqrt(4.0 + 2.0 * kCaseGravity * view.center(1).z());
  double speed = 0.0;
  trial.chart.y_label = "speed of the centre [m/s]";
  trial.chart.curves.resize(4);
  trial.chart.levels = {{"all energy in the centre's motion", fastest}};
  for (int i = 0; i < 4; ++i) {
    trial.chart.curves[static_cast<std::size_t>(i)].name =
        std::string(i < 2 ? "mu 1.5" : "mu 3") + (i % 2 ? ", away" : ", towards the lean");
  }
  trial.run(sim, 3.0, [&](const Runner& s) {
    view.look();
    for (int i = 0; i < 4; ++i) {
      const double now = view.velocity(i + 1).norm();
      speed = std::max(speed, now);
      trial.chart.curves[static_cast<std::size_t>(i)].add(s.state().time, now);
    }
  });
  trial.at_most("speed, largest", "m/s", speed, fastest,
                "energy; rigid Coulomb has no finite force for mu > (1 + 3 cos^2)/(3 sin cos)");
  trial.at_most("speed at the end", "m/s", sim.state().v.cwiseAbs().maxCoeff(), 1e-6,
                "friction brings it to rest (Stewart 2000: an impulsive solution exists)");
  trial.at_most("penetration, largest", "m", trial.max_penetration, 1e-6, "non-penetration");
}

void wedge(Trial& trial) {
  Runner& sim = trial.load("wedge");
  const double half_angle = 0.2, mu = 0.9;
  const double s = std::sin(half_angle), c = std::cos(half_angle);
  trial.run(sim, 0.6);
  const double seated = sim.state().q[2];
  double least = 1e9, most = 0.0;
  trial.plot("normal force of a wall [N]");
  for (int i = 0; i < 500; ++i) {
    const Forces forces = trial.step_and_recover(sim);
    double normal = 0.0;
    for (const ContactForce& f : forces.contacts)
      normal += 0.5 * std::abs(f.force.dot(f.contact.normal));
    least = std::min(least, normal);
    most = std::max(most, normal);
    trial.draw(sim, normal);
  }
  const double low = kCaseGravity / (2.0 * (s + mu * c));
  trial.chart.levels = {{"m g / (2 (sin + mu cos))", low}};
  trial.equal("height of its seat", "m", seated, 0.0, 1e-8, "geometry; 5 cm of fall before");
  trial.at_most("moves in the next second", "m", std::abs(sim.state().q[2] - seated), 1e-9,
                "self-locking: mu > tan(0.2)");
  trial.at_least("wall force, least", "N", least, low * (1.0 - 1e-6),
                 "weight m g = 2 (N sin + T cos), T <= mu N");
  trial.at_most("wall force, largest", "N", most, 10.0 * kCaseGravity,
                "finite: ten times its weight (a peer had 23 kN)");
}

void friction_extremes(Trial& trial) {
  Runner& sim = trial.load("friction_extremes");
  const Model& model = sim.model();
  const int ice = v_of(model, "ice/body"), wall = q_of(model, "wall/body");
  trial.run(sim, 1.0);
  const Vector3 before = sim.state().q.segment<3>(wall);
  trial.plot("speed of the frictionless block [m/s]");
  trial.run(sim, 4.0, [&](const Runner& s) { trial.draw(s, s.state().v[ice]); });
  trial.chart.levels = {{"1 m/s", 1.0}};
  trial.equal("friction 0: speed after 5 s", "m/s", sim.state().v[ice], 1.0, 1e-12,
              "Newton's first law");
  const double sine = 9.0 / std::hypot(9.0, 1.0), h = sim.options().time_step;
  const ContactOptions& options = sim.options().contact;
  trial.at_most("friction 10 on 84 degrees: creep", "m/s",
                (sim.state().q.segment<3>(wall) - before).norm() / 4.0,
                1.01 * options.compliance * kCaseGravity * h * sine + 10.0 * options.smoothing / h,
                "tan = 9 < mu: rests; eps g h sin(theta) + mu delta/h");
}

}  // namespace

std::vector<HardCase> friction_cases() {
  return {
      {"slope_rest", "Regularized friction creeps; a block inside its cone must not.", slope_rest},
      {"slope_slide", "Just outside the cone friction is full and the block must not hop.",
       slope_slide},
      {"sliding_stop", "Convex contact laws let a sliding body hover; the stop is a kink in time.",
       sliding_stop},
      {"seams", "The edge of the next tile is in the way of what slides on this one.", seams},
      {"headings", "Pyramid cones make friction depend on the direction.", headings},
      {"push_ramp", "The force grows through the limit of friction; the slip must start on time.",
       push_ramp},
      {"sphere_rolls", "Slip ends in rolling: friction drops from full to nothing within a step.",
       sphere_rolls},
      {"painleve_rod", "Painleve's paradox: rigid friction has no finite force here.",
       painleve_rod},
      {"wedge", "Jammed between walls the forces are not unique and can grow without limit.",
       wedge},
      {"friction_extremes", "No friction at all, and a coefficient of 10 on a slope of 84 degrees.",
       friction_extremes},
  };
}

}  // namespace counterpoint::apps
