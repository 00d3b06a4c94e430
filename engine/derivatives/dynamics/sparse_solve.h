// Linear systems whose matrix has the zeros of a tree's inertia.
#pragma once

#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// A row that another is to be freed of, times a factor.
struct EliminationTerm {
  int row;
  double factor;
};

/// By coordinate: the next one towards the root, of the same joint or of the one that carries it;
/// -1: none.
std::vector<int> coordinate_parents(const Model& model);

/// Solves A X = B by elimination from the last unknown to the first: of matrices with the pattern
/// of a tree's M no zero is lost (Featherstone 2008, section 6.5), and zeros cost nothing. Rows are
/// exchanged where a pivot is small against what is below it. Scratch inside, grown only.
class SparseSolver {
 public:
  /// Takes A (n x n) and makes room for `columns` right-hand sides.
  void begin(const Eigen::Ref<const MatrixX>& A, int columns);
  /// The same of a symmetric positive definite A that couples coordinates with those that carry
  /// them only, of which A is a block from `first` on: nothing is searched or exchanged. `parents`
  /// must live until solve.
  void begin_tree(const Eigen::Ref<const MatrixX>& A, const std::vector<int>& parents, int first,
                  int columns);
  /// `scale` times a matrix (n rows) are the right-hand sides from `column` on; or the identity is.
  /// All have to be given.
  void add(const Eigen::Ref<const MatrixX>& B, int column, double scale);
  void add_identity(int column);
  /// False if A is singular; of a tree, if it is not positive definite.
  bool solve();
  /// The solution's columns from `column` on, as many as `out` has (n rows).
  void get(int column, Eigen::Ref<MatrixX> out) const;

 private:
  bool factor();
  bool factor_tree();
  void list_terms();

  int n_ = 0, columns_ = 0;
  const int* parents_ = nullptr;  ///< of a tree, of all its model
  int first_ = 0;                 ///< the coordinate that is row 0
  int stride_ = 0, width_ = 0;    ///< of the rows of A and B: multiples of four, and of a chunk
  std::vector<double> A_;         ///< row by row, then its factors
  std::vector<double> B_;
  std::vector<int> order_;  ///< which row of A and B is in the place
  bool exchanged_ = false;
  std::vector<EliminationTerm>
      terms_;                       ///< of all rows: below the diagonal's place first, then above
  std::vector<int> above_, below_;  ///< by row: where its terms begin, and one more
  std::vector<double> moved_;       ///< scratch of exchanges
};

}  // namespace counterpoint
