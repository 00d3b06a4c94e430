// The direct solver for equalities agrees with the contact solver.
#include "counterpoint/engine/dynamics/equality_solver.h"

#include <gtest/gtest.h>

#include "counterpoint/contact/solver.h"
#include "support/random_model.h"

namespace counterpoint::equality_solver_test {
namespace {

contact::Law equality(int rows, int seed) {
  contact::Law law;
  law.type = contact::LawType::kEquality;
  law.rows = rows;
  law.regularizer = 1e-6;
  for (int i = 0; i < rows; ++i) law.bias[static_cast<size_t>(i)] = 0.1 * (seed + i);
  return law;
}

/// Adds a block of `size` velocities; M has full rank with eigenvalues of at least 1.
void add_block(int size, int seed, contact::Problem& problem) {
  const int block = problem.add_block(size);
  MatrixX A(size, size);
  for (int i = 0; i < size; ++i) A.col(i) = test::random_vector(size, 10 * seed + i, 1.0);
  problem.mass(block) = MatrixX::Identity(size, size) + A * A.transpose();
  problem.free_velocity().segment(problem.block_start(block), size) =
      test::random_vector(size, 1000 + seed, 1.0);
}

void fill_jacobian(int constraint, int side, int seed, contact::Problem& problem) {
  contact::MatrixMap J = problem.jacobian(constraint, side);
  for (int i = 0; i < J.rows(); ++i)
    J.row(i) = test::random_vector(static_cast<int>(J.cols()), 100 * seed + i, 1.0).transpose();
}

/// Three blocks; equalities between the first two, within the third, and one row between the third
/// and the first.
contact::Problem make_problem() {
  contact::Problem problem;
  add_block(5, 1, problem);
  add_block(1, 2, problem);
  add_block(7, 3, problem);
  fill_jacobian(problem.add_constraint(equality(3, 1), 0, 1), 0, 1, problem);
  fill_jacobian(0, 1, 2, problem);
  fill_jacobian(problem.add_constraint(equality(2, 2), 2), 0, 3, problem);
  fill_jacobian(problem.add_constraint(equality(1, 3), 2, 0), 0, 4, problem);
  fill_jacobian(2, 1, 5, problem);
  return problem;
}

VectorX by_contact_solver(const contact::Problem& problem) {
  VectorX w = problem.free_velocity(), impulse(problem.num_rows());
  contact::Solver solver;
  EXPECT_TRUE(contact::succeeded(solver.solve(problem, contact::Settings(), w, impulse).status));
  return w;
}

TEST(EqualitySolver, IsTheContactSolverForEqualities) {
  contact::Problem problem = make_problem();
  EqualitySolver solver;
  ASSERT_TRUE(solver.factor(problem));
  VectorX w(problem.num_velocities());
  for (int pass = 0; pass < 2; ++pass) {
    SCOPED_TRACE(pass);
    solver.solve(problem, w);
    // The tolerance of the contact solver, 1e-12, and rounding over the regularizer, 1e-6.
    EXPECT_LT((w - by_contact_solver(problem)).norm(), 1e-9 * w.norm());
    // The second pass has other velocities and biases but the same factorization.
    problem.free_velocity() *= -3.0;
    problem.law(1).bias[0] = 5.0;
  }
}

TEST(EqualitySolver, LeavesManyRowsAndSingularMassToOthers) {
  contact::Problem problem;
  add_block(6, 1, problem);
  EqualitySolver solver;
  for (int rows = 0; rows < EqualitySolver::kManyRows; rows += 3)
    fill_jacobian(problem.add_constraint(equality(3, 1), 0), 0, rows, problem);
  EXPECT_TRUE(solver.factor(problem));
  problem.add_constraint(equality(1, 1), 0);
  EXPECT_FALSE(solver.factor(problem));

  problem = make_problem();
  problem.mass(1).setZero();
  EXPECT_FALSE(solver.factor(problem));
}

}  // namespace
}  // namespace counterpoint::equality_solver_test
