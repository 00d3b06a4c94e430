#include "counterpoint/contact/laws/cone_lanes.h"

#include <span>

namespace counterpoint::contact {
namespace {

// Computes z = D y.
COUNTERPOINT_INTO_EACH void gather_scaled(const ConeFour& c, const Four* mu, const double* y_all,
                                          ThreeRows& z) {
  gather(y_all, c.row, z);
  for (int i = 0; i < 2; ++i) z.row[i + 1] = mu[i] * z.row[i + 1];
}

// Four laws with their scaled velocities z and t = |z_T|.
struct Scaled {
  Four rho, slip, k, mu[2], t;
  ThreeRows z;

  COUNTERPOINT_INTO_EACH Scaled(const ConeFour& c, const double* y_all) {
    load(c.rho, rho);
    load(c.k, k);
    load(c.slip, slip);
    for (int i = 0; i < 2; ++i) load(c.mu[i], mu[i]);
    gather_scaled(c, mu, y_all, z);
    square_root(z.row[1] * z.row[1] + z.row[2] * z.row[2], t);
  }
};

struct Coulomb : CoulombAt<Four> {
  COUNTERPOINT_INTO_EACH explicit Coulomb(const Scaled& at)
      : CoulombAt(at.z.row[0], at.t, at.rho, at.rho, at.slip, at.k) {}
};
struct Convex : ConvexAt<Four> {
  COUNTERPOINT_INTO_EACH explicit Convex(const Scaled& at)
      : ConvexAt(at.z.row[0], at.t, at.rho, at.k) {}
};

using Fours = std::span<const ConeFour>;

template <class Friction>
COUNTERPOINT_INTO_EACH void impulses_of(Fours fours, const double* y_all, double* f) {
  for (const ConeFour& c : fours) {
    const Scaled at(c, y_all);
    const Friction cone(at);
    scatter(cone.n, c.row, f);
    for (int i = 0; i < 2; ++i) scatter(-at.mu[i] * cone.b * at.z.row[i + 1], c.row, f + i + 1);
  }
}

template <class Friction>
COUNTERPOINT_INTO_EACH void hessians_of(Fours fours, const double* y_all, double* hessian) {
  for (const ConeFour& c : fours) {
    const Scaled at(c, y_all);
    SlopeFour slopes;
    slopes_of(Friction(at), slopes);
    const Four inverse = at.t > 0.0 ? 1.0 / at.t : Four{};
    const Four e[2] = {at.z.row[1] * inverse, at.z.row[2] * inverse};
    scatter_hessian(c, slopes, e, hessian);
  }
}

template <class Friction>
COUNTERPOINT_INTO_EACH void slope_of(Fours fours, const double* y_all, const double* dy_all,
                                     Four& out_first, Four& out_second) {
  Four sum_first{}, sum_second{};
  for (const ConeFour& c : fours) {
    const Scaled at(c, y_all);
    ThreeRows d;
    Four live;
    SlopeFour slopes;
    load(c.live, live);
    gather_scaled(c, at.mu, dy_all, d);
    const Friction cone(at);
    slopes_of(cone, slopes);
    const Four dot = at.z.row[1] * d.row[1] + at.z.row[2] * d.row[2];
    const Four radial = at.t > 0.0 ? dot / at.t : Four{};
    const Four square = d.row[1] * d.row[1] + d.row[2] * d.row[2];
    const Four along = (slopes.radial - cone.b) * radial +
                       (slopes.radial_normal + slopes.normal_radial) * d.row[0];
    sum_first += live * (cone.b * dot - cone.n * d.row[0]);
    sum_second += live * (slopes.normal * d.row[0] * d.row[0] + cone.b * square + along * radial);
  }
  out_first = sum_first;
  out_second = sum_second;
}

COUNTERPOINT_WIDE void impulses_of(bool coulomb, Fours fours, const double* y, double* f) {
  coulomb ? impulses_of<Coulomb>(fours, y, f) : impulses_of<Convex>(fours, y, f);
}
COUNTERPOINT_WIDE void hessians_of(bool coulomb, Fours fours, const double* y, double* hessian) {
  coulomb ? hessians_of<Coulomb>(fours, y, hessian) : hessians_of<Convex>(fours, y, hessian);
}
COUNTERPOINT_WIDE void slope_of(bool coulomb, Fours fours, const double* y, const double* dy,
                                Four& first, Four& second) {
  coulomb ? slope_of<Coulomb>(fours, y, dy, first, second)
          : slope_of<Convex>(fours, y, dy, first, second);
}

}  // namespace

void ConeLanes::clear() {
  fours_.clear();
  count_ = 0;
}

void ConeLanes::add(const Law& law, double inverse_mass, int row, int hessian) {
  const int lane = count_++ % 4;
  if (lane == 0) fours_.emplace_back();
  ConeFour& c = fours_.back();
  c.live[lane] = 1.0;
  for (int i = lane; i < (lane == 0 ? 4 : lane + 1); ++i) {
    c.row[i] = row;
    c.hessian[i] = hessian;
    c.rho[i] = normal_regularizer(law);
    c.k[i] = law.smoothing;
    c.slip[i] = scaled_slip_speed(law);
    for (int j = 0; j < 2; ++j) c.mu[j][i] = law.friction[j];
    c.inverse_mass[i] = inverse_mass;
  }
}

void ConeLanes::impulses(const double* y, double* f) const { impulses_of(coulomb_, fours_, y, f); }

void ConeLanes::hessians(const double* y, double* hessian) const {
  hessians_of(coulomb_, fours_, y, hessian);
}

Slope ConeLanes::slope(const double* y, const double* dy) const {
  Four first, second;
  slope_of(coulomb_, fours_, y, dy, first, second);
  return {(first[0] + first[1]) + (first[2] + first[3]),
          (second[0] + second[1]) + (second[2] + second[3])};
}

bool FrictionLanes::add(const Law& law, double inverse_mass, int row, int hessian) {
  for (ConeLanes* lanes : {&coulomb_, &convex_}) {
    if (!lanes->takes(law)) continue;
    lanes->add(law, inverse_mass, row, hessian);
    return true;
  }
  return false;
}

void FrictionLanes::add_slope(const double* y, const double* dy, Slope& sum) const {
  for (const ConeLanes* lanes : {&coulomb_, &convex_}) {
    const Slope slope = lanes->slope(y, dy);
    sum.first += slope.first;
    sum.second += slope.second;
  }
}

}  // namespace counterpoint::contact
