// Sparse factorizations of a matrix made of dense blocks with a symmetric pattern: Cholesky of a
// symmetric positive definite one, LU of any other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace counterpoint::contact {

/// Blocks are numbered 0 ... n-1 by the caller; inside they are eliminated in minimum-degree order.
/// Memory grows while sizes are new and is then reused. Deterministic.
class BlockFactorization {
 public:
  /// Starts a new structure: sizes of the diagonal blocks.
  void begin_structure(const std::vector<int>& sizes);
  /// Blocks i and j (i != j) are coupled. Repetition does no harm.
  void add_coupling(int i, int j);
  /// Orders, finds the fill and lays out the memory.
  void end_structure();

  /// Where a dense block lives; valid until the next structure. Off the diagonal, blocks are
  /// addressed by the order (i, j) for which is_lower is true.
  struct Block {
    std::ptrdiff_t offset;
    int leading;
  };
  bool is_lower(int i, int j) const { return position_[i] >= position_[j]; }
  Block block(int i, int j) const;

  /// Sets all blocks to zero; `unsymmetric` also those of upper().
  void set_zero(bool unsymmetric);
  /// A_ij, column-major. On the diagonal, Cholesky reads the lower triangle only.
  double* lower(const Block& block) { return lower_.data() + block.offset; }
  /// For LU: the transpose of A_ji, column-major, off the diagonal only.
  double* upper(const Block& block) { return upper_.data() + block.offset; }

  /// Factors in place. False if a pivot is not positive (or not a number).
  bool factor_cholesky();
  /// Factors in place, pivoting inside diagonal blocks. False if a pivot is zero (or not a number).
  bool factor_lu();
  /// x = inv(A) x for the last factorization; x in the caller's block order.
  void solve(double* x) const;

  /// Doubles held by one triangle of the factor: the measure of fill.
  int factor_size() const { return panel_start_.empty() ? 0 : panel_start_.back(); }

 private:
  struct Below {
    int position;  ///< elimination position of the row block
    int row;       ///< first row inside the panel
  };
  void order();
  void lay_out();
  int row_in_panel(int row_position, int column_position) const;
  uint64_t* adjacency(int block) {
    return adjacency_.data() + static_cast<std::size_t>(block) * words_;
  }
  void solve_cholesky(double* x) const;
  void eliminate_below(int p, double* x) const;
  void substitute_below(int p, const std::vector<double>& factor, double* x) const;
  void solve_lu(double* x) const;
  int size_at(int position) const { return sizes_[sequence_[position]]; }

  int num_blocks_ = 0, words_ = 0;
  std::vector<int> sizes_, start_;  // by block: size, offset in x
  std::vector<uint64_t>
      adjacency_;  // by block: a row of bits; during ordering the elimination graph
  std::vector<int> degree_;
  std::vector<int> sequence_, position_;  // elimination position -> block, and back
  std::vector<int> below_start_;          // by position: range in below_
  std::vector<Below> below_;              // row blocks of each panel under its diagonal, in order
  std::vector<int> panel_start_, panel_rows_;
  std::vector<double> lower_, upper_;  // panels; upper_ transposed, laid out as lower_
  std::vector<int> pivot_;             // by place in x: row swapped with, LU only
  bool lu_ = false;
};

}  // namespace counterpoint::contact
