#include "counterpoint/contact/solve/mixed_lanes.h"

#include <algorithm>
#include <span>

namespace counterpoint::contact {
namespace {

COUNTERPOINT_INTO_EACH void load_operator(const MixedFour::Operator& from, SlopeFour& to) {
  load(from.normal, to.normal);
  load(from.radial, to.radial);
  load(from.across, to.across);
  load(from.radial_normal, to.radial_normal);
  load(from.normal_radial, to.normal_radial);
}
COUNTERPOINT_INTO_EACH void store_operator(const SlopeFour& from, MixedFour::Operator& to) {
  store(from.normal, to.normal);
  store(from.radial, to.radial);
  store(from.across, to.across);
  store(from.radial_normal, to.radial_normal);
  store(from.normal_radial, to.normal_radial);
}

// Four laws, widened, with `extra_smoothing` added to their smoothing.
struct Widened {
  Four k, slip, rho, sigma, sigma_T;

  COUNTERPOINT_INTO_EACH Widened(const ConeFour& c, const MixedFour& mixed,
                                 double extra_smoothing) {
    load(c.k, k);
    load(c.slip, slip);
    load(c.rho, rho);
    load(mixed.sigma, sigma);
    load(mixed.sigma_T, sigma_T);
    k += extra_smoothing;
  }
};

struct MixedCoulomb : CoulombAt<Four> {
  static constexpr bool kTriangular = true;  // the normal impulse does not depend on friction
  COUNTERPOINT_INTO_EACH MixedCoulomb(const Widened& law, const Four& normal, const Four& t)
      : CoulombAt(normal, t, law.sigma, law.sigma_T, law.slip, law.k) {}
};
struct MixedConvex : ConvexAt<Four> {
  static constexpr bool kTriangular = false;
  COUNTERPOINT_INTO_EACH MixedConvex(const Widened& law, const Four& normal, const Four& t)
      : ConvexAt(normal, t, law.sigma, law.k) {}
};

template <class Friction>
COUNTERPOINT_INTO_EACH void apply(const SlopeFour& op, const Four* t, const ThreeRows& x,
                                  ThreeRows& out) {
  const Four along = t[0] * x.row[1] + t[1] * x.row[2];
  const Four radial = op.radial_normal * x.row[0] + (op.radial - op.across) * along;
  out.row[0] = op.normal * x.row[0];
  if constexpr (!Friction::kTriangular) out.row[0] += op.normal_radial * along;
  for (int i = 0; i < 2; ++i) out.row[i + 1] = op.across * x.row[i + 1] + radial * t[i];
}

COUNTERPOINT_INTO_EACH void scale_friction(const ConeFour& c, ThreeRows& x) {
  for (int i = 0; i < 2; ++i) {
    Four mu;
    load(c.mu[i], mu);
    x.row[i + 1] = mu * x.row[i + 1];
  }
}

struct Lanes {
  std::span<const ConeFour> fours;
  MixedFour* mixed;
  bool coulomb;
};

template <class Friction>
COUNTERPOINT_INTO_EACH void find_impulses(const Lanes& lanes, const double* y,
                                          double extra_smoothing, double* phi) {
  MixedFour* mixed = lanes.mixed;
  for (const ConeFour& c : lanes.fours) {
    const Widened law(c, *mixed++, extra_smoothing);
    ThreeRows z;
    Four t;
    gather(y, c.row, z);
    scale_friction(c, z);
    square_root(z.row[1] * z.row[1] + z.row[2] * z.row[2], t);
    const Friction cone(law, z.row[0], t);
    scatter(cone.n, c.row, phi);
    for (int i = 1; i < 3; ++i) scatter(-cone.b * z.row[i], c.row, phi + i);
  }
}

template <class Friction>
COUNTERPOINT_INTO_EACH void find_errors(const Lanes& lanes, const double* y, const double* phi_all,
                                        double extra_smoothing, Four& square_out) {
  Four square{};
  MixedFour* mixed = lanes.mixed;
  for (const ConeFour& c : lanes.fours) {
    const Widened law(c, *mixed, extra_smoothing);
    ThreeRows x, phi, e;
    Four t, live;
    SlopeFour slopes;
    load(c.live, live);
    gather(y, c.row, x);
    gather(phi_all, c.row, phi);
    scale_friction(c, x);
    x.row[0] -= (law.sigma - law.rho) * phi.row[0];
    for (int i = 1; i < 3; ++i) x.row[i] -= (law.sigma_T - law.rho) * phi.row[i];
    square_root(x.row[1] * x.row[1] + x.row[2] * x.row[2], t);
    const Friction cone(law, x.row[0], t);
    const Four inverse = t > 0.0 ? 1.0 / t : Four{};
    e.row[0] = cone.n - phi.row[0];
    for (int i = 1; i < 3; ++i) {
      e.row[i] = -cone.b * x.row[i] - phi.row[i];
      store(x.row[i] * inverse, mixed->t[i - 1]);
    }
    for (int i = 0; i < 3; ++i) store(e.row[i], mixed->error[i]);
    slopes_of(cone, slopes);
    store_operator(slopes, mixed++->A);
    square += live * (law.sigma * (e.row[0] * e.row[0]) +
                      law.sigma_T * (e.row[1] * e.row[1] + e.row[2] * e.row[2]));
  }
  square_out = square;
}

template <class Friction>
COUNTERPOINT_INTO_EACH void find_hessians(const Lanes& lanes, double* hessian) {
  MixedFour* mixed = lanes.mixed;
  for (const ConeFour& c : lanes.fours) {
    const Widened law(c, *mixed, 0.0);
    Four t[2];
    SlopeFour A, B;
    for (int i = 0; i < 2; ++i) load(mixed->t[i], t[i]);
    load_operator(mixed->A, A);
    const Four d = law.sigma - law.rho, d_T = law.sigma_T - law.rho;
    const Four normal = 1.0 - d * A.normal, radial = 1.0 - d_T * A.radial;
    B.across = 1.0 / (1.0 - d_T * A.across);
    if constexpr (Friction::kTriangular) {
      B.normal = 1.0 / normal;
      B.radial = 1.0 / radial;
      B.radial_normal = d * A.radial_normal * (B.normal * B.radial);
    } else {
      const Four determinant = normal * radial - (d_T * A.normal_radial) * (d * A.radial_normal);
      B.normal = radial / determinant;
      B.radial = normal / determinant;
      B.radial_normal = d * A.radial_normal / determinant;
      B.normal_radial = d_T * A.normal_radial / determinant;
    }
    store_operator(B, mixed++->B);
    SlopeFour G{B.normal * A.normal, B.radial * A.radial, B.across * A.across,
                B.radial_normal * A.normal + B.radial * A.radial_normal};
    if constexpr (!Friction::kTriangular) {
      G.normal += B.normal_radial * A.radial_normal;
      G.radial += B.radial_normal * A.normal_radial;
      G.normal_radial = B.normal * A.normal_radial + B.normal_radial * A.radial;
    }
    scatter_hessian(c, G, t, hessian);
  }
}

template <class Friction>
COUNTERPOINT_INTO_EACH void find_right_side(const Lanes& lanes, double* rhs) {
  const MixedFour* mixed = lanes.mixed;
  for (const ConeFour& c : lanes.fours) {
    Four t[2];
    SlopeFour B;
    ThreeRows e, out;
    for (int i = 0; i < 2; ++i) load(mixed->t[i], t[i]);
    for (int i = 0; i < 3; ++i) load(mixed->error[i], e.row[i]);
    load_operator(mixed++->B, B);
    apply<Friction>(B, t, e, out);
    scale_friction(c, out);
    for (int i = 0; i < 3; ++i) scatter(out.row[i], c.row, rhs + i);
  }
}

template <class Friction>
COUNTERPOINT_INTO_EACH void find_step(const Lanes& lanes, const double* dy, double* dphi) {
  const MixedFour* mixed = lanes.mixed;
  for (const ConeFour& c : lanes.fours) {
    Four t[2];
    SlopeFour A, B;
    ThreeRows dz, x, out;
    for (int i = 0; i < 2; ++i) load(mixed->t[i], t[i]);
    load_operator(mixed->A, A);
    load_operator(mixed->B, B);
    gather(dy, c.row, dz);
    scale_friction(c, dz);
    apply<Friction>(A, t, dz, x);
    for (int i = 0; i < 3; ++i) {
      Four e;
      load(mixed->error[i], e);
      x.row[i] = e - x.row[i];
    }
    ++mixed;
    apply<Friction>(B, t, x, out);
    for (int i = 0; i < 3; ++i) scatter(out.row[i], c.row, dphi + i);
  }
}

COUNTERPOINT_WIDE void impulses_of(const Lanes& lanes, const double* y, double extra_smoothing,
                                   double* phi) {
  lanes.coulomb ? find_impulses<MixedCoulomb>(lanes, y, extra_smoothing, phi)
                : find_impulses<MixedConvex>(lanes, y, extra_smoothing, phi);
}
COUNTERPOINT_WIDE void errors_of(const Lanes& lanes, const double* y, const double* phi,
                                 double extra_smoothing, Four& square) {
  lanes.coulomb ? find_errors<MixedCoulomb>(lanes, y, phi, extra_smoothing, square)
                : find_errors<MixedConvex>(lanes, y, phi, extra_smoothing, square);
}
COUNTERPOINT_WIDE void hessians_of(const Lanes& lanes, double* hessian) {
  lanes.coulomb ? find_hessians<MixedCoulomb>(lanes, hessian)
                : find_hessians<MixedConvex>(lanes, hessian);
}
COUNTERPOINT_WIDE void right_side_of(const Lanes& lanes, double* rhs) {
  lanes.coulomb ? find_right_side<MixedCoulomb>(lanes, rhs)
                : find_right_side<MixedConvex>(lanes, rhs);
}
COUNTERPOINT_WIDE void step_of(const Lanes& lanes, const double* dy, double* dphi) {
  lanes.coulomb ? find_step<MixedCoulomb>(lanes, dy, dphi)
                : find_step<MixedConvex>(lanes, dy, dphi);
}

Lanes lanes_of(const ConeLanes& lanes, std::vector<MixedFour>& mixed) {
  return {lanes.fours(), mixed.data(), lanes.coulomb()};
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
      fours_[i].sigma_T[l] = lanes.coulomb() ? std::max(c.rho[l], sigma * c.mu[0][l]) : sigma;
    }
  }
}

void MixedLanes::impulses(const double* y, double extra_smoothing, double* phi) {
  impulses_of(lanes_of(*lanes_, fours_), y, extra_smoothing, phi);
}

double MixedLanes::evaluate(const double* y, const double* phi, double extra_smoothing) {
  Four square;
  errors_of(lanes_of(*lanes_, fours_), y, phi, extra_smoothing, square);
  return (square[0] + square[1]) + (square[2] + square[3]);
}

void MixedLanes::hessians(double* hessian) { hessians_of(lanes_of(*lanes_, fours_), hessian); }

void MixedLanes::right_side(double* rhs) { right_side_of(lanes_of(*lanes_, fours_), rhs); }

void MixedLanes::step(const double* dy, double* dphi) {
  step_of(lanes_of(*lanes_, fours_), dy, dphi);
}

}  // namespace counterpoint::contact
