#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/lanes/vector_lanes.h"

namespace counterpoint {
namespace {

using contact::Four;

/// A diagonal entry that is at least this share of the largest entry of its column is the pivot.
constexpr double kPivotShare = 0.1;
/// Number of right-hand sides kept in registers while all terms of a row are subtracted.
constexpr int kColumnChunk = 16;

/// Transposes a block of four by four: out[i] = (in[0][i], in[1][i], ...).
COUNTERPOINT_INTO_EACH void transpose_four(const Four* in, Four* out) {
  const Four a = __builtin_shufflevector(in[0], in[1], 0, 4, 2, 6);
  const Four b = __builtin_shufflevector(in[0], in[1], 1, 5, 3, 7);
  const Four c = __builtin_shufflevector(in[2], in[3], 0, 4, 2, 6);
  const Four d = __builtin_shufflevector(in[2], in[3], 1, 5, 3, 7);
  out[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  out[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  out[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  out[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

/// Sets to = scale from'. `from` has `lines` lines of `length` numbers, from_stride apart.
COUNTERPOINT_WIDE void transpose(const double* from, int from_stride, int lines, int length,
                                 double scale, double* to, int to_stride) {
  int j = 0;
  for (; j + 4 <= lines; j += 4) {
    int i = 0;
    for (; i + 4 <= length; i += 4) {
      Four in[4], out[4];
      COUNTERPOINT_UNROLL
      for (int l = 0; l < 4; ++l) {
        contact::load(from + (j + l) * from_stride + i, in[l]);
        in[l] *= scale;
      }
      transpose_four(in, out);
      COUNTERPOINT_UNROLL
      for (int l = 0; l < 4; ++l) contact::store(out[l], to + (i + l) * to_stride + j);
    }
    for (; i < length; ++i)
      for (int l = 0; l < 4; ++l)
        to[i * to_stride + j + l] = scale * from[(j + l) * from_stride + i];
  }
  for (; j < lines; ++j)
    for (int i = 0; i < length; ++i) to[i * to_stride + j] = scale * from[j * from_stride + i];
}

/// Subtracts factor times pivot from row, in the first `end` entries.
COUNTERPOINT_INTO_EACH void subtract(double factor, const double* pivot, int end, double* row) {
  int c = 0;
  for (; c + 4 <= end; c += 4) {
    Four x, y;
    contact::load(row + c, x);
    contact::load(pivot + c, y);
    contact::store(x - factor * y, row + c);
  }
  for (; c < end; ++c) row[c] -= factor * pivot[c];
}

/// Eliminates column k from all rows before row k, and leaves the factors in its place.
COUNTERPOINT_WIDE void eliminate_column(double* rows, int stride, int k) {
  const double* pivot = rows + k * stride;
  const double inverse = 1.0 / pivot[k];
  for (int i = 0; i < k; ++i) {
    double* row = rows + i * stride;
    if (row[k] == 0.0) continue;
    row[k] *= inverse;
    subtract(row[k], pivot, k, row);
  }
}

/// Sets target = scale (target - sum of factor times row over the terms).
COUNTERPOINT_WIDE void take_off(const EliminationTerm* terms, int count, const double* rows,
                                int stride, double scale, double* target) {
  for (int c = 0; c < stride; c += kColumnChunk) {
    Four sum[kColumnChunk / 4];
    COUNTERPOINT_UNROLL
    for (int l = 0; l < kColumnChunk / 4; ++l) contact::load(target + c + 4 * l, sum[l]);
    for (int t = 0; t < count; ++t) {
      const double* row = rows + terms[t].row * stride + c;
      COUNTERPOINT_UNROLL
      for (int l = 0; l < kColumnChunk / 4; ++l) {
        Four x;
        contact::load(row + 4 * l, x);
        sum[l] -= terms[t].factor * x;
      }
    }
    COUNTERPOINT_UNROLL
    for (int l = 0; l < kColumnChunk / 4; ++l) contact::store(sum[l] * scale, target + c + 4 * l);
  }
}

void grow(std::vector<double>& numbers, int size) {
  if (numbers.size() < static_cast<size_t>(size)) numbers.resize(static_cast<size_t>(size));
}

}  // namespace

std::vector<int> coordinate_parents(const Model& model) {
  std::vector<int> parents(static_cast<size_t>(model.nv()), -1);
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const int nv = joint_nv(body.joint_type);
    for (int j = 0; j < nv; ++j) {
      int& parent = parents[static_cast<size_t>(body.v_index + j)];
      if (j > 0) {
        parent = body.v_index + j - 1;
      } else if (body.parent != 0) {
        const Body& carrier = model.body(body.parent);
        parent = carrier.v_index + joint_nv(carrier.joint_type) - 1;
      }
    }
  }
  return parents;
}

void SparseSolver::begin_tree(const Eigen::Ref<const MatrixX>& A, const std::vector<int>& parents,
                              int first, int columns) {
  begin(A, columns);
  parents_ = parents.data() + first;
  first_ = first;
}

void SparseSolver::begin(const Eigen::Ref<const MatrixX>& A, int columns) {
  parents_ = nullptr;
  n_ = static_cast<int>(A.rows());
  columns_ = columns;
  stride_ = (n_ + 3) / 4 * 4;
  width_ = (columns + kColumnChunk - 1) / kColumnChunk * kColumnChunk;
  grow(A_, n_ * stride_);
  grow(B_, n_ * width_);
  for (int i = 0; i < n_; ++i)
    std::fill(B_.begin() + i * width_ + columns, B_.begin() + (i + 1) * width_, 0.0);
  transpose(A.data(), static_cast<int>(A.outerStride()), n_, n_, 1.0, A_.data(), stride_);
}

void SparseSolver::add(const Eigen::Ref<const MatrixX>& B, int column, double scale) {
  transpose(B.data(), static_cast<int>(B.outerStride()), static_cast<int>(B.cols()), n_, scale,
            B_.data() + column, width_);
}

void SparseSolver::add_identity(int column) {
  for (int i = 0; i < n_; ++i) {
    double* row = B_.data() + i * width_ + column;
    std::fill(row, row + n_, 0.0);
    row[i] = 1.0;
  }
}

/// Factors A, with rows in a new order, into (unit upper triangle) (lower triangle).
bool SparseSolver::factor() {
  order_.resize(static_cast<size_t>(n_));
  for (int i = 0; i < n_; ++i) order_[static_cast<size_t>(i)] = i;
  exchanged_ = false;
  for (int k = n_ - 1; k >= 0; --k) {
    const auto entry = [&](int i) { return std::abs(A_[static_cast<size_t>(i * stride_ + k)]); };
    int best = k;
    for (int i = 0; i < k; ++i)
      if (entry(i) > entry(best)) best = i;
    if (!(entry(best) > 0.0)) return false;
    if (entry(k) < kPivotShare * entry(best)) {
      std::swap_ranges(A_.begin() + k * stride_, A_.begin() + (k + 1) * stride_,
                       A_.begin() + best * stride_);
      std::swap(order_[static_cast<size_t>(k)], order_[static_cast<size_t>(best)]);
      exchanged_ = true;
    }
    eliminate_column(A_.data(), stride_, k);
  }
  return true;
}

/// Factors A = L' D L (Featherstone 2008, section 6.5) on the lower triangle, which becomes
/// D L. Lists the terms of all rows as list_terms does; the upper ones are L'.
bool SparseSolver::factor_tree() {
  const auto parent = [&](int i) { return parents_[i] - first_; };
  exchanged_ = false;
  above_.assign(static_cast<size_t>(n_) + 1, 0);
  below_.assign(static_cast<size_t>(n_) + 1, 0);
  // Number of ancestors of each row in below_, and of descendants in above_.
  for (int k = 0; k < n_; ++k) {
    below_[static_cast<size_t>(k)] =
        parent(k) >= 0 ? below_[static_cast<size_t>(parent(k))] + 1 : 0;
    for (int i = parent(k); i >= 0; i = parent(i)) ++above_[static_cast<size_t>(i)];
  }
  int at = 0;
  for (int i = 0; i <= n_; ++i) {
    const int carried = above_[static_cast<size_t>(i)], carry = below_[static_cast<size_t>(i)];
    above_[static_cast<size_t>(i)] = at;
    below_[static_cast<size_t>(i)] = at;  // next free upper term; ends at the first lower one
    at += carried + carry;
  }
  terms_.resize(static_cast<size_t>(at));
  for (int k = n_ - 1; k >= 0; --k) {
    const double* pivot = A_.data() + k * stride_;
    if (!(pivot[k] > 0.0)) return false;
    const double inverse = 1.0 / pivot[k];
    int below = below_[static_cast<size_t>(k)];
    for (int i = parent(k); i >= 0; i = parent(i)) {
      terms_[static_cast<size_t>(below++)] = {i, pivot[i]};
      const double factor = pivot[i] * inverse;
      terms_[static_cast<size_t>(below_[static_cast<size_t>(i)]++)] = {k, factor};
      double* row = A_.data() + i * stride_;
      for (int j = i; j >= 0; j = parent(j)) row[j] -= factor * pivot[j];
    }
  }
  return true;
}

/// Lists the nonzero factors of each row as terms.
void SparseSolver::list_terms() {
  terms_.clear();
  terms_.reserve(static_cast<size_t>(n_) * static_cast<size_t>(n_));
  above_.resize(static_cast<size_t>(n_) + 1);
  below_.resize(static_cast<size_t>(n_) + 1);
  const auto list = [&](int i, int begin, int end) {
    const double* row = A_.data() + i * stride_;
    for (int k = begin; k < end; ++k)
      if (row[k] != 0.0) terms_.push_back({k, row[k]});
  };
  for (int i = 0; i < n_; ++i) {
    above_[static_cast<size_t>(i)] = static_cast<int>(terms_.size());
    list(i, i + 1, n_);
    below_[static_cast<size_t>(i)] = static_cast<int>(terms_.size());
    list(i, 0, i);
  }
  above_[static_cast<size_t>(n_)] = static_cast<int>(terms_.size());
}

bool SparseSolver::solve() {
  if (parents_ != nullptr) {
    if (!factor_tree()) return false;
  } else {
    if (!factor()) return false;
    list_terms();
  }
  if (exchanged_) {
    grow(moved_, n_ * width_);
    for (int i = 0; i < n_; ++i) {
      const auto from = B_.begin() + order_[static_cast<size_t>(i)] * width_;
      std::copy(from, from + width_, moved_.begin() + i * width_);
    }
    B_.swap(moved_);
  }
  const auto take = [&](int i, int begin, int end, double scale) {
    take_off(terms_.data() + begin, end - begin, B_.data(), width_, scale, B_.data() + i * width_);
  };
  for (int i = n_ - 1; i >= 0; --i) {
    const auto at = static_cast<size_t>(i);
    if (above_[at] < below_[at]) take(i, above_[at], below_[at], 1.0);
  }
  for (int i = 0; i < n_; ++i) {
    const auto at = static_cast<size_t>(i);
    take(i, below_[at], above_[at + 1], 1.0 / A_[static_cast<size_t>(i * stride_ + i)]);
  }
  return true;
}

void SparseSolver::get(int column, Eigen::Ref<MatrixX> out) const {
  transpose(B_.data() + column, width_, n_, static_cast<int>(out.cols()), 1.0, out.data(),
            static_cast<int>(out.outerStride()));
}

}  // namespace counterpoint
