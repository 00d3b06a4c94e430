// Factors of a velocity block's inertia along its kinematic tree.
#pragma once

namespace counterpoint::contact {

/// M = L' D L, L of unit diagonal and zero but on the ways to the root, so that nothing fills in
/// (Featherstone, "Efficient factorization of the joint-space inertia matrix for branched kinematic
/// trees", 2005). parent: of each velocity, as Limbs finds them. m: M, n x n row by row; its lower
/// triangle becomes L, with 1 / D on the diagonal. False if D is not positive (or not a number).
bool factor_tree(const int* parent, int n, double* m);
/// x = inv(M) x.
void solve_tree(const int* parent, int n, const double* factors, double* x);
/// The same for four right sides, side by side: x is n x 4, row by row.
void solve_tree_four(const int* parent, int n, const double* factors, double* x);

}  // namespace counterpoint::contact
