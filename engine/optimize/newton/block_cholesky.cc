#include "counterpoint/engine/optimize/newton/block_cholesky.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace counterpoint::optimization {
namespace {

std::vector<int> consecutive(int first, int count) {
  std::vector<int> out(static_cast<std::size_t>(count));
  std::iota(out.begin(), out.end(), first);
  return out;
}

bool factor_in_place(Eigen::Ref<MatrixX> A) {
  return Eigen::LLT<Eigen::Ref<MatrixX>, Eigen::Lower>(A).info() == Eigen::Success;
}

}  // namespace

BlockCholesky::BlockCholesky(int num_blocks, int block_size, bool bordered, int width)
    : num_blocks_(num_blocks),
      block_size_(block_size),
      bordered_(bordered),
      width_(width),
      // Blocks of the band, and blocks that are coupled across the seam.
      blocks_(size((width + 1) * num_blocks + width * (width + 1) / 2),
              MatrixX::Zero(block_size, block_size)),
      separator_of_(size(num_blocks), -1) {
  // Separators: the last `width` blocks (the seam) if bordered, and `width` blocks in the middle.
  const int end = bordered ? std::max(0, num_blocks - width) : num_blocks;
  const int middle = std::max(0, (end - width) / 2);
  for (int i = middle; i < std::min(middle + width, end); ++i) separators_.push_back(i);
  for (int i = end; i < num_blocks; ++i) separators_.push_back(i);
  for (std::size_t s = 0; s < separators_.size(); ++s)
    separator_of_[size(separators_[s])] = static_cast<int>(s);
  if (end >= width) {
    const std::vector<int> parting = consecutive(middle, width), seam = consecutive(end, width);
    if (bordered) {
      add_chain(0, middle, 1, parting, seam);
      add_chain(middle + width, end, 1, seam, parting);
    } else {
      add_chain(0, middle, 1, parting, {});
      add_chain(num_blocks - 1, middle + width - 1, -1, {parting.rbegin(), parting.rend()}, {});
    }
  }
  const Eigen::Index rows = block_size * static_cast<Eigen::Index>(separators_.size());
  root_.resize(rows, rows);
  root_x_.resize(rows);
}

void BlockCholesky::add_chain(int first, int last, int step, std::vector<int> ends,
                              std::vector<int> seam) {
  Chain& chain = chains_.emplace_back();
  chain.width = width_;
  for (int i = first; i != last; i += step) chain.blocks.push_back(i);
  chain.seam = std::move(seam);
  chain.panels.assign(chain.blocks.size(),
                      MatrixX::Zero((1 + chain.slots()) * block_size_, block_size_));
  chain.blocks.insert(chain.blocks.end(), ends.begin(), ends.end());
  chain.update.resize(chain.slots() * block_size_, chain.slots() * block_size_);
  chain.carried.resize(chain.slots() * block_size_);
}

int BlockCholesky::Chain::at(int slot, int eliminated) const {
  if (slot >= width) return seam[BlockCholesky::size(slot - width)];
  const int ahead = (slot - eliminated % width + width) % width;
  return blocks[BlockCholesky::size(eliminated + ahead)];
}

bool BlockCholesky::in_pattern(int i, int j) const {
  return j <= i && (i - j <= width_ || (bordered_ && j + num_blocks_ - i <= width_));
}

std::size_t BlockCholesky::index(int i, int j) const {
  if (i - j <= width_) return size((width_ + 1) * i + i - j);
  const int row = num_blocks_ - 1 - i;  // counted from the seam: row r has width - r blocks
  return size((width_ + 1) * num_blocks_ + row * width_ - row * (row - 1) / 2 + j);
}

void BlockCholesky::set_zero() {
  for (MatrixX& block : blocks_) block.setZero();
}

/// Adds block (i, j) of either triangle to out, if it is in the pattern.
void BlockCholesky::add_block(int i, int j, Eigen::Ref<MatrixX> out) const {
  if (i >= j && in_pattern(i, j)) {
    out += block(i, j);
  } else if (i < j && in_pattern(j, i)) {
    out += block(j, i).transpose();
  }
}

