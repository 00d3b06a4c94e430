// Sparse Cholesky factorization of a symmetric positive definite matrix made of dense blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace counterpoint::contact {

/// Blocks are numbered 0 ... n-1 by the caller; inside they are eliminated in minimum-degree order.
/// Memory grows while sizes are new and is then reused. Deterministic.
class BlockCholesky {
 public:
  /// Starts a new structure: sizes of the diagonal blocks.
  void begin_structure(const std::vector<int>& sizes);
  /// Blocks i and j (i != j) are coupled. Repetition does no harm.
  void add_coupling(int i, int j);
  /// Orders, finds the fill and lays out the memory.
  void end_structure();

  /// Sets all blocks to zero.
  void set_zero();
  /// A dense block of the matrix. Off the diagonal it is stored for one order of (i, j) only, the one
  /// for which is_stored is true; on the diagonal only the lower triangle is read.
  struct Block {
    double* data;  ///< column-major
    int leading;   ///< leading dimension
  };
  bool is_stored(int i, int j) const { return position_[i] >= position_[j]; }
  Block block(int i, int j);

  /// Factors in place. False if a pivot is not positive (or not a number).
  bool factor();
  /// x = inv(A) x; x in the caller's block order. The factor must exist.
  void solve(double* x) const;

  /// Doubles held by the factor: the measure of fill.
  int factor_size() const { return panel_start_.empty() ? 0 : panel_start_.back(); }

 private:
  struct Below {
    int position;  ///< elimination position of the row block
    int row;       ///< first row inside the panel
  };
  void order();
  void lay_out();
  int row_in_panel(int row_position, int column_position) const;
  uint64_t* adjacency(int block) { return adjacency_.data() + static_cast<std::size_t>(block) * words_; }
  int size_at(int position) const { return sizes_[sequence_[position]]; }

  int num_blocks_ = 0, words_ = 0;
  std::vector<int> sizes_, start_;         // by block: size, offset in x
  std::vector<uint64_t> adjacency_;        // by block: a row of bits; during ordering the elimination graph
  std::vector<int> degree_;
  std::vector<int> sequence_, position_;   // elimination position -> block, and back
  std::vector<int> below_start_;           // by position: range in below_
  std::vector<Below> below_;               // row blocks of each panel under its diagonal, in order
  std::vector<int> panel_start_, panel_rows_;
  std::vector<double> values_;
};

}  // namespace counterpoint::contact
