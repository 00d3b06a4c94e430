#include "counterpoint/engine/step/overlap_correction.h"

#include <algorithm>
#include <cmath>

namespace counterpoint {
namespace {

/// Factor of a regularizer that makes the force of a constraint vanish beside any other.
constexpr double kNoForce = 1e30;

/// Relative accuracy of displacements: the next step corrects their error, and no other result
/// depends on them.
constexpr double kAccuracy = 1e-9;

/// Returns the bias that removes the whole recoverable overlap [m/s]; NaN for constraints without a
/// gap. shifts: of the first rows of the problem (PrescribedMotion::shifts).
double gap_bias_of(const ConstraintSet& constraints, std::span<const double> shifts,
                   int constraint) {
  const auto i = static_cast<size_t>(constraint);
  const double shift = shifts.empty() ? 0.0 : shifts[i];
  if (i < constraints.contacts.size() && constraints.pairs[i].soft)
    return std::numeric_limits<double>::quiet_NaN();
  if (i < constraints.contacts.size()) return constraints.pairs[i].gap_bias + shift;
  if (i < constraints.pairs.size()) return std::numeric_limits<double>::quiet_NaN();
  return constraints.joints[i - constraints.pairs.size()].gap_bias + shift;
}

/// Returns J w of the first row of a constraint.
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

}  // namespace

contact::Law displacement_law(const contact::Law& law, double y, bool soft) {
  contact::Law out;
  out.rows = law.rows;
  out.regularizer = law.regularizer;
  if (soft) {
    out.type = contact::LawType::kEquality;
    out.rows = 1;
    out.regularizer = contact::normal_regularizer(law);
    if (law.bias[0] > 0.0) out.regularizer *= kNoForce;
  } else if (law.type == contact::LawType::kEquality) {
    out.type = law.type;
  } else if (std::isnan(y)) {
    out.type = contact::LawType::kEquality;  // without force; it keeps the order of rows
    out.regularizer *= kNoForce;
  } else {
    out.rows = 1;
    out.smoothing = law.smoothing;
    out.bias[0] = y;
  }
  return out;
}

bool OverlapCorrection::find_late_impulses(const ConstraintSet& constraints,
                                           const contact::Problem& solved, double h,
                                           const VectorRef& impulse) {
  Eigen::Ref<VectorX> p = p_.head(solved.num_velocities());
  late_.assign(static_cast<size_t>(solved.num_blocks()), 0);
  bool any = false;
  for (int c = 0; c < solved.num_constraints(); ++c) {
    if (static_cast<size_t>(c) >= constraints.contacts.size()) break;  // contacts come first
    const double time = constraints.pairs[static_cast<size_t>(c)].impact_time;
    const int first = solved.first_row(c), rows = solved.law(c).rows;
    if (!(time > 0.0) || !(impulse[first] > 0.0)) continue;
    if (!any) p.setZero();
    any = true;
    for (int side = 0; side < 2; ++side) {
      const int block = solved.block(c, side);
      if (block < 0) continue;
      late_[static_cast<size_t>(block)] = 1;
      p.segment(solved.block_start(block), solved.block_size(block)).noalias() -=
          time / h * solved.jacobian(c, side).transpose() * impulse.segment(first, rows);
    }
  }
  for (int block = 0; any && block < solved.num_blocks(); ++block) {
    if (!late_[static_cast<size_t>(block)]) continue;
    const int n = solved.block_size(block);
    if (mass_.rows() < n) mass_.resize(n, n);
    Eigen::Ref<MatrixX> factor = mass_.topLeftCorner(n, n);
    factor = solved.mass(block);
    const Eigen::LLT<Eigen::Ref<MatrixX>> in_place(factor);
    in_place.solveInPlace(p.segment(solved.block_start(block), n));
  }
  return any;
}

bool OverlapCorrection::find_concerned(const ConstraintSet& constraints,
                                       const contact::Problem& solved, const VectorRef& w,
                                       std::span<const double> shifts) {
  const auto block_of = [&](int c) { return std::max(solved.block(c, 0), solved.block(c, 1)); };
  const auto overlaps = [&](int c) {
    const double b = gap_bias_of(constraints, shifts, c);
    return b < solved.law(c).bias[0] && first_row_velocity(solved, c, w) + b < 0.0;
  };
  const int count = solved.num_constraints();
  const bool bounces = std::find(late_.begin(), late_.end(), 1) != late_.end();
  int c = 0;
  while (c < count && !overlaps(c)) ++c;
  if (c == count && !bounces) return false;
  islands_.reset(solved.num_blocks());
  for (int i = 0; i < count; ++i)
    if (solved.block(i, 0) >= 0 && solved.block(i, 1) >= 0)
      islands_.join(solved.block(i, 0), solved.block(i, 1));
  concerned_.assign(static_cast<size_t>(solved.num_blocks()), 0);
  for (; c < count; ++c)
    if (overlaps(c)) concerned_[static_cast<size_t>(islands_.root(block_of(c)))] = 1;
  for (int block = 0; bounces && block < solved.num_blocks(); ++block)
    if (late_[static_cast<size_t>(block)])
      concerned_[static_cast<size_t>(islands_.root(block))] = 1;
  for (int block = 0; block < solved.num_blocks(); ++block)
    concerned_[static_cast<size_t>(block)] = concerned_[static_cast<size_t>(islands_.root(block))];
  return true;
}

OverlapCorrection::Found OverlapCorrection::find(const ConstraintSet& constraints,
                                                 const contact::Problem& solved, double h,
                                                 const contact::Settings& settings,
                                                 const VectorRef& w, const VectorRef& impulse,
                                                 std::span<const double> shifts) {
  if (p_.size() < solved.num_velocities()) p_.resize(solved.num_velocities());
  Eigen::Ref<VectorX> p = p_.head(solved.num_velocities());
  const bool late = find_late_impulses(constraints, solved, h, impulse);
  if (!find_concerned(constraints, solved, w, shifts)) return {};
  if (!late) p.setZero();
  problem_.clear();
  for (int block = 0; block < solved.num_blocks(); ++block) {
    problem_.add_block(solved.block_size(block));
    problem_.mass(block) = solved.mass(block);
  }
  problem_.free_velocity() = p;
  for (int c = 0; c < solved.num_constraints(); ++c) {
    const int block = std::max(solved.block(c, 0), solved.block(c, 1));
    if (!concerned_[static_cast<size_t>(block)]) continue;
    const double b = gap_bias_of(constraints, shifts, c);
    const double y = std::isnan(b) ? b : first_row_velocity(solved, c, w) + b;
    const bool soft = static_cast<size_t>(c) < constraints.contacts.size() &&
                      constraints.pairs[static_cast<size_t>(c)].soft;
    const contact::Law law = displacement_law(solved.law(c), y, soft);
    const int added = problem_.add_constraint(law, solved.block(c, 0), solved.block(c, 1));
    for (int side = 0; side < 2; ++side)
      if (solved.block(c, side) >= 0)
        problem_.jacobian(added, side) = solved.jacobian(c, side).topRows(law.rows);
  }
  if (impulse_.size() < solved.num_rows()) impulse_.resize(solved.num_rows());
  contact::Settings looser = settings;
  looser.tolerance = std::max(settings.tolerance, kAccuracy);
  // These laws are convex and the inverse does not use them, so they may be softened as usual.
  looser.soften_after = contact::Settings().soften_after;
  const contact::Report& report =
      solver_.solve(problem_, looser, p, Eigen::Ref<VectorX>(impulse_.head(problem_.num_rows())));
  return {true, report.status, report.iterations};
}

}  // namespace counterpoint