void BlockCholesky::eliminate(Chain& chain, double scale, const MatrixX& shift) const {
  const int m = block_size_, slots = chain.slots();
  MatrixX& U = chain.update;
  U.setZero();
  chain.failed = false;
  for (int k = 0; k < chain.size() && !chain.failed; ++k) {
    const int pivot = k % chain.width, i = chain.blocks[size(k)];
    MatrixX& panel = chain.panels[size(k)];
    auto own = panel.topRows(m);
    auto others = panel.bottomRows(slots * m);
    own = U.block(pivot * m, pivot * m, m, m) + block(i, i);
    own.diagonal() += scale * shift.col(i);
    for (int s = 0; s < slots; ++s) {
      auto rows = others.middleRows(s * m, m);
      if (s == pivot) {  // the next block in this slot has no update yet
        rows.setZero();
      } else if (s > pivot) {
        rows = U.block(s * m, pivot * m, m, m);
      } else {
        rows = U.block(pivot * m, s * m, m, m).transpose();
      }
      add_block(chain.at(s, k + 1), i, rows);
    }
    U.block(pivot * m, 0, m, (pivot + 1) * m).setZero();
    U.block(pivot * m, pivot * m, (slots - pivot) * m, m).setZero();
    chain.failed = !factor_in_place(own);
    own.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(others);
    U.selfadjointView<Eigen::Lower>().rankUpdate(others, -1.0);
  }
}

/// Adds the Schur update of a chain to the root matrix.
void BlockCholesky::add_update(const Chain& chain) {
  const int m = block_size_;
  for (int s = 0; s < chain.slots(); ++s) {
    for (int t = 0; t <= s; ++t) {
      const int i = separator_of_[size(chain.at(s, chain.size()))];
      const int j = separator_of_[size(chain.at(t, chain.size()))];
      const auto taken = chain.update.block(s * m, t * m, m, m);
      if (i >= j) {
        root_.block(i * m, j * m, m, m) += taken;
      } else {
        root_.block(j * m, i * m, m, m) += taken.transpose();
      }
    }
  }
}

bool BlockCholesky::factor(double scale, const MatrixX& shift, contact::ThreadPool& pool) {
  pool.run(static_cast<int>(chains_.size()),
           [&](int i, int) { eliminate(chains_[size(i)], scale, shift); });
  const int m = block_size_, count = static_cast<int>(separators_.size());
  root_.setZero();
  for (int a = 0; a < count; ++a) {
    const int i = separators_[size(a)];
    for (int b = 0; b <= a; ++b)
      add_block(i, separators_[size(b)], root_.block(a * m, b * m, m, m));
    root_.block(a * m, a * m, m, m).diagonal() += scale * shift.col(i);
  }
  for (const Chain& chain : chains_) {
    if (chain.failed) return false;
    add_update(chain);
  }
  return factor_in_place(root_);
}

void BlockCholesky::reduce(Chain& chain, MatrixX& x) const {
  const int m = block_size_;
  chain.carried.setZero();
  for (int k = 0; k < chain.size(); ++k) {
    const MatrixX& panel = chain.panels[size(k)];
    auto slot = chain.carried.segment(k % chain.width * m, m);
    auto y = x.col(chain.blocks[size(k)]);
    y += slot;
    slot.setZero();
    panel.topRows(m).triangularView<Eigen::Lower>().solveInPlace(y);
    chain.carried.noalias() -= panel.bottomRows(chain.slots() * m) * y;
  }
}

void BlockCholesky::substitute(Chain& chain, MatrixX& x) const {
  const int m = block_size_;
  for (int s = 0; s < chain.slots(); ++s)
    chain.carried.segment(s * m, m) = x.col(chain.at(s, chain.size()));
  for (int k = chain.size() - 1; k >= 0; --k) {
    const MatrixX& panel = chain.panels[size(k)];
    auto y = x.col(chain.blocks[size(k)]);
    y.noalias() -= panel.bottomRows(chain.slots() * m).transpose() * chain.carried;
    panel.topRows(m).triangularView<Eigen::Lower>().transpose().solveInPlace(y);
    chain.carried.segment(k % chain.width * m, m) = y;
  }
}

void BlockCholesky::solve(MatrixX& x, contact::ThreadPool& pool) {
  const int m = block_size_;
  pool.run(static_cast<int>(chains_.size()), [&](int i, int) { reduce(chains_[size(i)], x); });
  for (std::size_t a = 0; a < separators_.size(); ++a)
    root_x_.segment(static_cast<int>(a) * m, m) = x.col(separators_[a]);
  for (const Chain& chain : chains_)
    for (int s = 0; s < chain.slots(); ++s)
      root_x_.segment(separator_of_[size(chain.at(s, chain.size()))] * m, m) +=
          chain.carried.segment(s * m, m);
  root_.triangularView<Eigen::Lower>().solveInPlace(root_x_);
  root_.triangularView<Eigen::Lower>().transpose().solveInPlace(root_x_);
  for (std::size_t a = 0; a < separators_.size(); ++a)
    x.col(separators_[a]) = root_x_.segment(static_cast<int>(a) * m, m);
  pool.run(static_cast<int>(chains_.size()), [&](int i, int) { substitute(chains_[size(i)], x); });
}

}  // namespace counterpoint::optimization
