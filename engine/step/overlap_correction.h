// Correction of overlaps: bodies that overlap are displaced apart and keep no velocity from it.
//
// Velocities w+ of a step recover overlaps at no more than LawOptions::kept_recovery
// (contact_law.h). The rest is left to a second, frictionless problem for a displacement velocity
// p, which is discarded at the end of the step:
//
//   minimize over p   1/2 |p|_M^2 + sum_i l_i(J_i (w+ + p) + b_i),     q+ = q (+) h (w+ + p)
//
// with J_i the normal rows and limits, b_i the bias that removes the whole recoverable overlap, and
// equalities J p = 0. The impulses of the step are functions of w+ alone, so its inverse does not
// depend on p. The method follows split impulses (Catto 2006; Guendelman, Bridson and Fedkiw 2003
// use a separate pass as well); here the problem is convex.
//
// Some impacts with restitution happen within the step, at impact_time > 0 (bounce.h). A
// displacement also cancels the effect that their impulses f would have before their time t,
//
//   p0 = -inv(M) sum (t / h) J' f,     minimize over p   1/2 |p - p0|_M^2 + sum l_i(...)
//
// which puts bodies in free flight where the exact bounce has them.
#pragma once

#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/constraint_set.h"

namespace counterpoint {

/// Returns the law that p obeys at a constraint whose first row has the velocity y = J w+ + b
/// [m/s], with b the gap bias: the normal law without friction. Equalities stay, without a bias.
/// Any other law without a gap (y is NaN) carries no force. A soft contact in overlap resists p by
/// its spring and damper.
contact::Law displacement_law(const contact::Law& law, double y, bool soft = false);

/// Finds p. Scratch memory inside: one per thread; it grows at the first overlap of a size.
class OverlapCorrection {
 public:
  struct Found {
    bool needed = false;  ///< w leaves a part of an overlap, or a contact bounces
    contact::Status status = contact::Status::kConverged;
    int iterations = 0;  ///< Newton steps
  };

  /// Finds velocity(), if it is needed, for the velocities w and impulses of a solved problem of
  /// these constraints and a step of h [s]. It solves the islands concerned to 1e-9; its blocks are
  /// those of the solved problem. shifts: PrescribedMotion::shifts of that problem, or empty.
  Found find(const ConstraintSet& constraints, const contact::Problem& solved, double h,
             const contact::Settings& settings, const VectorRef& w, const VectorRef& impulse,
             std::span<const double> shifts = {});

  /// Lets threads share the islands (contact::Solver::use).
  void use(contact::ThreadPool* pool) { solver_.use(pool); }

  /// The displacement velocity p [m/s, rad/s].
  VectorRef velocity() const { return p_.head(problem_.num_velocities()); }
  /// Whether a block of the problem may be displaced.
  bool concerns(int block) const { return concerned_[static_cast<size_t>(block)] != 0; }
  VectorRef impulse() const { return impulse_.head(problem_.num_rows()); }
  const contact::Problem& problem() const { return problem_; }

 private:
  /// Sets p_ to p0. False if nothing bounces.
  bool find_late_impulses(const ConstraintSet& constraints, const contact::Problem& solved,
                          double h, const VectorRef& impulse);
  /// Marks the islands with a bounce, or with an overlap that w leaves in part; the others need no
  /// displacement. False if there is none.
  bool find_concerned(const ConstraintSet& constraints, const contact::Problem& solved,
                      const VectorRef& w, std::span<const double> shifts);

  contact::DisjointSets islands_;
  std::vector<char> concerned_;  ///< per block
  contact::Problem problem_;
  contact::Solver solver_;
  std::vector<char> late_;  ///< per block: an impact happens within the step
  MatrixX mass_;
  VectorX p_, impulse_;  ///< only grow, since Eigen allocates at every change of size
};

}  // namespace counterpoint
