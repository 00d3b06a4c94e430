#include "counterpoint/contact/solve/mixed_lanes.h"

#include <algorithm>

#include "counterpoint/contact/laws/coulomb.h"

namespace counterpoint::contact {
namespace {

COUNTERPOINT_INTO_EACH void load_operator(const MixedFour::Operator& from, SlopeFour& to) {
  load(from.normal, to.normal);
  load(from.radial, to.radial);
  load(from.across, to.across);
  load(from.radial_normal, to.radial_normal);
}
COUNTERPOINT_INTO_EACH void store_operator(const SlopeFour& from, MixedFour::Operator& to) {
  store(from.normal, to.normal);
  store(from.radial, to.radial);
  store(from.across, to.across);
  store(from.radial_normal, to.radial_normal);
}

COUNTERPOINT_INTO_EACH void apply(const SlopeFour& op, const Four* t, const ThreeRows& x,
                                  ThreeRows& out) {
  const Four along = t[0] * x.row[1] + t[1] * x.row[2];
  const Four radial = op.radial_normal * x.row[0] + (op.radial - op.across) * along;
  out.row[0] = op.normal * x.row[0];
  for (int i = 0; i < 2; ++i) out.row[i + 1] = op.across * x.row[i + 1] + radial * t[i];
}

COUNTERPOINT_INTO_EACH void scale_friction(const ConeFour& c, ThreeRows& x) {
  for (int i = 0; i < 2; ++i) {
    Four mu;
    load(c.mu[i], mu);
    x.row[i + 1] = mu * x.row[i + 1];
  }
}

COUNTERPOINT_WIDE void impulses_of(const ConeFour* first, const ConeFour* last,
                                   const MixedFour* mixed, const double* y, double center,
                                   double* phi) {
  for (const ConeFour* c = first; c != last; ++c, ++mixed) {
    ThreeRows z;
    Four t, k, slip, sigma, sigma_T;
    load(c->k, k);
    load(c->slip, slip);
    load(mixed->sigma, sigma);
    load(mixed->sigma_T, sigma_T);
    gather(y, c->row, z);
    scale_friction(*c, z);
    square_root(z.row[1] * z.row[1] + z.row[2] * z.row[2], t);
    const CoulombAt<Four> cone(z.row[0], t, sigma, sigma_T, slip, k + center);
    scatter(cone.n, c->row, phi);
    for (int i = 1; i < 3; ++i) scatter(-cone.b * z.row[i], c->row, phi + i);
  }
}

COUNTERPOINT_WIDE void evaluate_all(const ConeFour* first, const ConeFour* last, MixedFour* mixed,
                                    const double* y, const double* phi_all, double center,
                                    Four& square_out) {  // Parameters: matrices and their places
  Four square{};
  for (const ConeFour* c = first; c != last; ++c, ++mixed) {
    ThreeRows x, phi, e;
    Four t, k, slip, rho, sigma, sigma_T, live;
    load(c->k, k);
    load(c->slip, slip);
    load(c->rho, rho);
    load(c->live, live);
    load(mixed->sigma, sigma);
    load(mixed->sigma_T, sigma_T);
    gather(y, c->row, x);
    gather(phi_all, c->row, phi);
    scale_friction(*c, x);
    x.row[0] -= (sigma - rho) * phi.row[0];
    for (int i = 1; i < 3; ++i) x.row[i] -= (sigma_T - rho) * phi.row[i];
    square_root(x.row[1] * x.row[1] + x.row[2] * x.row[2], t);
    const CoulombAt<Four> cone(x.row[0], t, sigma, sigma_T, slip, k + center);
    const Four inverse = t > 0.0 ? 1.0 / t : Four{};
    e.row[0] = cone.n - phi.row[0];
    for (int i = 1; i < 3; ++i) {
      e.row[i] = -cone.b * x.row[i] - phi.row[i];
      store(x.row[i] * inverse, mixed->t[i - 1]);
    }
    for (int i = 0; i < 3; ++i) store(e.row[i], mixed->error[i]);
    store_operator({cone.n_slope, cone.p_slope, cone.b, -cone.p_by_n * cone.n_slope}, mixed->A);
    square += live * (sigma * (e.row[0] * e.row[0]) +
                      sigma_T * (e.row[1] * e.row[1] + e.row[2] * e.row[2]));
  }
  square_out = square;
}

COUNTERPOINT_WIDE void hessians_of(const ConeFour* first, const ConeFour* last, MixedFour* mixed,
                                   double* hessian) {
  for (const ConeFour* c = first; c != last; ++c, ++mixed) {
    Four rho, sigma, sigma_T, t[2];
    SlopeFour A, B;
    load(c->rho, rho);
    load(mixed->sigma, sigma);
    load(mixed->sigma_T, sigma_T);
    for (int i = 0; i < 2; ++i) load(mixed->t[i], t[i]);
    load_operator(mixed->A, A);
    const Four d = sigma - rho, d_T = sigma_T - rho;
    B.normal = 1.0 / (1.0 - d * A.normal);
    B.radial = 1.0 / (1.0 - d_T * A.radial);
    B.across = 1.0 / (1.0 - d_T * A.across);
    B.radial_normal = d * A.radial_normal * (B.normal * B.radial);
    store_operator(B, mixed->B);
    scatter_hessian(*c,
                    {B.normal * A.normal, B.radial * A.radial, B.across * A.across,
                     B.radial_normal * A.normal + B.radial * A.radial_normal},
                    t, hessian);
  }
}

COUNTERPOINT_WIDE void right_side_of(const ConeFour* first, const ConeFour* last,
                                     const MixedFour* mixed, double* rhs) {
  for (const ConeFour* c = first; c != last; ++c, ++mixed) {
    Four t[2];
    SlopeFour B;
    ThreeRows e, out;
    for (int i = 0; i < 2; ++i) load(mixed->t[i], t[i]);
    for (int i = 0; i < 3; ++i) load(mixed->error[i], e.row[i]);
    load_operator(mixed->B, B);
    apply(B, t, e, out);
    scale_friction(*c, out);
    for (int i = 0; i < 3; ++i) scatter(out.row[i], c->row, rhs + i);
  }
}

COUNTERPOINT_WIDE void step_of(const ConeFour* first, const ConeFour* last, const MixedFour* mixed,
                               const double* dy, double* dphi) {
  for (const ConeFour* c = first; c != last; ++c, ++mixed) {
    Four t[2];
    SlopeFour A, B;
    ThreeRows dz, x, out;
    for (int i = 0; i < 2; ++i) load(mixed->t[i], t[i]);
    load_operator(mixed->A, A);
    load_operator(mixed->B, B);
    gather(dy, c->row, dz);
    scale_friction(*c, dz);
    apply(A, t, dz, x);
    for (int i = 0; i < 3; ++i) {
      Four e;
      load(mixed->error[i], e);
      x.row[i] = e - x.row[i];
    }
    apply(B, t, x, out);
    for (int i = 0; i < 3; ++i) scatter(out.row[i], c->row, dphi + i);
  }
}

}  // namespace

void MixedLanes::reserve(int num_constraints) { fours_.reserve((num_constraints + 3) / 4); }

void MixedLanes::begin(const ConeLanes& lanes, double sigma_share) {
  lanes_ = &lanes;
  fours_.resize(lanes.fours().size());
  for (size_t i = 0; i < fours_.size(); ++i) {
    const ConeFour& c = lanes.fours()[i];
    for (int l = 0; l < 4; ++l) {
      const double sigma = std::max(c.rho[l], sigma_share * c.inverse_mass[l]);
      fours_[i].sigma[l] = sigma;
      fours_[i].sigma_T[l] = std::max(c.rho[l], sigma * c.mu[0][l]);
    }
  }
}

void MixedLanes::impulses(const double* y, double center, double* phi) const {
  const auto& fours = lanes_->fours();
  impulses_of(fours.data(), fours.data() + fours.size(), fours_.data(), y, center, phi);
}

double MixedLanes::evaluate(const double* y, const double* phi, double center) {
  const auto& fours = lanes_->fours();
  Four square;
  evaluate_all(fours.data(), fours.data() + fours.size(), fours_.data(), y, phi, center, square);
  return (square[0] + square[1]) + (square[2] + square[3]);
}

void MixedLanes::hessians(double* hessian) {
  const auto& fours = lanes_->fours();
  hessians_of(fours.data(), fours.data() + fours.size(), fours_.data(), hessian);
}

void MixedLanes::right_side(double* rhs) const {
  const auto& fours = lanes_->fours();
  right_side_of(fours.data(), fours.data() + fours.size(), fours_.data(), rhs);
}

void MixedLanes::step(const double* dy, double* dphi) const {
  const auto& fours = lanes_->fours();
  step_of(fours.data(), fours.data() + fours.size(), fours_.data(), dy, dphi);
}

}  // namespace counterpoint::contact
