#include "counterpoint/contact/linear/packed_jacobian.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "counterpoint/contact/lanes/vector_lanes.h"
#include "counterpoint/contact/linear/row_count.h"

namespace counterpoint::contact {
namespace {

using Constraint = PackedJacobian::Constraint;
using Strip = PackedJacobian::Strip;

// Constraints and strips: the layout of the entries of J.
struct Layout {
  std::span<const Constraint> constraints;
  const Strip* strips;
};

// Doubles per column: three rows take four lanes, one of which is zero.
constexpr int lanes(int rows) { return rows == 3 ? 4 : rows; }
// A contact stores all six columns of a free body if the range of nonzero ones has kMostOfSix or
// more.
constexpr int kFreeBody = 6, kMostOfSix = 4;

// Policies of the products: entries of J and x with their signs, or their absolute values, whose
// products are added to the result.
struct AsTheyAre {
  static constexpr bool kAdds = false;  // the result is overwritten
  template <class Real>
  COUNTERPOINT_INTO_EACH static void take(Real&) {}
};
struct Sizes {
  static constexpr bool kAdds = true;
  template <class Real>
  COUNTERPOINT_INTO_EACH static void take(Real& x) {
    x = x < 0.0 ? -x : x;
  }
};

// Computes y = J x of a constraint. Each row is summed in the order of the columns.
template <class Of, int N>
COUNTERPOINT_INTO_EACH void multiply_one(const Constraint& c, const Strip* strips,
                                         const double* columns, const double* x, double* out) {
  constexpr int kLanes = lanes(N);
  double y[kLanes] = {};
  if constexpr (Of::kAdds) std::copy(out, out + N, y);
  for (const Strip* s = strips + c.first_strip; s != strips + c.end_strip; ++s) {
    for (int k = 0; k < s->size; ++k, columns += kLanes) {
      double value = x[s->velocity + k];
      Of::take(value);
      for (int r = 0; r < N; ++r) {
        double entry = columns[r];
        Of::take(entry);
        y[r] += entry * value;
      }
    }
  }
  std::copy(y, y + N, out);
}

template <class Of, int N>
COUNTERPOINT_INTO_EACH void multiply_four(const Constraint& c, const Strip* strips,
                                          const double* columns, const double* x, double* out) {
  Four y{};
  if constexpr (Of::kAdds)
    for (int r = 0; r < N; ++r) y[r] = out[r];
  for (const Strip* s = strips + c.first_strip; s != strips + c.end_strip; ++s) {
    for (int k = 0; k < s->size; ++k, columns += 4) {
      double value = x[s->velocity + k];
      Four column;
      load(columns, column);
      Of::take(value);
      Of::take(column);
      y += column * value;
    }
  }
  for (int r = 0; r < N; ++r) out[r] = y[r];
}

template <class Of, int N>
COUNTERPOINT_INTO_EACH void multiply_rows(const Constraint& c, const Strip* strips,
                                          const double* columns, const double* x, double* out) {
  if constexpr (lanes(N) == 4) {
    multiply_four<Of, N>(c, strips, columns, x, out);
  } else {
    multiply_one<Of, N>(c, strips, columns, x, out);
  }
}

// Calls visit(constraint, RowCount<rows>()) for each.
template <class Visit>
COUNTERPOINT_INTO_EACH void visit_each(const Layout& layout, Visit visit) {
  for (const Constraint& c : layout.constraints)
    with_rows(
        c.rows, [&](auto rows) __attribute__((always_inline)) { visit(c, rows); });
}

template <class Of>
COUNTERPOINT_INTO_EACH void multiply_each(const Layout& layout, const double* by_column,
                                          const double* x, double* out) {
  visit_each(
      layout, [&]<int N>(const Constraint& c, RowCount<N>) __attribute__((always_inline)) {
        multiply_rows<Of, N>(c, layout.strips, by_column + c.by_column, x, out + c.row);
      });
}

COUNTERPOINT_WIDE void multiply_all(const Layout& layout, const double* by_column, const double* x,
                                    double* out) {
  multiply_each<AsTheyAre>(layout, by_column, x, out);
}

COUNTERPOINT_WIDE void multiply_constraint(const Constraint& c, const Strip* strips,
                                           const double* columns, const double* x, double* out) {
  with_rows(
      c.rows, [&]<int N>(RowCount<N>) __attribute__((always_inline)) {
        multiply_rows<AsTheyAre, N>(c, strips, columns, x, out);
      });
}

COUNTERPOINT_WIDE void add_sizes(const Layout& layout, const double* by_column, const double* x,
                                 double* out) {
  multiply_each<Sizes>(layout, by_column, x, out);
}

// Adds J' f to as many columns as Lanes holds; square += its weighted square.
template <int N, class Lanes>
COUNTERPOINT_INTO_EACH void add_lanes(const double* rows, int leading, const double* f,
                                      const double* weight, double* out, Lanes& square) {
  Lanes row, sum, w, o;
  load(rows, row);
  sum = row * f[0];
  COUNTERPOINT_UNROLL
  for (int r = 1; r < N; ++r) {
    load(rows + static_cast<std::ptrdiff_t>(r) * leading, row);
    sum += row * f[r];
  }
  load(out, o);
  o += sum;
  store(o, out);
  load(weight, w);
  square += sum * sum * w;
}

struct Squares {
  Four four{};
  Two two{};
  double one = 0.0;
};

template <int N>
COUNTERPOINT_INTO_EACH void add_transposed_one(const Constraint& c, const Strip* strips,
                                               const double* rows, const double* f,
                                               const double* weight, double* out,
                                               Squares& squares) {
  const int leading = c.leading;
  for (const Strip* s = strips + c.first_strip; s != strips + c.end_strip; rows += s->size, ++s) {
    double* to = out + s->velocity;
    const double* w = weight + s->velocity;
    int k = 0;
    for (; k + 4 <= s->size; k += 4)
      add_lanes<N>(rows + k, leading, f, w + k, to + k, squares.four);
    if (k + 2 <= s->size) {
      add_lanes<N>(rows + k, leading, f, w + k, to + k, squares.two);
      k += 2;
    }
    if (k == s->size) continue;
    double sum = rows[k] * f[0];
    COUNTERPOINT_UNROLL
    for (int r = 1; r < N; ++r) sum += rows[r * leading + k] * f[r];
    to[k] += sum;
    squares.one += sum * sum * w[k];
  }
}

COUNTERPOINT_WIDE double add_transposed_all(const Layout& layout, const double* by_row,
                                            const double* f, const double* weight, double* out) {
  Squares squares;
  visit_each(
      layout, [&]<int N>(const Constraint& c, RowCount<N>) __attribute__((always_inline)) {
        add_transposed_one<N>(c, layout.strips, by_row + c.by_row, f + c.row, weight, out, squares);
      });
  const Four& four = squares.four;
  return ((four[0] + four[1]) + (four[2] + four[3])) +
         ((squares.two[0] + squares.two[1]) + squares.one);
}

// Adds |J|' e to as many columns as Lanes holds, row after row.
template <int N, class Lanes>
COUNTERPOINT_INTO_EACH void add_size_lanes(const double* rows, int leading, const double* e,
                                           double* out) {
  Lanes row, o;
  load(out, o);
  COUNTERPOINT_UNROLL
  for (int r = 0; r < N; ++r) {
    load(rows + static_cast<std::ptrdiff_t>(r) * leading, row);
    Sizes::take(row);
    o += row * e[r];
  }
  store(o, out);
}

COUNTERPOINT_WIDE void add_sizes_transposed(const Layout& layout, const double* by_row,
                                            const double* e, double* out) {
  visit_each(
      layout, [&]<int N>(const Constraint& c, RowCount<N>) __attribute__((always_inline)) {
        const double* at = by_row + c.by_row;
        for (const Strip* s = layout.strips + c.first_strip; s != layout.strips + c.end_strip;
             at += s->size, ++s) {
          double* to = out + s->velocity;
          int k = 0;
          for (; k + 4 <= s->size; k += 4)
            add_size_lanes<N, Four>(at + k, c.leading, e + c.row, to + k);
          for (; k < s->size; ++k) add_size_lanes<N, double>(at + k, c.leading, e + c.row, to + k);
        }
      });
}

// Packs the columns first ... last - 1 of N rows of length `width`, column-major.
template <int N>
void pack_columns(const double* __restrict jacobian, int width, int first, int last,
                  double* __restrict out) {
  for (int j = first; j < last; ++j, out += lanes(N)) {
    for (int r = 0; r < N; ++r) out[r] = jacobian[static_cast<std::ptrdiff_t>(r) * width + j];
    if (lanes(N) > N) out[N] = 0.0;
  }
}

// Packs the same columns row-major: N rows of length `leading`, with zeros at their ends.
template <int N>
void pack_rows(const double* __restrict by_column, int num_columns, int leading,
               double* __restrict out) {
  for (int k = 0; k < num_columns; ++k, by_column += lanes(N))
    for (int r = 0; r < N; ++r) out[static_cast<std::ptrdiff_t>(r) * leading + k] = by_column[r];
  for (int k = num_columns; k < leading; ++k)
    for (int r = 0; r < N; ++r) out[static_cast<std::ptrdiff_t>(r) * leading + k] = 0.0;
}

void grow(std::vector<double>& values, int size) {
  const auto needed = static_cast<size_t>(size);
  if (values.size() < needed) values.resize(std::max(needed, 2 * values.size()));
}

// Sums the absolute values in each column, to find zero columns. The matrix is row-major, `width`
// wide.
void add_column_sizes(const double* __restrict rows, int num_rows, int width,
                      double* __restrict sums) {
  for (int j = 0; j < width; ++j) sums[j] = std::abs(rows[j]);
  for (int r = 1; r < num_rows; ++r)
    for (int j = 0; j < width; ++j)
      sums[j] += std::abs(rows[static_cast<std::ptrdiff_t>(r) * width + j]);
}

}  // namespace

void PackedJacobian::clear() {
  num_rows_ = 0;
  constraints_.clear();
  strips_.clear();
  column_end_ = row_end_ = 0;
}

void PackedJacobian::begin_constraint(int rows) {
  Constraint& c = constraints_.emplace_back();
  c.rows = rows;
  c.row = num_rows_;
  c.first_strip = static_cast<int>(strips_.size());
  c.by_column = column_end_;
  c.by_row = row_end_;
  num_rows_ += rows;
}

void PackedJacobian::add_side(const double* jacobian, const double* other, int width,
                              const Group* groups, int num_groups, int first_group) {
  Constraint& c = constraints_.back();
  const size_t count = static_cast<size_t>(c.rows) * width;
  if (other != nullptr) {
    side_.resize(count);
    for (size_t i = 0; i < count; ++i) side_[i] = jacobian[i] + other[i];
    jacobian = side_.data();
  }
  sizes_.resize(width);
  add_column_sizes(jacobian, c.rows, width, sizes_.data());
  for (int g = 0; g < num_groups; ++g) {
    int first = groups[g].velocity - groups[0].velocity, last = first + groups[g].size;
    while (first < last && sizes_[first] == 0.0) ++first;
    while (first < last && sizes_[last - 1] == 0.0) --last;
    if (first == last) continue;
    if (groups[g].size == kFreeBody && c.rows >= 3 && last - first >= kMostOfSix) {
      first = groups[g].velocity - groups[0].velocity;
      last = first + kFreeBody;
    }
    strips_.push_back({groups[0].velocity + first, last - first, first_group + g});
    c.num_columns += last - first;
    const int place = column_end_;
    column_end_ += lanes(c.rows) * (last - first);
    grow(by_column_, column_end_);
    with_rows(c.rows, [&]<int N>(RowCount<N>) {
      pack_columns<N>(jacobian, width, first, last, by_column_.data() + place);
    });
  }
}

void PackedJacobian::end_constraint() {
  Constraint& c = constraints_.back();
  c.end_strip = static_cast<int>(strips_.size());
  c.leading = in_fours(c.num_columns);
  row_end_ += c.rows * c.leading;
  grow(by_row_, row_end_);
  const double* from = by_column_.data() + c.by_column;
  with_rows(c.rows, [&]<int N>(RowCount<N>) {
    pack_rows<N>(from, c.num_columns, c.leading, by_row_.data() + c.by_row);
  });
}

bool PackedJacobian::touch_the_same(const Constraint& a, const Constraint& b) const {
  const Strip* const first = strips_.data();
  return std::equal(first + a.first_strip, first + a.end_strip, first + b.first_strip,
                    first + b.end_strip);
}

double PackedJacobian::first_row_square(const Constraint& c, const double* weight) const {
  double sum = 0.0;
  const double* row = by_row(c);
  for (int s = c.first_strip; s < c.end_strip; ++s) {
    const double* w = weight + strips_[s].velocity;
    for (int k = 0; k < strips_[s].size; ++k, ++row) sum += *row * *row * w[k];
  }
  return sum;
}

void PackedJacobian::multiply(const double* x, double* out) const {
  multiply_all({constraints_, strips_.data()}, by_column_.data(), x, out);
}

void PackedJacobian::multiply(const Constraint& c, const double* x, double* out) const {
  multiply_constraint(c, strips_.data(), by_column_.data() + c.by_column, x, out);
}

double PackedJacobian::add_transposed(const double* f, const double* weight, double* out) const {
  return add_transposed_all({constraints_, strips_.data()}, by_row_.data(), f, weight, out);
}

void PackedJacobian::add_absolute(const double* x, double* out) const {
  add_sizes({constraints_, strips_.data()}, by_column_.data(), x, out);
}

void PackedJacobian::add_absolute_transposed(const double* e, double* out) const {
  add_sizes_transposed({constraints_, strips_.data()}, by_row_.data(), e, out);
}

}  // namespace counterpoint::contact
