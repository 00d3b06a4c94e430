#include "counterpoint/contact/block_factorization.h"

#include <algorithm>
#include <bit>

#include "counterpoint/contact/dense_kernels.h"

namespace counterpoint::contact {

void BlockFactorization::begin_structure(const std::vector<int>& sizes) {
  num_blocks_ = static_cast<int>(sizes.size());
  words_ = (num_blocks_ + 63) / 64;
  sizes_.assign(sizes.begin(), sizes.end());
  start_.resize(num_blocks_);
  int offset = 0;
  for (int b = 0; b < num_blocks_; ++b) {
    start_[b] = offset;
    offset += sizes_[b];
  }
  adjacency_.assign(static_cast<size_t>(num_blocks_) * words_, 0);
}

void BlockFactorization::add_coupling(int i, int j) {
  adjacency(i)[j / 64] |= uint64_t{1} << (j % 64);
  adjacency(j)[i / 64] |= uint64_t{1} << (i % 64);
}

void BlockFactorization::end_structure() {
  order();
  lay_out();
}

// Minimum degree on the explicit elimination graph, a row of bits per block. Ties go to the lower
// number. On return adjacency(b) holds the blocks eliminated after b that b's panel touches.
void BlockFactorization::order() {
  degree_.resize(num_blocks_);
  sequence_.resize(num_blocks_);
  position_.assign(num_blocks_, -1);
  const auto count = [this](int b) {
    int n = 0;
    for (int w = 0; w < words_; ++w) n += std::popcount(adjacency(b)[w]);
    return n;
  };
  for (int b = 0; b < num_blocks_; ++b) degree_[b] = count(b);
  for (int step = 0; step < num_blocks_; ++step) {
    int best = -1;
    for (int b = 0; b < num_blocks_; ++b) {
      if (position_[b] < 0 && (best < 0 || degree_[b] < degree_[best])) best = b;
    }
    sequence_[step] = best;
    position_[best] = step;
    const uint64_t* row = adjacency(best);
    for (int w = 0; w < words_; ++w) {
      for (uint64_t bits = row[w]; bits != 0; bits &= bits - 1) {
        const int neighbour = 64 * w + std::countr_zero(bits);
        uint64_t* other = adjacency(neighbour);
        for (int v = 0; v < words_; ++v) other[v] |= row[v];
        other[neighbour / 64] &= ~(uint64_t{1} << (neighbour % 64));
        other[best / 64] &= ~(uint64_t{1} << (best % 64));
        degree_[neighbour] = count(neighbour);
      }
    }
  }
}

void BlockFactorization::lay_out() {
  below_.clear();
  below_start_.resize(num_blocks_ + 1);
  panel_start_.resize(num_blocks_ + 1);
  panel_rows_.resize(num_blocks_);
  int offset = 0;
  for (int p = 0; p < num_blocks_; ++p) {
    const int b = sequence_[p];
    below_start_[p] = static_cast<int>(below_.size());
    const uint64_t* row = adjacency(b);
    for (int w = 0; w < words_; ++w) {
      for (uint64_t bits = row[w]; bits != 0; bits &= bits - 1) {
        below_.push_back({position_[64 * w + std::countr_zero(bits)], 0});
      }
    }
    std::sort(below_.begin() + below_start_[p], below_.end(),
              [](const Below& x, const Below& y) { return x.position < y.position; });
    int rows = sizes_[b];
    for (size_t i = below_start_[p]; i < below_.size(); ++i) {
      below_[i].row = rows;
      rows += size_at(below_[i].position);
    }
    panel_start_[p] = offset;
    panel_rows_[p] = rows;
    offset += rows * sizes_[b];
  }
  below_start_[num_blocks_] = static_cast<int>(below_.size());
  panel_start_[num_blocks_] = offset;
  lower_.resize(offset);
  // For LU, which may come late: it shall not allocate in the middle of a run.
  if (num_blocks_ > 1) upper_.reserve(offset);
  pivot_.resize(num_blocks_ > 0 ? start_.back() + sizes_.back() : 0);
}

int BlockFactorization::row_in_panel(int row_position, int column_position) const {
  if (row_position == column_position) return 0;
  const auto first = below_.begin() + below_start_[column_position];
  const auto last = below_.begin() + below_start_[column_position + 1];
  return std::lower_bound(first, last, row_position,
                          [](const Below& x, int value) { return x.position < value; })
      ->row;
}

void BlockFactorization::set_zero(bool unsymmetric) {
  std::fill(lower_.begin(), lower_.end(), 0.0);
  // A single block has nothing to its right.
  if (unsymmetric && num_blocks_ > 1) upper_.assign(lower_.size(), 0.0);
}

BlockFactorization::Block BlockFactorization::block(int i, int j) const {
  const int row = position_[i], column = position_[j];
  return {panel_start_[column] + row_in_panel(row, column), panel_rows_[column]};
}

bool BlockFactorization::factor_cholesky() {
  lu_ = false;
  for (int p = 0; p < num_blocks_; ++p) {
    const int cols = size_at(p), rows = panel_rows_[p];
    double* panel = lower_.data() + panel_start_[p];
    if (factor_panel(panel, rows, cols, rows, 0.0) >= 0) return false;
    const int first = below_start_[p], last = below_start_[p + 1];
    for (int c = first; c < last; ++c) {
      const int target = below_[c].position;
      double* target_panel = lower_.data() + panel_start_[target];
      const int leading = panel_rows_[target], n = size_at(target);
      for (int r = c; r < last; ++r) {
        subtract_product(panel + below_[r].row, rows, panel + below_[c].row, rows,
                         target_panel + row_in_panel(below_[r].position, target), leading,
                         size_at(below_[r].position), n, cols, r == c);
      }
    }
  }
  return true;
}

bool BlockFactorization::factor_lu() {
  lu_ = true;
  for (int p = 0; p < num_blocks_; ++p) {
    const int cols = size_at(p), rows = panel_rows_[p];
    double* below = lower_.data() + panel_start_[p];
    double* right = upper_.data() + panel_start_[p];
    if (!factor_lu_panel(below, right, rows, cols, rows, pivot_.data() + start_[sequence_[p]])) {
      return false;
    }
    const int first = below_start_[p], last = below_start_[p + 1];
    for (int c = first; c < last; ++c) {
      const int target = below_[c].position, leading = panel_rows_[target], n = size_at(target);
      for (int r = c; r < last; ++r) {
        const ptrdiff_t place = panel_start_[target] + row_in_panel(below_[r].position, target);
        const int m = size_at(below_[r].position);
        subtract_product(below + below_[r].row, rows, right + below_[c].row, rows,
                         lower_.data() + place, leading, m, n, cols, false);
        if (r == c) continue;
        subtract_product(right + below_[r].row, rows, below + below_[c].row, rows,
                         upper_.data() + place, leading, m, n, cols, false);
      }
    }
  }
  return true;
}

void BlockFactorization::solve(double* x) const { lu_ ? solve_lu(x) : solve_cholesky(x); }

// x of the blocks below p less their factor times x of p: forward substitution.
void BlockFactorization::eliminate_below(int p, double* x) const {
  const int cols = size_at(p), rows = panel_rows_[p];
  const double* panel = lower_.data() + panel_start_[p];
  const double* own = x + start_[sequence_[p]];
  for (int k = below_start_[p]; k < below_start_[p + 1]; ++k) {
    double* other = x + start_[sequence_[below_[k].position]];
    const int m = size_at(below_[k].position);
    for (int j = 0; j < cols; ++j) {
      const double* column = panel + j * rows + below_[k].row;
      for (int i = 0; i < m; ++i) other[i] -= column[i] * own[j];
    }
  }
}

// x of p less the transposed factor times x of the blocks below: backward substitution.
void BlockFactorization::substitute_below(int p, const std::vector<double>& factor,
                                          double* x) const {
  const int cols = size_at(p), rows = panel_rows_[p];
  const double* panel = factor.data() + panel_start_[p];
  double* own = x + start_[sequence_[p]];
  for (int k = below_start_[p]; k < below_start_[p + 1]; ++k) {
    const double* other = x + start_[sequence_[below_[k].position]];
    const int m = size_at(below_[k].position);
    for (int j = 0; j < cols; ++j) {
      const double* column = panel + j * rows + below_[k].row;
      double sum = 0.0;
      for (int i = 0; i < m; ++i) sum += column[i] * other[i];
      own[j] -= sum;
    }
  }
}

void BlockFactorization::solve_lu(double* x) const {
  for (int p = 0; p < num_blocks_; ++p) {
    const int cols = size_at(p), rows = panel_rows_[p];
    const double* panel = lower_.data() + panel_start_[p];
    const int* pivot = pivot_.data() + start_[sequence_[p]];
    double* own = x + start_[sequence_[p]];
    for (int j = 0; j < cols; ++j) std::swap(own[j], own[pivot[j]]);
    for (int j = 0; j < cols; ++j) {
      for (int i = j + 1; i < cols; ++i) own[i] -= panel[i + j * rows] * own[j];
    }
    eliminate_below(p, x);
  }
  for (int p = num_blocks_ - 1; p >= 0; --p) {
    const int cols = size_at(p), rows = panel_rows_[p];
    const double* panel = lower_.data() + panel_start_[p];
    double* own = x + start_[sequence_[p]];
    substitute_below(p, upper_, x);
    for (int j = cols - 1; j >= 0; --j) {
      own[j] /= panel[j + j * rows];
      for (int i = 0; i < j; ++i) own[i] -= panel[i + j * rows] * own[j];
    }
  }
}

void BlockFactorization::solve_cholesky(double* x) const {
  // x is used in place: each block of it belongs to one panel.
  for (int p = 0; p < num_blocks_; ++p) {
    const int cols = size_at(p), rows = panel_rows_[p];
    const double* panel = lower_.data() + panel_start_[p];
    double* own = x + start_[sequence_[p]];
    for (int j = 0; j < cols; ++j) {
      const double* column = panel + j * rows;
      const double value = own[j] /= column[j];
      for (int i = j + 1; i < cols; ++i) own[i] -= column[i] * value;
    }
    eliminate_below(p, x);
  }
  for (int p = num_blocks_ - 1; p >= 0; --p) {
    const int cols = size_at(p), rows = panel_rows_[p];
    const double* panel = lower_.data() + panel_start_[p];
    double* own = x + start_[sequence_[p]];
    substitute_below(p, lower_, x);
    for (int j = cols - 1; j >= 0; --j) {
      const double* column = panel + j * rows;
      double sum = own[j];
      for (int i = j + 1; i < cols; ++i) sum -= column[i] * own[i];
      own[j] = sum / column[j];
    }
  }
}

}  // namespace counterpoint::contact
