#include "counterpoint/engine/dynamics/equality_solver.h"

#include <Eigen/Cholesky>

namespace counterpoint {
namespace {

using Square = Eigen::Map<MatrixX>;
using InPlace = Eigen::LLT<Eigen::Ref<MatrixX>>;

Square sized(std::vector<double>& memory, int rows, int cols) {
  memory.resize(static_cast<size_t>(rows) * static_cast<size_t>(cols));
  return Square(memory.data(), rows, cols);
}

}  // namespace

bool EqualitySolver::factor(const contact::Problem& problem) {
  const int rows = problem.num_rows(), size = problem.num_velocities();
  if (rows > kManyRows) return false;
  Square J = sized(jacobian_, rows, size);
  Square X = sized(answer_, size, rows);
  Square S = sized(system_, rows, rows);
  J.setZero();
  for (int c = 0; c < problem.num_constraints(); ++c) {
    for (int side = 0; side < 2; ++side) {
      const int block = problem.block(c, side);
      if (block < 0) continue;
      const contact::ConstMatrixMap part = problem.jacobian(c, side);
      J.block(problem.first_row(c), problem.block_start(block), part.rows(), part.cols()) = part;
    }
  }
  X = J.transpose();
  for (int b = 0; b < problem.num_blocks(); ++b) {
    const int n = problem.block_size(b);
    Square M = sized(mass_, n, n);
    M = problem.mass(b);
    Eigen::Ref<MatrixX> in_place = M;
    const InPlace llt(in_place);
    if (llt.info() != Eigen::Success) return false;
    auto part = X.middleRows(problem.block_start(b), n);
    llt.matrixL().solveInPlace(part);
    llt.matrixU().solveInPlace(part);
  }
  S.noalias() = J.lazyProduct(X);
  for (int c = 0; c < problem.num_constraints(); ++c)
    S.diagonal().segment(problem.first_row(c), problem.law(c).rows).array() +=
        problem.law(c).regularizer;
  Eigen::Ref<MatrixX> in_place = S;
  return InPlace(in_place).info() == Eigen::Success;
}

void EqualitySolver::solve(const contact::Problem& problem, Eigen::Ref<VectorX> w) {
  const int rows = problem.num_rows(), size = problem.num_velocities();
  const Square J = sized(jacobian_, rows, size), X = sized(answer_, size, rows);
  const Square S = sized(system_, rows, rows);
  impulse_.resize(static_cast<size_t>(rows));
  Eigen::Map<VectorX> f(impulse_.data(), rows);
  w = problem.free_velocity();
  f.noalias() = J.lazyProduct(w);
  for (int c = 0; c < problem.num_constraints(); ++c)
    for (int i = 0; i < problem.law(c).rows; ++i)
      f[problem.first_row(c) + i] += problem.law(c).bias[static_cast<size_t>(i)];
  S.triangularView<Eigen::Lower>().solveInPlace(f);
  S.triangularView<Eigen::Lower>().transpose().solveInPlace(f);
  w.noalias() -= X.lazyProduct(f);
}

}  // namespace counterpoint
