// Recovery of overlaps without speed: bodies that overlap are displaced apart, and keep no velocity
// from it.
//
// Velocities w+ of a step recover overlaps at no more than kKeptRecovery max_recovery_speed. What
// is missing is a second, frictionless problem, for a displacement velocity p that is forgotten
// once the step is over:
//
//   minimize over p   1/2 |p|_M^2 + sum_i l_i(J_i (w+ + p) + b_i),     q+ = q (+) h (w+ + p)
//
// with J_i the normal rows and limits, b_i the bias that recovers all that is to be, equalities
// J p = 0. The impulses of the step are functions of w+ as before, so its inverse knows nothing of
// p. After the split impulses of games (Catto 2006; Guendelman, Bridson and Fedkiw 2003 push apart
// in a separate pass as well); convex here.
//
// Impacts with restitution fall into the step, not on its start (bounce.h). What their impulses f
// did before their time t is taken back by a displacement as well,
//
//   p0 = -inv(M) sum (t / h) J' f,     minimize over p   1/2 |p - p0|_M^2 + sum l_i(...)
//
// so that in free flight bodies are where the exact bounce has them.
#pragma once

#include <vector>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

/// The law that p knows of a constraint whose gap bias is b: no friction. b NaN: it has no gap;
/// equalities hold p as it is, all else takes no part.
contact::Law displacement_law(const contact::Law& law, double b);

/// Finds p. Scratch memory inside: one per thread; it grows at the first overlap of a size.
class OverlapCorrection {
 public:
  struct Found {
    bool needed = false;  ///< something overlaps too far for w to recover it all, or bounces
    contact::Status status = contact::Status::kConverged;
    int iterations = 0;  ///< Newton steps
  };

  /// Finds velocity(), if it is needed, for the velocities w and impulses of a solved problem of
  /// these constraints, step h [s]: of the islands concerned, to 1e-9. Blocks are in its order.
  Found find(const ConstraintSet& constraints, const contact::Problem& solved, double h,
             const contact::Settings& settings, const VectorRef& w, const VectorRef& impulse);

  /// p [m/s, rad/s].
  VectorRef velocity() const { return p_.head(problem_.num_velocities()); }
  /// Whether a block of the problem may be displaced.
  bool concerns(int block) const { return concerned_[static_cast<size_t>(block)] != 0; }
  VectorRef impulse() const { return impulse_.head(problem_.num_rows()); }
  const contact::Problem& problem() const { return problem_; }

 private:
  /// p0 into p_; false if nothing bounces.
  bool find_late_impulses(const ConstraintSet& constraints, const contact::Problem& solved,
                          double h, const VectorRef& impulse);
  /// The islands with something that bounces, or overlaps too far for w to recover what is to be:
  /// the others need no displacement. False if there is none.
  bool find_concerned(const ConstraintSet& constraints, const contact::Problem& solved,
                      const VectorRef& w);

  contact::DisjointSets islands_;
  std::vector<char> concerned_;  ///< by block
  contact::Problem problem_;
  contact::Solver solver_;
  std::vector<char> late_;  ///< by block: an impact within the step
  MatrixX mass_;
  VectorX p_, impulse_;  ///< grown only, see Workspace::Impl
};

}  // namespace counterpoint
