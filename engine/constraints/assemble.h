// From constraints to the contact problem (forward), and from impulses to body wrenches (inverse).
#pragma once

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/constraints.h"

namespace counterpoint {

/// Fills `problem` with the trees that constraints touch, one block each, and all constraints:
/// pairs first, then joint rows, in their order. `block_of_tree` (num_trees) is -1 for trees
/// left out: those move freely. mass_diagonal (nv) is added to M: h D of implicit damping. Needs
/// compute_poses and compute_inertias.
void assemble_problem(const Model& model, const ConstraintSet& constraints, const VectorRef& w_free,
                      const VectorRef& mass_diagonal, const BodyState& bodies,
                      std::vector<int>& block_of_tree,
                      contact::Problem& problem);  // Parameters: what it depends on, one by one

/// The bodies whose joints move two bodies apart, kept for the next pair of these: from the ends to
/// where their chains part, those of A behind those of B where they are of different trees.
struct PairChain {
  struct Link {
    int body;
    bool of_b;
  };
  int body_a = -1, body_b = -1;
  std::vector<Link> links;
};

/// y = J v + b of a pair at velocities v (nv) [m/s, rad/s], law.rows numbers, by the columns of
/// assemble_problem and summed as the contact solver sums them: the same bits. Needs compute_poses.
/// chain: of any pair of this model, becomes that of this one.
void pair_velocity(const Model& model, const PairConstraint& pair, const Kinematics& data,
                   const VectorRef& v, PairChain& chain, double* y);
/// The same of a joint row.
double joint_row_velocity(const JointConstraint& row, const VectorRef& v);

/// Impulse and angular impulse of a pair constraint on body B [N s, N m s], in W, at its position.
Force pair_impulse(const PairConstraint& pair, const double* impulse);
inline Force pair_impulse(const PairConstraint& pair, const contact::Rows& impulse) {
  return pair_impulse(pair, impulse.data());
}

/// Adds it to body B and takes it from A: impulses in world axes at the body origins.
void add_pair_impulse(const PairConstraint& pair, const Force& impulse, const Kinematics& data,
                      std::vector<Force>& body_impulse);

/// tau (nv) += J' f for body wrenches or impulses, world axes at the body origins; they are used up
/// as scratch. Needs compute_poses.
void project_on_joints(const Model& model, const Kinematics& data, std::vector<Force>& body_force,
                       VectorOut tau);

}  // namespace counterpoint
