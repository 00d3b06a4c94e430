// Sparse factorizations of a matrix made of dense blocks with a symmetric pattern: Cholesky of a
// symmetric positive definite one, LU of any other.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "counterpoint/contact/linear/dense_kernels.h"
#include "counterpoint/contact/linear/elimination_order.h"

namespace counterpoint::contact {

/// Multifrontal: blocks are numbered 0 ... n-1 by the caller and eliminated front by front, several
/// together where they fill in anyway. LU does not pivot, so that it has the pattern of Cholesky
/// and twice its work; growth() says what that has cost. Memory grows while sizes are new and is
/// then reused. Deterministic: what is kept from a structure to the next, equal one changes no bit.
class BlockFactorization {
 public:
  /// Starts a new structure: sizes of the diagonal blocks, all positive.
  void begin_structure(const std::vector<int>& sizes);
  /// Blocks i and j (i != j) are coupled. Repetition does no harm.
  void add_coupling(int i, int j) { couples_.emplace_back(i, j); }
  /// Orders, finds the fill and lays out the memory, unless all is as it was the last time.
  void end_structure();

  /// Where a dense block lives; valid until the next structure. Off the diagonal, blocks are
  /// addressed by the order (i, j) for which is_lower is true.
  struct Block {
    std::ptrdiff_t offset;
    int leading;
  };
  bool is_lower(int i, int j) const { return first_[i] >= first_[j]; }
  Block block(int i, int j) const;

  /// Sets all blocks to zero; `unsymmetric` also those of upper().
  void set_zero(bool unsymmetric);
  /// Keeps what lower() holds now: a symmetric part that several matrices have in common.
  void keep_common() { common_ = lower_; }
  /// Sets all blocks to that part; `unsymmetric` also those of upper().
  void set_common(bool unsymmetric);
  /// A_ij, column-major. On the diagonal only the lower triangle is read.
  double* lower(const Block& block) { return lower_.data() + block.offset; }
  /// For LU: the transpose of A_ji, column-major; of the diagonal what is right of it, transposed.
  double* upper(const Block& block) { return upper_.data() + block.offset; }

  /// Factors in place. False if a pivot is not positive (or not a number).
  bool factor_cholesky();
  /// Factors in place, without pivoting. False if a pivot is zero (or not a number).
  bool factor_lu();
  /// Of the last LU, largest over i of sum over j < i of |L_ij U_ji| / |A_ii|. It is less than 1
  /// for symmetric positive definite matrices, and small where the symmetric part is positive
  /// definite and the rest not much larger. Rounding is amplified no more than that.
  double growth() const { return growth_; }
  /// Whether factor_pivoted can do it.
  bool can_pivot() const { return size() <= kMostPivoted; }
  /// LU with partial pivoting of the dense matrix. False if a pivot is zero (or not a number).
  bool factor_pivoted();

  /// x = inv(A) x for the last factorization; x in the caller's block order.
  void solve(double* x) const;

  /// Numbers of rows, and doubles held by one triangle of the factor: the measure of fill.
  int size() const { return size_; }
  int factor_size() const { return static_cast<int>(lower_.size()); }

 private:
  // Beyond this a dense matrix is out of proportion: 2 MB, 10 ms.
  static constexpr int kMostPivoted = 512;
  enum class Kind { kCholesky, kLu, kPivoted };
  struct Front {
    FrontShape shape;
    int first;  ///< position of its first column
    int parent;
    std::ptrdiff_t panel;      ///< in lower_ and upper_
    int rows_begin;            ///< in rows_ : positions of the rows below, increasing
    std::ptrdiff_t rest;       ///< in rests_ and upper_rests_, after those of all its ancestors
    int runs_begin, runs_end;  ///< in runs_: its rows in the parent's
    bool leaf;
    bool first_child;
  };
  /// Rows that stand in a row in the parent, too.
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
  std::vector<int> sizes_, known_sizes_, start_, first_;  // by block; first_: its first position
  std::vector<std::pair<int, int>> couples_, known_couples_;
  bool known_ = false;
  EliminationOrder order_;
  std::vector<Front> fronts_;
  std::vector<int> rows_, front_of_;  // front_of_: by block
  std::vector<Run> runs_;
  std::vector<double> lower_, upper_;  // panels; upper_ transposed, laid out as lower_
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
