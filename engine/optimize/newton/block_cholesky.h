// Cholesky factorization of block-banded matrices: the normal equations of a motion, whose
// residuals at one instant depend on three or four neighbouring frames.
//
// Separators are neighbouring blocks in the middle, as many as the band is wide; for a periodic
// motion, as many more at the seam between the last block and the first. Two independent chains
// remain, which are eliminated in parallel, block by block. A front contains the next blocks of the
// band and the separators at the seam (multifrontal method: Duff and Reid, "The multifrontal
// solution of indefinite sparse symmetric linear equations", 1983). The separators are factored
// last, as one dense matrix.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "counterpoint/contact/thread_pool.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::optimization {

/// A symmetric matrix of n x n blocks, each m x m. Block (i, j) may be nonzero for
/// |i - j| <= width, where a bordered matrix (periodic motion) counts the distance around the seam
/// as well. Factorization takes O(n width^2 m^3) in both cases.
class BlockCholesky {
 public:
  BlockCholesky(int num_blocks, int block_size, bool bordered, int width = 2);

  /// Block (i, j) of the lower triangle, j <= i, in the pattern; m x m.
  MatrixX& block(int i, int j) { return blocks_[index(i, j)]; }
  const MatrixX& block(int i, int j) const { return blocks_[index(i, j)]; }
  bool in_pattern(int i, int j) const;
  int num_blocks() const { return num_blocks_; }
  int block_size() const { return block_size_; }
  int width() const { return width_; }
  void set_zero();

  /// Factors this + scale diag(shift), shift: m x n. Returns false if it is not positive definite.
  /// The result does not depend on the threads of the pool.
  bool factor(double scale, const MatrixX& shift, contact::ThreadPool& pool);
  /// Solves A x = b in place; x: m x n, one column per block. Needs factor().
  void solve(MatrixX& x, contact::ThreadPool& pool);

 private:
  /// Blocks eliminated one after the other. Their front has `width` slots for the next blocks,
  /// block k in slot k modulo `width`, followed by slots for separators that all of the chain
  /// depends on.
  struct Chain {
    int width = 2;
    std::vector<int> blocks;  ///< in order of elimination, followed by the separators at the end of
                              ///< the chain
    std::vector<int> seam;    ///< separators in slots width, width + 1, ...
    MatrixX update;           ///< slots x slots: Schur update of the front by the eliminated blocks
    std::vector<MatrixX> panels;  ///< per block: its Cholesky factor, and below it the rows of the
                                  ///< slots
    VectorX carried;              ///< slots: update of the right-hand side, or solution
    bool failed = false;

    int size() const { return static_cast<int>(panels.size()); }
    int slots() const { return width + static_cast<int>(seam.size()); }
    /// Index of the block in a slot after `eliminated` blocks.
    int at(int slot, int eliminated) const;
  };

  static std::size_t size(int i) { return static_cast<std::size_t>(i); }
  std::size_t index(int i, int j) const;
  void add_chain(int first, int last, int step, std::vector<int> ends, std::vector<int> seam);
  void add_block(int i, int j, Eigen::Ref<MatrixX> out) const;
  void eliminate(Chain& chain, double scale, const MatrixX& shift) const;
  void add_update(const Chain& chain);
  void reduce(Chain& chain, MatrixX& x) const;
  void substitute(Chain& chain, MatrixX& x) const;

  int num_blocks_, block_size_;
  bool bordered_;
  int width_;
  std::vector<MatrixX> blocks_;
  std::vector<int> separators_;    ///< in ascending order
  std::vector<int> separator_of_;  ///< per block: index into separators_, or -1
  std::vector<Chain> chains_;      ///< two, or none
  MatrixX root_;                   ///< separators x separators: their Cholesky factor
  VectorX root_x_;
};

}  // namespace counterpoint::optimization
