// Solves one island: straight by Newton's method on velocities where that is near, else by the
// mixed Newton method, else by the interior point, else along the homotopy, else from the solution
// of the island with other regularizers; what these find is finished by Newton's method on
// velocities, whose residual alone decides.
#pragma once

#include <span>
#include <vector>

#include "counterpoint/contact/homotopy.h"
#include "counterpoint/contact/interior_point.h"
#include "counterpoint/contact/island_system.h"
#include "counterpoint/contact/mixed_newton.h"
#include "counterpoint/contact/mixed_system.h"
#include "counterpoint/contact/newton.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {

/// How to follow the homotopy: sigma as a share of alpha, least cosine of a turn, which curve
/// (MixedSystem::begin).
struct HomotopyManner {
  double sigma_share, least_cosine;
  int detour;
};

class IslandSolver {
 public:
  /// w: start on entry, answer on return, the best point seen if there is none; f: impulses at w.
  /// Both in the island's numbering.
  Newton::Result solve(IslandSystem& system, const Settings& settings, std::vector<double>& w,
                       std::vector<double>& f);
  const Newton::Totals& totals() const { return newton_.totals(); }
  /// The last method that the last island needed.
  Method method() const { return method_; }

 private:
  void reserve();
  void try_in_turn();
  void attempt(Method method, int max_iterations);
  void guess_point();
  bool run_mixed_newton(int max_iterations);
  bool run_interior_point(int max_iterations);
  bool run_homotopy(const HomotopyManner& manner, int max_iterations);
  void scale_regularizers(double factor);
  bool walk_from(double factor, int most_steps);
  void come_from(double factor, Method method, int max_steps, int most_walks = 1);
  void follow_in_turn(std::span<const HomotopyManner> manners);
  void finish_while_contracting();
  void finish(int max_iterations);
  int steps_left() const;
  bool unsolved() const;

  Newton newton_;
  MixedSystem mixed_system_;
  MixedNewton mixed_newton_;
  InteriorPoint interior_point_;
  Homotopy homotopy_;

  IslandSystem* system_ = nullptr;
  Settings settings_;
  Method method_ = Method::kNewton;
  Newton::Result result_, best_;
  std::vector<double> start_, w_, f_, best_w_, best_f_, regularizer_;
  MixedSystem::Point point_, here_;
};

}  // namespace counterpoint::contact
