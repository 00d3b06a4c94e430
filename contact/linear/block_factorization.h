// Sparse factorizations of a matrix of dense blocks with a symmetric pattern: Cholesky if it is
// symmetric positive definite, LU otherwise.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "counterpoint/contact/linear/dense_kernels.h"
#include "counterpoint/contact/linear/elimination_order.h"

namespace counterpoint::contact {

/// Multifrontal factorization. The caller numbers the blocks 0 ... n-1; they are eliminated front
/// by front, several together where they fill in anyway. LU does not pivot, so it has the pattern
/// of Cholesky and twice its work; growth() measures the loss of accuracy. Memory grows with new
/// sizes and is then reused. Deterministic: reuse of an equal structure changes no bit.
class BlockFactorization {
 public:
  /// Starts a new structure; sizes of the diagonal blocks, all positive.
  void begin_structure(const std::vector<int>& sizes);
  /// Couples the blocks i and j (i != j). Repetition does no harm.
  void add_coupling(int i, int j) { couples_.emplace_back(i, j); }
  /// Finds the elimination order and the fill, and lays out the memory, unless the structure is the
  /// last one.
  void end_structure();

  /// Location of a dense block; valid until the next structure. Off the diagonal, blocks are
  /// addressed by the order (i, j) for which is_lower(i, j) is true.
  struct Block {
    std::ptrdiff_t offset;
    int leading;
  };
  bool is_lower(int i, int j) const { return first_[i] >= first_[j]; }
  Block block(int i, int j) const;

  /// Sets all blocks to zero; with `unsymmetric` also those of upper().
  void set_zero(bool unsymmetric);
  /// Stores the present lower(): a symmetric part that several matrices have in common.
  void keep_common() { common_ = lower_; }
  /// Sets all blocks to the stored common part; with `unsymmetric` also those of upper().
  void set_common(bool unsymmetric);
  /// A_ij, column-major. On the diagonal only the lower triangle is read.
  double* lower(const Block& block) { return lower_.data() + block.offset; }
  /// For LU: the transpose of A_ji, column-major; in a diagonal block the entries right of the
  /// diagonal, transposed.
  double* upper(const Block& block) { return upper_.data() + block.offset; }

  /// Factors in place by Cholesky. False if a pivot is not positive (or NaN).
  bool factor_cholesky();
  /// Factors in place by LU without pivoting. False if a pivot is zero (or NaN).
  bool factor_lu();
  /// Growth of the last LU: largest over i of sum over j < i of |L_ij U_ji| / |A_ii|. It is less
  /// than 1 for symmetric positive definite matrices, and small where the symmetric part is
  /// positive definite and the rest not much larger. It bounds the amplification of rounding.
  double growth() const { return growth_; }
  /// Returns whether the matrix is small enough for factor_pivoted().
  bool can_pivot() const { return size() <= kMostPivoted; }
  /// Factors the dense matrix by LU with partial pivoting. False if a pivot is zero (or NaN).
  bool factor_pivoted();

  /// Solves x = inv(A) x with the last factorization; x in the caller's block order.
  void solve(double* x) const;

  /// Number of rows, and of doubles in one triangle of the factor: the measure of fill.
  int size() const { return size_; }
  int factor_size() const { return static_cast<int>(lower_.size()); }

 private:
  // Largest number of rows of a dense factorization with pivoting, which takes 2 MB and 10 ms.
  static constexpr int kMostPivoted = 512;
  enum class Kind { kCholesky, kLu, kPivoted };
  struct Front {
    FrontShape shape;
    int first;  ///< position of its first column in the elimination order
    int parent;
    std::ptrdiff_t panel;  ///< start in lower_ and upper_
    int rows_begin;        ///< start in rows_: positions of the rows below, increasing
    std::ptrdiff_t rest;   ///< start in rests_ and upper_rests_, after those of all its ancestors
    int runs_begin, runs_end;  ///< range in runs_: its rows among the parent's
    bool leaf;
    bool first_child;
  };
  /// Consecutive rows of a front that are consecutive in its parent, too.
  struct Run {
    int from, to, count;
  };
  void lay_out();
  void lay_out_rows();
  void lay_out_runs(Front& front);
  void lay_out_rests();
  int row_in_front(int position, const Front& front) const;
  void add_rest(const Front& front, std::vector<double>& panels, std::vector<double>& rests) const;
  void keep_diagonal();
  void solve_pivoted() const;
  void solve_fronts(bool scaled, const std::vector<double>& right) const;

  int size_ = 0;
  // For each block; first_: position of its first column.
  std::vector<int> sizes_, known_sizes_, start_, first_;
  std::vector<std::pair<int, int>> couples_, known_couples_;
  bool known_ = false;
  EliminationOrder order_;
  std::vector<Front> fronts_;
  std::vector<int> rows_, front_of_;  // front_of_: for each block
  std::vector<Run> runs_;
  std::vector<double> lower_, upper_;  // panels; upper_ is transposed and laid out like lower_
  std::vector<double> common_;
  std::vector<double> rests_, upper_rests_;
  std::vector<double> inverse_, diagonal_, growth_of_, front_growth_;
  std::vector<double> dense_;
  std::vector<int> pivot_;
  mutable std::vector<double> x_, below_;
  double growth_ = 0.0;
  Kind kind_ = Kind::kCholesky;
};

}  // namespace counterpoint::contact
