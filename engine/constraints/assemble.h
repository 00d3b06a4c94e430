// Conversion of constraints to the contact problem (forward), and of impulses to body wrenches
// (inverse).
#pragma once

#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/thread_pool.h"
#include "counterpoint/engine/constraints/constraint_set.h"

namespace counterpoint {

/// Fills `problem` with one block for each tree that a constraint touches, and with all
/// constraints: pairs first, then joint rows, in their order. `block_of_tree` (num_trees) is -1 for
/// the other trees, which move freely. mass_diagonal (nv) is added to M: h D of implicit damping.
/// pool: threads that share trees and pairs, to the same bits; may be null. Requires compute_poses
/// and compute_inertias.
void assemble_problem(const Model& model, const ConstraintSet& constraints, const VectorRef& w_free,
                      const VectorRef& mass_diagonal, const BodyState& bodies,
                      std::vector<int>& block_of_tree, contact::Problem& problem,
                      contact::ThreadPool* pool = nullptr);

/// The bodies whose joints change the relative motion of two bodies, kept for the next contact of
/// that pair: from both bodies up to the common ancestor; the chain of A follows that of B if they
/// are in different trees.
struct PairChain {
  struct Link {
    int body;
    bool of_b;
  };
  int body_a = -1, body_b = -1;
  std::vector<Link> links;
};

/// Computes y = J v + b of a pair at velocities v (nv) [m/s, rad/s], law.rows numbers, from the
/// columns of assemble_problem and in the summation order of the contact solver, to the same bits.
/// Requires compute_poses. chain: that of any pair of this model on entry; that of `pair` on
/// return.
void pair_velocity(const Model& model, const PairConstraint& pair, const Kinematics& data,
                   const VectorRef& v, PairChain& chain, double* y);

/// Returns the impulse and angular impulse of a pair on body B [N s, N m s], in W, at the pair's
/// position.
Force pair_impulse(const PairConstraint& pair, const double* impulse);
inline Force pair_impulse(const PairConstraint& pair, const contact::Rows& impulse) {
  return pair_impulse(pair, impulse.data());
}

/// Adds `impulse` to body B and subtracts it from A: impulses in axes of W at the body origins.
void add_pair_impulse(const PairConstraint& pair, const Force& impulse, const Kinematics& data,
                      std::vector<Force>& body_impulse);

/// Computes tau (nv) += J' f for wrenches or impulses on bodies, in axes of W at the body origins.
/// body_force is overwritten. Requires compute_poses.
void project_on_joints(const Model& model, const Kinematics& data, std::vector<Force>& body_force,
                       VectorOut tau);

}  // namespace counterpoint
