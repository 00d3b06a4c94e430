#include "counterpoint/contact/laws/cone_lanes.h"

#include <span>

namespace counterpoint::contact {
namespace {

using Fours = std::span<const ConeFour>;
constexpr int kRows = ConeFour::kRows;

COUNTERPOINT_INTO_EACH ConeLaw<Four> cone_law(const ConeFour& c) {
  return {c.rho, c.rho_T, c.slip, c.k};
}

template <template <class> class Cone>
COUNTERPOINT_INTO_EACH void impulses_of(Fours fours, const double* y, double* f) {
  for (const ConeFour& c : fours) {
    Four z[kRows];
    c.gather_scaled(y, z);
    const Cone<Four> cone = cone_at<Cone>(cone_law(c), kRows, z);
    c.scatter(cone.n, 0, f);
    for (int i = 1; i < kRows; ++i) c.scatter(-c.scale[i] * cone.b * z[i], i, f);
  }
}

template <template <class> class Cone>
COUNTERPOINT_INTO_EACH void hessians_of(Fours fours, const double* y, double* hessian) {
  for (const ConeFour& c : fours) {
    Four z[kRows], e[kRows];
    ConeMap<Four> A;
    c.gather_scaled(y, z);
    evaluate_cone<Cone>(cone_law(c), kRows, z, e, A);
    c.scatter_hessian(A, e, hessian);
  }
}

template <template <class> class Cone>
COUNTERPOINT_INTO_EACH void add_slope_of(Fours fours, const double* y, const double* dy,
                                         Slope& sum) {
  Four first{}, second{};
  for (const ConeFour& c : fours) {
    Four z[kRows], d[kRows], e[kRows], change[kRows];
    ConeMap<Four> A;
    c.gather_scaled(y, z);
    c.gather_scaled(dy, d);
    evaluate_cone<Cone>(cone_law(c), kRows, z, e, A);
    A.apply(kRows, e, d, change);
    for (int i = 0; i < kRows; ++i) {
      first -= c.live * (z[i] * d[i]);
      second += c.live * (d[i] * change[i]);
    }
  }
  sum.first += sum_lanes(first);
  sum.second += sum_lanes(second);
}

}  // namespace

void FrictionLanes::clear() {
  for (Kind* kind : {&coulomb_, &convex_}) {
    kind->count = 0;
    kind->fours.clear();
  }
}

void FrictionLanes::reserve(size_t count) {
  for (Kind* kind : {&coulomb_, &convex_}) kind->fours.reserve((count + 3) / 4);
}

bool FrictionLanes::add(const Law& law, double inverse_mass, int row, int hessian) {
  if (law.type != LawType::kFrictionCone || law.rows != kRows || leans(law)) return false;
  Kind& kind = law.coulomb ? coulomb_ : convex_;
  const int lane = kind.count++ % 4;
  if (lane == 0) kind.fours.emplace_back();
  ConeFour& c = kind.fours.back();
  c.live[lane] = 1.0;
  const double rho = normal_regularizer(law), rho_T = friction_regularizer(law);
  const double slip = scaled_slip_speed(law);
  for (int i = lane; i < (lane == 0 ? 4 : lane + 1); ++i) {
    c.row[i] = row;
    c.hessian[i] = hessian;
    c.rho[i] = rho;
    c.rho_T[i] = rho_T;
    c.k[i] = law.smoothing;
    c.slip[i] = slip;
    c.inverse_mass[i] = inverse_mass;
    for (int r = 0; r < kRows; ++r) c.scale[r][i] = r > 0 ? law.friction[r - 1] : 1.0;
  }
  return true;
}

COUNTERPOINT_WIDE void FrictionLanes::impulses(const double* y, double* f) const {
  impulses_of<CoulombCone>(coulomb_.fours, y, f);
  impulses_of<ConvexCone>(convex_.fours, y, f);
}

COUNTERPOINT_WIDE void FrictionLanes::hessians(const double* y, double* hessian) const {
  hessians_of<CoulombCone>(coulomb_.fours, y, hessian);
  hessians_of<ConvexCone>(convex_.fours, y, hessian);
}

COUNTERPOINT_WIDE void FrictionLanes::add_slope(const double* y, const double* dy,
                                                Slope& sum) const {
  add_slope_of<CoulombCone>(coulomb_.fours, y, dy, sum);
  add_slope_of<ConvexCone>(convex_.fours, y, dy, sum);
}

}  // namespace counterpoint::contact
