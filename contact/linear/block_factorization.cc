#include "counterpoint/contact/linear/block_factorization.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/lanes/vector_lanes.h"

namespace counterpoint::contact {

void BlockFactorization::begin_structure(const std::vector<int>& sizes) {
  sizes_.assign(sizes.begin(), sizes.end());
  couples_.clear();
}

void BlockFactorization::end_structure() {
  if (known_ && sizes_ == known_sizes_ && couples_ == known_couples_) return;
  known_ = true;
  known_sizes_ = sizes_;
  known_couples_ = couples_;
  order_.compute(sizes_, couples_);
  lay_out();
}

void BlockFactorization::lay_out() {
  const size_t n = sizes_.size();
  start_.resize(n);
  first_.resize(n);
  front_of_.resize(n);
  size_ = 0;
  for (size_t b = 0; b < n; ++b) {
    start_[b] = size_;
    size_ += sizes_[b];
  }
  int position = 0;
  for (const int b : order_.sequence()) {
    first_[b] = position;
    position += sizes_[b];
  }
  lay_out_rows();
  lay_out_rests();
  runs_.clear();
  for (Front& front : fronts_) lay_out_runs(front);
  for (auto* v : {&inverse_, &diagonal_, &growth_of_, &x_, &below_}) v->resize(size_);
  front_growth_.resize(in_fours(static_cast<int>(size_)));
  pivot_.reserve(size_);
  if (can_pivot()) dense_.reserve(static_cast<size_t>(size_) * size_);
}

// Lays out the fronts, their panels and the rows below each.
void BlockFactorization::lay_out_rows() {
  fronts_.clear();
  rows_.clear();
  std::ptrdiff_t panel = 0;
  int first = 0;
  const auto& begin = order_.front_begin();
  for (size_t f = 0; f < order_.fronts().size(); ++f) {
    const EliminationOrder::Front& from = order_.fronts()[f];
    Front front{};
    front.first = first;
    front.parent = from.parent;
    front.panel = panel;
    front.rows_begin = static_cast<int>(rows_.size());
    front.leaf = true;
    for (int k = begin[f]; k < begin[f + 1]; ++k) {
      const int b = order_.sequence()[k];
      front_of_[b] = static_cast<int>(f);
      front.shape.cols += sizes_[b];
    }
    for (int k = from.below_begin; k < from.below_end; ++k) {
      const int b = order_.below()[k];
      for (int i = 0; i < sizes_[b]; ++i) rows_.push_back(first_[b] + i);
    }
    std::sort(rows_.begin() + front.rows_begin, rows_.end());
    const int cols = front.shape.cols;
    const int below = front.shape.below = static_cast<int>(rows_.size()) - front.rows_begin;
    front.shape.leading = std::max(in_fours(cols + below), cols + in_fours(below));
    front.shape.leading_rest = in_fours(below);
    first += cols;
    panel += static_cast<std::ptrdiff_t>(front.shape.leading) * cols;
    fronts_.push_back(front);
  }
  lower_.resize(panel);
  common_.reserve(panel);
  upper_.reserve(panel);  // else the first LU would allocate in the middle of a run
}

// Lays out the Schur complements (`rest`). A front adds its own to its parent at once, so only
// those of its ancestors, which accumulate, exist beside it.
void BlockFactorization::lay_out_rests() {
  std::ptrdiff_t most = 0;
  for (int f = static_cast<int>(fronts_.size()) - 1; f >= 0; --f) {
    Front& front = fronts_[f];
    if (front.parent >= 0) {
      const Front& parent = fronts_[front.parent];
      front.rest =
          parent.rest + static_cast<std::ptrdiff_t>(parent.shape.leading_rest) * parent.shape.below;
    }
    most = std::max(most, front.rest + static_cast<std::ptrdiff_t>(front.shape.leading_rest) *
                                           front.shape.below);
  }
  for (Front& front : fronts_) {
    if (front.parent < 0) continue;
    front.first_child = fronts_[front.parent].leaf;
    fronts_[front.parent].leaf = false;
  }
  rests_.resize(most);
  upper_rests_.reserve(most);
}

// Finds the places of the front's rows among its parent's.
void BlockFactorization::lay_out_runs(Front& front) {
  front.runs_begin = static_cast<int>(runs_.size());
  if (front.parent >= 0) {
    const Front& parent = fronts_[front.parent];
    const int* above = rows_.data() + parent.rows_begin;
    int place = 0;  // index in the parent's rows below
    for (int i = 0; i < front.shape.below; ++i) {
      const int position = rows_[front.rows_begin + i];
      int to = position - parent.first;
      if (to >= parent.shape.cols) {
        while (above[place] < position) ++place;
        to = parent.shape.cols + place;
      }
      const bool goes_on =
          i > 0 && runs_.back().to + runs_.back().count == to && to != parent.shape.cols;
      if (goes_on) {
        ++runs_.back().count;
      } else {
        runs_.push_back({i, to, 1});
      }
    }
  }
  front.runs_end = static_cast<int>(runs_.size());
}

int BlockFactorization::row_in_front(int position, const Front& front) const {
  if (position < front.first + front.shape.cols) return position - front.first;
  const auto first = rows_.begin() + front.rows_begin;
  const auto last = first + front.shape.below;
  return front.shape.cols + static_cast<int>(std::lower_bound(first, last, position) - first);
}

void BlockFactorization::set_zero(bool unsymmetric) {
  std::fill(lower_.begin(), lower_.end(), 0.0);
  if (unsymmetric) upper_.assign(lower_.size(), 0.0);
}

void BlockFactorization::set_common(bool unsymmetric) {
  std::copy(common_.begin(), common_.end(), lower_.begin());
  if (unsymmetric) upper_ = common_;
}

BlockFactorization::Block BlockFactorization::block(int i, int j) const {
  const Front& front = fronts_[front_of_[j]];
  return {front.panel + row_in_front(first_[i], front) +
              static_cast<std::ptrdiff_t>(first_[j] - front.first) * front.shape.leading,
          front.shape.leading};
}

// Adds the Schur complement of a front to the columns and the rest of its parent.
void BlockFactorization::add_rest(const Front& front, std::vector<double>& panels,
                                  std::vector<double>& rests) const {
  if (front.parent < 0) return;
  const Front& parent = fronts_[front.parent];
  const int cols = parent.shape.cols;
  double* parent_rest = rests.data() + parent.rest;
  const std::ptrdiff_t leading = parent.shape.leading_rest;
  if (front.first_child) std::fill(parent_rest, parent_rest + leading * parent.shape.below, 0.0);
  const double* from = rests.data() + front.rest;
  for (int a = front.runs_begin; a < front.runs_end; ++a) {
    for (int j = 0; j < runs_[a].count; ++j, from += front.shape.leading_rest) {
      const int column = runs_[a].to + j;
      double* to = column < cols ? panels.data() + parent.panel +
                                       static_cast<std::ptrdiff_t>(column) * parent.shape.leading
                                 : parent_rest - cols + leading * (column - cols);
      for (int b = a; b < front.runs_end; ++b) {
        const Run& run = runs_[b];
        const double* __restrict source = from + run.from;
        double* __restrict target = to + run.to;
        for (int i = b == a ? j : 0; i < run.count; ++i) target[i] += source[i];
      }
    }
  }
}

bool BlockFactorization::factor_cholesky() {
  kind_ = Kind::kCholesky;
  for (const Front& front : fronts_) {
    if (!factor_front_cholesky(front.shape, lower_.data() + front.panel,
                               inverse_.data() + front.first, rests_.data() + front.rest,
                               front.leaf)) {
      return false;
    }
    add_rest(front, lower_, rests_);
  }
  return true;
}

bool BlockFactorization::factor_lu() {
  kind_ = Kind::kLu;
  upper_rests_.resize(rests_.size());
  keep_diagonal();
  for (const Front& front : fronts_) {
    double* growth = front_growth_.data();
    if (!factor_front_lu(front.shape, lower_.data() + front.panel, upper_.data() + front.panel,
                         inverse_.data() + front.first, rests_.data() + front.rest,
                         upper_rests_.data() + front.rest, front.leaf, growth)) {
      return false;
    }
    add_rest(front, lower_, rests_);
    add_rest(front, upper_, upper_rests_);
    const int cols = front.shape.cols;
    for (int i = 0; i < cols; ++i) growth_of_[front.first + i] += growth[i];
    const int* rows = rows_.data() + front.rows_begin;
    for (int i = 0; i < front.shape.below; ++i) growth_of_[rows[i]] += growth[cols + i];
  }
  growth_ = 0.0;
  for (int i = 0; i < size_; ++i) {
    // NaN counts as large, too.
    const double growth = growth_of_[i] / std::abs(diagonal_[i]);
    if (!(growth <= growth_)) growth_ = growth;
  }
  return true;
}

void BlockFactorization::keep_diagonal() {
  std::fill(growth_of_.begin(), growth_of_.end(), 0.0);
  for (const Front& front : fronts_) {
    const double* panel = lower_.data() + front.panel;
    for (int j = 0; j < front.shape.cols; ++j)
      diagonal_[front.first + j] =
          panel[static_cast<std::ptrdiff_t>(j) * (front.shape.leading + 1)];
  }
}

// Assembles the dense matrix in the order of elimination, which the panels have, and factors it.
bool BlockFactorization::factor_pivoted() {
  kind_ = Kind::kPivoted;
  const std::ptrdiff_t n = size_;
  dense_.assign(n * n, 0.0);
  pivot_.resize(n);
  for (const Front& front : fronts_) {
    const int rows = front.shape.cols + front.shape.below;
    for (int j = 0; j < front.shape.cols; ++j) {
      const std::ptrdiff_t column = front.first + j;
      const std::ptrdiff_t place =
          front.panel + static_cast<std::ptrdiff_t>(j) * front.shape.leading;
      for (int i = j; i < rows; ++i) {
        const std::ptrdiff_t row =
            i < front.shape.cols ? front.first + i : rows_[front.rows_begin + i - front.shape.cols];
        dense_[row + n * column] = lower_[place + i];
        if (row != column) dense_[column + n * row] = upper_[place + i];
      }
    }
  }
  return contact::factor_pivoted(dense_.data(), size_, pivot_.data());
}

void BlockFactorization::solve(double* x) const {
  // Blocks are small: loops copy them faster than calls.
  for (size_t b = 0; b < sizes_.size(); ++b) {
    double* to = x_.data() + first_[b];
    const double* from = x + start_[b];
    for (int i = 0; i < sizes_[b]; ++i) to[i] = from[i];
  }
  switch (kind_) {
    case Kind::kCholesky:
      solve_fronts(true, lower_);
      break;
    case Kind::kLu:
      solve_fronts(false, upper_);
      break;
    case Kind::kPivoted:
      solve_pivoted();
      break;
  }
  for (size_t b = 0; b < sizes_.size(); ++b) {
    const double* from = x_.data() + first_[b];
    double* to = x + start_[b];
    for (int i = 0; i < sizes_[b]; ++i) to[i] = from[i];
  }
}

// Solves in place of x_; `right` holds the entries right of the diagonal, transposed.
void BlockFactorization::solve_fronts(bool scaled, const std::vector<double>& right) const {
  double* below = below_.data();
  for (const Front& front : fronts_) {
    solve_front_forward(front.shape, lower_.data() + front.panel, inverse_.data() + front.first,
                        scaled, x_.data() + front.first, below);
    const int* rows = rows_.data() + front.rows_begin;
    for (int i = 0; i < front.shape.below; ++i) x_[rows[i]] -= below[i];
  }
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {
    const int* rows = rows_.data() + front->rows_begin;
    for (int i = 0; i < front->shape.below; ++i) below[i] = x_[rows[i]];
    solve_front_backward(front->shape, right.data() + front->panel, inverse_.data() + front->first,
                         below, x_.data() + front->first);
  }
}

void BlockFactorization::solve_pivoted() const {
  const std::ptrdiff_t n = size_;
  double* x = x_.data();
  for (int j = 0; j < n; ++j) std::swap(x[j], x[pivot_[j]]);
  for (int j = 0; j < n; ++j) {
    const double* column = dense_.data() + j * n;
    for (int i = j + 1; i < n; ++i) x[i] -= column[i] * x[j];
  }
  for (int j = size_ - 1; j >= 0; --j) {
    const double* column = dense_.data() + j * n;
    x[j] /= column[j];
    for (int i = 0; i < j; ++i) x[i] -= column[i] * x[j];
  }
}

}  // namespace counterpoint::contact
