// Linear systems whose matrix has the sparsity of a tree's mass matrix.
#pragma once

#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// One elimination step: subtract `factor` times row `row`.
struct EliminationTerm {
  int row;
  double factor;
};

/// Returns the parent of each coordinate of v: the coordinate before it in the same joint, else the
/// last one of the parent body's joint; -1 if there is none.
std::vector<int> coordinate_parents(const Model& model);

/// Solves A X = B by elimination from the last unknown to the first. For matrices with the sparsity
/// of a tree's M this causes no fill-in (Featherstone 2008, section 6.5), and zeros cost nothing.
/// Rows are exchanged where a pivot is small against the other entries of its column. Scratch
/// memory inside, which only grows.
class SparseSolver {
 public:
  /// Sets A (n x n) and reserves `columns` right-hand sides.
  void begin(const Eigen::Ref<const MatrixX>& A, int columns);
  /// Does the same for a symmetric positive definite A that couples coordinates only with their
  /// ancestors: nothing is searched or exchanged. Row 0 is coordinate `first` of v. `parents`
  /// (coordinate_parents) must outlive solve.
  void begin_tree(const Eigen::Ref<const MatrixX>& A, const std::vector<int>& parents, int first,
                  int columns);
  /// Sets the right-hand sides from `column` on to `scale` B (n rows), or to the identity. All
  /// right-hand sides have to be set.
  void add(const Eigen::Ref<const MatrixX>& B, int column, double scale);
  void add_identity(int column);
  /// Returns false if A is singular; after begin_tree, if it is not positive definite.
  bool solve();
  /// Copies the columns of the solution from `column` on into `out` (n rows).
  void get(int column, Eigen::Ref<MatrixX> out) const;

 private:
  bool factor();
  bool factor_tree();
  void list_terms();

  int n_ = 0, columns_ = 0;
  const int* parents_ = nullptr;  ///< after begin_tree: parents of the rows, indices into v
  int first_ = 0;                 ///< coordinate of row 0
  int stride_ = 0, width_ = 0;    ///< row lengths of A and B: multiples of 4 and of a chunk
  std::vector<double> A_;         ///< row-major; replaced by its factors
  std::vector<double> B_;
  std::vector<int> order_;  ///< original index of each row
  bool exchanged_ = false;
  std::vector<EliminationTerm> terms_;  ///< per row: upper triangle first, then lower triangle
  std::vector<int> above_, below_;  ///< per row: first upper and first lower term; n + 1 entries
  std::vector<double> moved_;       ///< scratch of row exchanges
};

}  // namespace counterpoint
