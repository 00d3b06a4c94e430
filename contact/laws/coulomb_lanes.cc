#include "counterpoint/contact/laws/coulomb_lanes.h"

#include "counterpoint/contact/laws/coulomb.h"

namespace counterpoint::contact {
namespace {

struct Parameters {
  Four rho, slip, k, mu[2];
};
COUNTERPOINT_INTO_EACH void load_law(const CoulombFour& c, Parameters& to) {
  load(c.rho, to.rho);
  load(c.k, to.k);
  load(c.slip, to.slip);
  for (int i = 0; i < 2; ++i) load(c.mu[i], to.mu[i]);
}

// z = D y and |z_T|.
COUNTERPOINT_INTO_EACH void scale(const Parameters& law, const ThreeRows& y, ThreeRows& z,
                                  Four& t) {
  z.row[0] = y.row[0];
  for (int i = 0; i < 2; ++i) z.row[i + 1] = law.mu[i] * y.row[i + 1];
  square_root(z.row[1] * z.row[1] + z.row[2] * z.row[2], t);
}

COUNTERPOINT_WIDE void impulses_of(const CoulombFour* first, const CoulombFour* last,
                                   const double* y_all, double* f) {
  for (const CoulombFour* c = first; c != last; ++c) {
    Parameters law;
    ThreeRows y, z;
    Four t;
    load_law(*c, law);
    gather(y_all, c->row, y);
    scale(law, y, z, t);
    const CoulombAt<Four> cone(z.row[0], t, law.rho, law.rho, law.slip, law.k);
    scatter(cone.n, c->row, f);
    for (int i = 0; i < 2; ++i) scatter(-law.mu[i] * cone.b * z.row[i + 1], c->row, f + i + 1);
  }
}

COUNTERPOINT_WIDE void hessians_of(const CoulombFour* first, const CoulombFour* last,
                                   const double* y_all, double* hessian) {
  for (const CoulombFour* c = first; c != last; ++c) {
    Parameters law;
    ThreeRows y, z;
    Four t;
    load_law(*c, law);
    gather(y_all, c->row, y);
    scale(law, y, z, t);
    const CoulombAt<Four> cone(z.row[0], t, law.rho, law.rho, law.slip, law.k);
    const Four inverse = t > 0.0 ? 1.0 / t : Four{};
    const Four e[2] = {z.row[1] * inverse, z.row[2] * inverse};
    scatter_hessian(*c, {cone.n_slope, cone.p_slope, cone.b, -cone.p_by_n * cone.n_slope}, e,
                    hessian);
  }
}

COUNTERPOINT_WIDE void slope_of(const CoulombFour* first, const CoulombFour* last,
                                const double* y_all, const double* dy_all, Four& out_first,
                                Four& out_second) {
  Four sum_first{}, sum_second{};
  for (const CoulombFour* c = first; c != last; ++c) {
    Parameters law;
    ThreeRows y, z, dy, d;
    Four t, live;
    load_law(*c, law);
    load(c->live, live);
    gather(y_all, c->row, y);
    gather(dy_all, c->row, dy);
    scale(law, y, z, t);
    d.row[0] = dy.row[0];
    for (int i = 0; i < 2; ++i) d.row[i + 1] = law.mu[i] * dy.row[i + 1];
    const CoulombAt<Four> cone(z.row[0], t, law.rho, law.rho, law.slip, law.k);
    const Four dot = z.row[1] * d.row[1] + z.row[2] * d.row[2];
    const Four radial = t > 0.0 ? dot / t : Four{};
    const Four square = d.row[1] * d.row[1] + d.row[2] * d.row[2];
    const Four along = (cone.p_slope - cone.b) * radial - cone.p_by_n * cone.n_slope * d.row[0];
    sum_first += live * (cone.b * dot - cone.n * d.row[0]);
    sum_second += live * (cone.n_slope * d.row[0] * d.row[0] + cone.b * square + along * radial);
  }
  out_first = sum_first;
  out_second = sum_second;
}

}  // namespace

void CoulombLanes::clear() {
  fours_.clear();
  count_ = 0;
}

void CoulombLanes::add(const Law& law, double inverse_mass, int row, int hessian) {
  const int lane = count_++ % 4;
  if (lane == 0) fours_.emplace_back();
  CoulombFour& c = fours_.back();
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

void CoulombLanes::impulses(const double* y, double* f) const {
  impulses_of(fours_.data(), fours_.data() + fours_.size(), y, f);
}

void CoulombLanes::hessians(const double* y, double* hessian) const {
  hessians_of(fours_.data(), fours_.data() + fours_.size(), y, hessian);
}

Slope CoulombLanes::slope(const double* y, const double* dy) const {
  Four first, second;
  slope_of(fours_.data(), fours_.data() + fours_.size(), y, dy, first, second);
  return {(first[0] + first[1]) + (first[2] + first[3]),
          (second[0] + second[1]) + (second[2] + second[3])};
}

}  // namespace counterpoint::contact
