#include "counterpoint/contact/linear/packed_jacobian.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "counterpoint/contact/linear/row_count.h"
#include "counterpoint/contact/linear/vector_lanes.h"

namespace counterpoint::contact {
namespace {

using Constraint = PackedJacobian::Constraint;
using Strip = PackedJacobian::Strip;

// A column's room: three rows are four lanes of which one is zero.
constexpr int lanes(int rows) { return rows == 3 ? 4 : rows; }
// A contact takes all six columns of a free body if it has so many.
constexpr int kFreeBody = 6, kMostOfSix = 4;

// y = J x of a constraint. Sums run over the columns one after the other, row by row apart.
template <int N>
COUNTERPOINT_INTO_EACH void multiply_one(const Constraint& c, const Strip* strips,
                                         const double* columns, const double* x, double* out) {
  constexpr int kLanes = lanes(N);
  double y[kLanes] = {};
  for (const Strip* s = strips + c.first_strip; s != strips + c.end_strip; ++s) {
    const double* value = x + s->velocity;
    for (int k = 0; k < s->size; ++k, columns += kLanes) {
      for (int r = 0; r < N; ++r) y[r] += columns[r] * value[k];
    }
  }
  std::copy(y, y + N, out);
}

template <int N>
COUNTERPOINT_INTO_EACH void multiply_four(const Constraint& c, const Strip* strips,
                                          const double* columns, const double* x, double* out) {
  Four y{};
  for (const Strip* s = strips + c.first_strip; s != strips + c.end_strip; ++s) {
    const double* value = x + s->velocity;
    for (int k = 0; k < s->size; ++k, columns += 4) {
      Four column;
      load(columns, column);
      y += column * value[k];
    }
  }
  for (int r = 0; r < N; ++r) out[r] = y[r];
}

COUNTERPOINT_WIDE void multiply_all(const Constraint* first, const Constraint* last,
                                    const Strip* strips, const double* by_column, const double* x,
                                    double* out) {
  for (const Constraint* c = first; c != last; ++c) {
    const double* columns = by_column + c->by_column;
    with_rows(
        c->rows, [&]<int N>(RowCount<N>) __attribute__((always_inline)) {
          if constexpr (lanes(N) == 4) {
            multiply_four<N>(*c, strips, columns, x, out + c->row);
          } else {
            multiply_one<N>(*c, strips, columns, x, out + c->row);
          }
        });
  }
}

// out += J' f for a few columns: as many as there are in Lanes. square += its weighted square.
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
                                               Squares& squares) {  // Parameters: matrices and their places
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

// Parameters: matrices and their places.
COUNTERPOINT_WIDE double add_transposed_all(const Constraint* first, const Constraint* last,
                                            const Strip* strips, const double* by_row,
                                            const double* f, const double* weight, double* out) {
  Squares squares;
  for (const Constraint* c = first; c != last; ++c) {
    with_rows(
        c->rows, [&]<int N>(RowCount<N>) __attribute__((always_inline)) {
          add_transposed_one<N>(*c, strips, by_row + c->by_row, f + c->row, weight, out, squares);
        });
  }
  const Four& four = squares.four;
  return ((four[0] + four[1]) + (four[2] + four[3])) +
         ((squares.two[0] + squares.two[1]) + squares.one);
}

// Columns first ... last - 1 of N rows of `width`, one after the other.
template <int N>
void pack_columns(const double* __restrict jacobian, int width, int first, int last,
                  double* __restrict out) {
  for (int j = first; j < last; ++j, out += lanes(N)) {
    for (int r = 0; r < N; ++r) out[r] = jacobian[static_cast<std::ptrdiff_t>(r) * width + j];
    if (lanes(N) > N) out[N] = 0.0;
  }
}

// The same columns as N rows of `leading`.
template <int N>
void pack_rows(const double* __restrict by_column, int num_columns, int leading,
               double* __restrict out) {
  for (int k = 0; k < num_columns; ++k, by_column += lanes(N))
    for (int r = 0; r < N; ++r) out[static_cast<std::ptrdiff_t>(r) * leading + k] = by_column[r];
}

// Calls visit(row, velocity, |J|) for every number: for bounds, which no Newton step needs.
template <class Visit>
void for_each_size(const std::vector<Constraint>& constraints, const std::vector<Strip>& strips,
                   const std::vector<double>& by_row, const Visit& visit) {
  for (const Constraint& c : constraints) {
    for (int r = 0; r < c.rows; ++r) {
      const double* row = by_row.data() + c.by_row + static_cast<std::ptrdiff_t>(r) * c.leading;
      for (int s = c.first_strip; s < c.end_strip; ++s)
        for (int k = 0; k < strips[s].size; ++k)
          visit(c.row + r, strips[s].velocity + k, std::abs(*row++));
    }
  }
}

bool is_zero(const double* column, int rows, int width) {
  for (int r = 0; r < rows; ++r)
    if (column[static_cast<std::ptrdiff_t>(r) * width] != 0.0) return false;
  return true;
}

}  // namespace

void PackedJacobian::clear() {
  num_rows_ = 0;
  constraints_.clear();
  strips_.clear();
  by_column_.clear();
  by_row_.clear();
}

void PackedJacobian::begin_constraint(int rows) {
  Constraint c{};
  c.rows = rows;
  c.row = num_rows_;
  c.first_strip = static_cast<int>(strips_.size());
  c.by_column = static_cast<int>(by_column_.size());
  c.by_row = static_cast<int>(by_row_.size());
  constraints_.push_back(c);
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
  for (int g = 0; g < num_groups; ++g) {
    int first = groups[g].velocity - groups[0].velocity, last = first + groups[g].size;
    while (first < last && is_zero(jacobian + first, c.rows, width)) ++first;
    while (first < last && is_zero(jacobian + last - 1, c.rows, width)) --last;
    if (first == last) continue;
    if (groups[g].size == kFreeBody && c.rows >= 3 && last - first >= kMostOfSix) {
      first = groups[g].velocity - groups[0].velocity;
      last = first + kFreeBody;
    }
    strips_.push_back({groups[0].velocity + first, last - first, first_group + g});
    c.num_columns += last - first;
    const int room = lanes(c.rows);
    const size_t place = by_column_.size();
    by_column_.resize(place + static_cast<size_t>(room) * (last - first));
    with_rows(c.rows, [&]<int N>(RowCount<N>) {
      pack_columns<N>(jacobian, width, first, last, by_column_.data() + place);
    });
  }
}

void PackedJacobian::end_constraint() {
  Constraint& c = constraints_.back();
  c.end_strip = static_cast<int>(strips_.size());
  c.leading = (c.num_columns + 3) & ~3;
  by_row_.resize(by_row_.size() + static_cast<size_t>(c.rows) * c.leading, 0.0);
  const double* from = by_column_.data() + c.by_column;
  with_rows(c.rows, [&]<int N>(RowCount<N>) {
    pack_rows<N>(from, c.num_columns, c.leading, by_row_.data() + c.by_row);
  });
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
  multiply_all(constraints_.data(), constraints_.data() + constraints_.size(), strips_.data(),
               by_column_.data(), x, out);
}

double PackedJacobian::add_transposed(const double* f, const double* weight, double* out) const {
  return add_transposed_all(constraints_.data(), constraints_.data() + constraints_.size(),
                            strips_.data(), by_row_.data(), f, weight, out);
}

void PackedJacobian::add_absolute(const double* x, double* out) const {
  for_each_size(constraints_, strips_, by_row_, [&](int row, int velocity, double size) {
    out[row] += size * std::abs(x[velocity]);
  });
}

void PackedJacobian::add_absolute_transposed(const double* e, double* out) const {
  for_each_size(constraints_, strips_, by_row_,
                [&](int row, int velocity, double size) { out[velocity] += size * e[row]; });
}

}  // namespace counterpoint::contact
