// Cholesky factorization of matrices in square blocks, of which each row knows those beside it: the
// normal equations of a motion, whose instants see three frames, or four.
//
// Neighbouring blocks in the middle, as many as the band is wide, separate the motion, and as many
// more at the seam where it is periodic: two independent chains are left, which are eliminated in
// parallel, block after block. A front contains the next blocks of the band and the seam
// (multifrontal: Duff and Reid, "The multifrontal solution of indefinite sparse symmetric linear
// equations", 1983); the separators come last, as one dense matrix.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "counterpoint/engine/optimize/newton/thread_pool.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::optimization {

/// A symmetric matrix of n x n blocks, each m x m: block (i, j) may differ from zero where
/// |i - j| <= width, and, if it is bordered, where that holds around the seam between the last and
/// the first (a periodic motion). Its factorization takes O(n width^2 m^3) either way.
class BlockCholesky {
 public:
  BlockCholesky(int num_blocks, int block_size, bool bordered, int width = 2);

  /// The lower triangle: j <= i, in the pattern; m x m.
  MatrixX& block(int i, int j) { return blocks_[index(i, j)]; }
  const MatrixX& block(int i, int j) const { return blocks_[index(i, j)]; }
  bool in_pattern(int i, int j) const;
  int num_blocks() const { return num_blocks_; }
  int block_size() const { return block_size_; }
  int width() const { return width_; }
  void set_zero();

  /// Factors this + scale diag(shift); shift: m x n. False if that is not positive definite. The
  /// same bits whatever the pool's threads.
  bool factor(double scale, const MatrixX& shift, ThreadPool& pool);
  /// x (m x n, a column a block) of A x = b, in place. Needs factor().
  void solve(MatrixX& x, ThreadPool& pool);

 private:
  /// Blocks eliminated one after the other. `width` slots hold those that come next, block k in
  /// slot k modulo `width`; others those separators that all of the chain may see.
  struct Chain {
    int width = 2;
    std::vector<int> blocks;      ///< in order, and behind them the separators at its end
    std::vector<int> seam;        ///< separators in slots width, width + 1, ...
    MatrixX update;               ///< slots x slots: what was eliminated takes from them
    std::vector<MatrixX> panels;  ///< by block: its own factor, below it the slots' rows
    VectorX carried;              ///< slots
    bool failed = false;

    int size() const { return static_cast<int>(panels.size()); }
    int slots() const { return width + static_cast<int>(seam.size()); }
    /// The block in a slot once `eliminated` blocks are gone.
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
  std::vector<int> separator_of_;  ///< by block: index into separators_, or -1
  std::vector<Chain> chains_;      ///< two, or none
  MatrixX root_;                   ///< separators x separators: their factor
  VectorX root_x_;
};

}  // namespace counterpoint::optimization
