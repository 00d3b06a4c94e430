// Factorization of a velocity block's inertia along its kinematic tree.
#pragma once

namespace counterpoint::contact {

/// Factors M = L' D L, where L has a unit diagonal and is zero except on the paths to the root, so
/// there is no fill (Featherstone, "Efficient factorization of the joint-space inertia matrix for
/// branched kinematic trees", 2005). parent: parent of each velocity, see Limbs. m: M, n x n,
/// row-major; its lower triangle becomes L, with 1 / D on the diagonal. False if D is not positive
/// (or NaN).
bool factor_tree(const int* parent, int n, double* m);
/// Solves x = inv(M) x.
void solve_tree(const int* parent, int n, const double* factors, double* x);
/// Same for four right sides: x is n x 4, row-major.
void solve_tree_four(const int* parent, int n, const double* factors, double* x);

}  // namespace counterpoint::contact
