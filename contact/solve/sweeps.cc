#include "counterpoint/contact/solve/sweeps.h"

#include <algorithm>
#include <cmath>

namespace counterpoint::contact {

void Sweeps::reserve(const IslandSystem& system) {
  responses_.reserve(system);
  laws_.reserve(system.constraints().size());
  f_.reserve(system.num_rows());
}

void Sweeps::begin(const IslandSystem& system) {
  system_ = &system;
  ready_ = false;
}

// Sets sigma to a bound on the constraint's response to its own impulses: the row sums of A_c bound
// its eigenvalues.
void Sweeps::find_widths(int constraint) {
  WideLaw& law = laws_[constraint];
  const double* own = responses_.own(constraint);
  double friction = 0.0;
  for (int r = 1; r < law.rows; ++r) {
    double sum = 0.0;
    for (int q = 1; q < law.rows; ++q) sum += std::abs(law.scale[q] * own[r * law.rows + q]);
    friction = std::max(friction, law.scale[r] * sum);
  }
  if (law.law->coulomb) {
    law.widen(own[0], friction);
  } else {
    law.widen(std::max(own[0], friction), std::max(own[0], friction));
  }
}

// Updates one constraint. Returns whether its impulse changes.
bool Sweeps::visit(int constraint, double smoothing, double negligible, MixedSystem::Point& point) {
  WideLaw& law = laws_[constraint];
  double x[kMaxRows], df[kMaxRows];
  system_->constraint_velocity(constraint, point.w.data(), x);
  double* phi = point.phi.data() + law.row;
  if (is_one_sided(law.law->type) && x[0] > 0.0) {  // open and without load
    const double root = std::sqrt(system_->constraints()[constraint].inverse_mass);
    double load = 0.0;
    for (int r = 0; r < law.rows; ++r) load = std::max(load, std::abs(phi[r]));
    if (root * load <= negligible && root * (law.law->smoothing + smoothing) <= negligible * x[0]) {
      return false;
    }
  }
  if (!responses_.knows(constraint)) find_widths(constraint);
  for (int r = 0; r < law.rows; ++r) x[r] = law.scale[r] * x[r] - law.widening(r) * phi[r];
  law.impulse(smoothing, x);
  double square = 0.0;
  for (int r = 0; r < law.rows; ++r) {
    const double change = x[r] - phi[r];
    square += law.wide(r) * change * change;
    df[r] = law.scale[r] * change;
  }
  if (!(square > negligible * negligible)) return false;
  std::copy_n(x, law.rows, phi);
  lean_impulse(*law.law, df);
  responses_.add(constraint, df, point.w.data());
  return true;
}

void Sweeps::start(MixedSystem::Point& point) {
  if (!ready_) {
    ready_ = true;
    possible_ = responses_.begin(*system_);
    laws_.clear();
    for (const auto& c : system_->constraints()) laws_.emplace_back(c, c.inverse_mass);
  }
  if (!possible_) return;
  f_.resize(system_->num_rows());
  for (const WideLaw& law : laws_) law.unscale(point.phi.data() + law.row, f_.data() + law.row);
  responses_.velocity(f_.data(), point.w.data());
}

void Sweeps::run(int count, double smoothing, double negligible, MixedSystem::Point& point) {
  if (!possible_) return;
  const int n = static_cast<int>(laws_.size());
  for (int sweep = 0; sweep < count; ++sweep) {
    bool changes = false;
    for (int i = 0; i < n; ++i) changes |= visit(i, smoothing, negligible, point);
    for (int i = n - 1; i >= 0; --i) changes |= visit(i, smoothing, negligible, point);
    if (!changes) break;
  }
}

}  // namespace counterpoint::contact
