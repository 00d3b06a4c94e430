#include "counterpoint/engine/recovery.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace counterpoint {
namespace {

/// So much softer, a constraint takes no force that a double would see beside another.
constexpr double kNoForce = 1e30;

/// Of displacements, relative: they are corrected in the next step, and nothing else knows of them.
constexpr double kAccuracy = 1e-9;

/// b of the recovery in the row of a gap; NaN for constraints without.
double gap_bias_of(const ConstraintSet& constraints, int constraint) {
  const auto i = static_cast<size_t>(constraint);
  if (i < constraints.contacts.size()) return constraints.pairs[i].gap_bias;
  if (i < constraints.pairs.size()) return std::numeric_limits<double>::quiet_NaN();
  return constraints.joints[i - constraints.pairs.size()].gap_bias;
}

/// The law that the displacement knows of a constraint whose gap bias is b: no friction.
contact::Law displacement_law(const contact::Law& law, double b) {
  contact::Law out;
  out.rows = law.rows;
  out.regularizer = law.regularizer;
  if (law.type == contact::LawType::kEquality) {
    out.type = law.type;
  } else if (std::isnan(b)) {
    out.type = contact::LawType::kEquality;  // takes part in name only: rows stay in order
    out.regularizer *= kNoForce;
  } else {
    out.rows = 1;
    out.smoothing = law.smoothing;
    out.bias[0] = b;
  }
  return out;
}

/// J w of the first row of a constraint.
double first_row_velocity(const contact::Problem& problem, int constraint, const VectorRef& w) {
  double sum = 0.0;
  for (int side = 0; side < 2; ++side) {
    const int block = problem.block(constraint, side);
    if (block < 0) continue;
    sum += problem.jacobian(constraint, side)
               .row(0)
               .dot(w.segment(problem.block_start(block), problem.block_size(block)));
  }
  return sum;
}

/// Sets the velocities of blocks to 1 that constraints tie to something which overlaps too far for
/// w to recover what is to be, the others to 0. The other islands need no displacement. False if
/// there is none.
bool find_concerned(const ConstraintSet& constraints, const contact::Problem& solved,
                    const VectorRef& w, Eigen::Ref<VectorX> concerned) {
  bool changed = false;
  const auto holds = [&](int block) {
    return block >= 0 && concerned[solved.block_start(block)] > 0.0;
  };
  const auto take = [&](int block) {
    if (block < 0 || holds(block)) return;
    concerned.segment(solved.block_start(block), solved.block_size(block)).setOnes();
    changed = true;
  };
  concerned.setZero();
  for (int c = 0; c < solved.num_constraints(); ++c) {
    const double b = gap_bias_of(constraints, c);
    if (!(b < solved.law(c).bias[0]) || !(first_row_velocity(solved, c, w) + b < 0.0)) continue;
    take(solved.block(c, 0));
    take(solved.block(c, 1));
  }
  const bool any = changed;
  const auto spread = [&](int c) {
    const int one = solved.block(c, 0), other = solved.block(c, 1);
    if (holds(one)) take(other);
    if (holds(other)) take(one);
  };
  // Both ways, for chains in either order.
  while (std::exchange(changed, false)) {
    for (int c = 0; c < solved.num_constraints(); ++c) spread(c);
    for (int c = solved.num_constraints() - 1; c >= 0; --c) spread(c);
  }
  return any;
}

}  // namespace

Recovery::Found Recovery::find(const ConstraintSet& constraints, const contact::Problem& solved,
                               const contact::Settings& settings, const VectorRef& w) {
  if (p_.size() < solved.num_velocities()) p_.resize(solved.num_velocities());
  Eigen::Ref<VectorX> p = p_.head(solved.num_velocities());
  if (!find_concerned(constraints, solved, w, p)) return {};
  problem_.clear();
  for (int block = 0; block < solved.num_blocks(); ++block) {
    problem_.add_block(solved.block_size(block));
    problem_.mass(block) = solved.mass(block);
  }
  problem_.free_velocity().setZero();
  for (int c = 0; c < solved.num_constraints(); ++c) {
    if (!(p[solved.block_start(std::max(solved.block(c, 0), solved.block(c, 1)))] > 0.0)) continue;
    const double b = gap_bias_of(constraints, c);
    const double y = std::isnan(b) ? b : first_row_velocity(solved, c, w) + b;
    const contact::Law law = displacement_law(solved.law(c), y);
    const int added = problem_.add_constraint(law, solved.block(c, 0), solved.block(c, 1));
    for (int side = 0; side < 2; ++side)
      if (solved.block(c, side) >= 0)
        problem_.jacobian(added, side) = solved.jacobian(c, side).topRows(law.rows);
  }
  if (impulse_.size() < solved.num_rows()) impulse_.resize(solved.num_rows());
  p.setZero();
  contact::Settings looser = settings;
  looser.tolerance = std::max(settings.tolerance, kAccuracy);
  const contact::Report& report =
      solver_.solve(problem_, looser, p, Eigen::Ref<VectorX>(impulse_.head(problem_.num_rows())));
  return {true, report.status, report.iterations};
}

}  // namespace counterpoint
