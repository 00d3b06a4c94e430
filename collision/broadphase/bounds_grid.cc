#include "counterpoint/collision/broadphase/bounds_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace counterpoint::collision {
namespace {

// Boxes more than kLargeRatio times the geometric mean size lie in no cell; at most one box in
// kLeastPerLarge may.
constexpr double kLargeRatio = 4.0;
constexpr std::size_t kLeastPerLarge = 32;
// Mean number of boxes in a box's cell (itself included) above which the grid is not used.
constexpr std::size_t kMostInCell = 16;
// Relative amount by which cells exceed the largest box, so that round-off cannot put overlapping
// boxes two cells apart.
constexpr double kSlack = 1e-5;
constexpr double kSmallestCell = 1e-9;  // [m]
// Cells farther from the origin than this count as one: coordinates must fit an integer.
constexpr double kFarthestCell = 1 << 30;
// Binary logarithm of the least number of cells that the grid is folded onto.
constexpr int kFewestFolded = 8;
// Number of entries always tested, without a branch; as many unused entries follow the last one.
constexpr std::uint32_t kMostAlways = 4;
constexpr std::uint32_t kNoCell = ~0u;
constexpr std::uint32_t kLarge = ~0u - 1;

// Upper bounds of the keys (Entry::key) of all boxes that overlap a given one.
#if defined(__SSE2__)
class Limits {
 public:
  explicit Limits(const std::array<double, 6>& key)
      : v_{_mm_set_pd(-key[5], -key[4]), _mm_set_pd(-key[2], -key[3]),
           _mm_set_pd(-key[1], -key[0])} {}
  // Returns 1 if the box with these keys overlaps, else 0. Intrinsics, because GCC 12 splits
  // comparisons of its own vector types into scalars, which doubles the time.
  std::uint32_t hold(const std::array<double, 6>& key) const {
    const __m128d met = _mm_and_pd(_mm_and_pd(_mm_cmple_pd(_mm_load_pd(key.data()), v_[0]),
                                              _mm_cmple_pd(_mm_load_pd(key.data() + 2), v_[1])),
                                   _mm_cmple_pd(_mm_load_pd(key.data() + 4), v_[2]));
    return (static_cast<std::uint32_t>(_mm_movemask_pd(met)) + 1) >> 2;
  }

 private:
  __m128d v_[3];
};
#else
class Limits {
 public:
  explicit Limits(const std::array<double, 6>& key)
      : v_{-key[4], -key[5], -key[3], -key[2], -key[0], -key[1]} {}
  std::uint32_t hold(const std::array<double, 6>& key) const {
    bool met = true;
    for (int k = 0; k < 6; ++k) met &= key[k] <= v_[k];
    return met;
  }

 private:
  double v_[6];
};
#endif

double extent(const Bounds& box) { return (box.high - box.low).maxCoeff(); }

// Returns a point among the boxes that a few outliers cannot move.
Vector3 median_of_few(const std::vector<Bounds>& boxes) {
  constexpr std::size_t kSamples = 9;  // odd: the median is one of them
  std::array<std::array<double, kSamples>, 3> at{};
  for (std::size_t s = 0; s < kSamples; ++s) {
    const Bounds& box = boxes[(2 * s + 1) * boxes.size() / (2 * kSamples)];
    const bool sound = is_sound(box);
    for (int k = 0; k < 3; ++k) at[k][s] = sound ? box.low[k] : 0.0;
  }
  Vector3 median;
  for (int k = 0; k < 3; ++k) {
    std::nth_element(at[k].begin(), at[k].begin() + kSamples / 2, at[k].end());
    median[k] = at[k][kSamples / 2];
  }
  return median;
}

}  // namespace

void BoundsGrid::reserve(std::size_t size) {
  cell_.reserve(size);
  begin_.reserve(std::max(8 * size, std::size_t{1} << kFewestFolded) + 2);
  entries_.reserve(size + kMostAlways + 1);
  large_.reserve(size / kLeastPerLarge + 1);
}

// Chooses the cell size from the sizes and spread of the boxes; marks in cell_ the boxes that lie
// in no cell.
bool BoundsGrid::choose_cells(const std::vector<Bounds>& boxes) {
  const Vector3 middle = median_of_few(boxes);
  Vector3 spread = Vector3::Zero();
  Vector3 size = Vector3::Zero();
  std::int64_t exponents = 0;
  std::size_t num_boxes = 0;
  cell_.resize(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Bounds& box = boxes[i];
    cell_[i] = is_sound(box) ? 0 : kNoCell;
    if (cell_[i] == kNoCell) continue;
    const Vector3 extents = box.high - box.low;
    ++num_boxes;
    exponents += static_cast<std::int64_t>(
        std::bit_cast<std::uint64_t>(std::max(extents.maxCoeff(), kSmallestCell)) >> 52);
    spread += (box.low - middle).cwiseAbs();
    size = size.cwiseMax(extents);
  }
  if (num_boxes < 2) return false;
  const auto mean = static_cast<std::uint64_t>(exponents) / num_boxes;
  most_ = 2.0 * kLargeRatio * std::bit_cast<double>(mean << 52);
  if (size.maxCoeff() > most_) {
    size.setZero();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (cell_[i] == kNoCell) continue;
      if (extent(boxes[i]) > most_) {
        cell_[i] = kLarge;
      } else {
        size = size.cwiseMax(boxes[i].high - boxes[i].low);
      }
    }
  }
  set_cells(middle, spread / static_cast<double>(num_boxes), size, num_boxes);
  return true;
}

// Sets the grid. spread: mean distance from `middle` [m]; size: of the largest box in a cell [m].
void BoundsGrid::set_cells(const Vector3& middle, const Vector3& spread, const Vector3& size,
                           std::size_t num_boxes) {
  std::array<int, 3> bits;
  for (int k = 0; k < 3; ++k) {
    const double cell = std::max((1.0 + kSlack) * size[k], kSmallestCell);
    // For uniformly distributed boxes the mean distance is a quarter of the length.
    const double cells = 4.0 * spread[k] / cell;
    bits[k] = cells < 2.0 ? 0 : std::max(2, std::ilogb(cells) + 1);
    origin_[k] = middle[k];
    inverse_cell_[k] = 1.0 / cell;
  }
  axis_ = {0, 1, 2};
  std::sort(axis_.begin(), axis_.end(),
            [&](int i, int j) { return bits[i] != bits[j] ? bits[i] > bits[j] : i < j; });
  const int needed = bits[0] + bits[1] + bits[2];
  const int most = std::max(static_cast<int>(std::bit_width(num_boxes)) + 2, kFewestFolded);
  dimensions_ =
      static_cast<int>(std::count_if(bits.begin(), bits.end(), [](int n) { return n > 0; }));
  const int log_cells = needed > most ? most - 1 : needed;
  last_ = (1u << log_cells) - 1u;
  for (int k = 0, before = 0; k < 3; before += bits[axis_[k]], ++k) {
    const bool spreads = k < dimensions_;
    stride_[k] = spreads ? 1u << before : 0u;
    longest_[k] = spreads ? 1u << bits[axis_[k]] : 1u;
  }
  if (needed > most) fold(log_cells);
}

// Sets strides for which cells at the same place of the ring lie far from each other: n/g (g the
// golden ratio) in the plane, n/r and n/r^2 (r^3 = r + 1) in space, numbers that no small integers
// nearly relate. Two such cells are at least kApart n^(1/dimensions) cells apart along some axis;
// from 2^kFewestFolded cells on that is at least three, so that neighbouring cells are at different
// places.
void BoundsGrid::fold(int log_cells) {
  constexpr double kGolden = 0.61803398874989485, kPlastic = 0.75487766624669276;
  constexpr double kApart = 0.55;
  const double n = std::ldexp(1.0, log_cells);
  if (dimensions_ == 2) {
    stride_[1] = static_cast<std::uint32_t>(std::lround(n * kGolden));
  } else if (dimensions_ == 3) {
    stride_[1] = static_cast<std::uint32_t>(std::lround(n * kPlastic));
    stride_[2] = static_cast<std::uint32_t>(std::lround(n * kPlastic * kPlastic));
  }
  longest_.fill(1u);
  const double apart = dimensions_ == 1 ? n : kApart * std::pow(n, 1.0 / dimensions_);
  std::fill_n(longest_.begin(), dimensions_, static_cast<std::uint32_t>(apart));
}

// Returns the coordinate of a cell along an axis.
inline std::uint32_t BoundsGrid::coordinate(double x, int axis) const {
  const double t = (x - origin_[axis]) * inverse_cell_[axis];
  return static_cast<std::uint32_t>(std::clamp(t, -kFarthestCell, kFarthestCell) + kFarthestCell);
}

inline std::uint32_t BoundsGrid::cell_of(const Vector3& low) const {
  std::uint32_t cell = 0;
  for (int k = 0; k < 3; ++k) cell += coordinate(low[axis_[k]], axis_[k]) * stride_[k];
  return cell & last_;
}

// Completes cell_ and fills begin_ such that begin_[c + 1] is the index of cell c's first entry.
bool BoundsGrid::count_boxes(const std::vector<Bounds>& boxes) {
  const std::size_t num_cells = std::size_t{last_} + 1;
  begin_.assign(num_cells + 1, 0);
  std::size_t num_large = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (cell_[i] == kNoCell) continue;
    if (cell_[i] == kLarge) {
      ++num_large;
      continue;
    }
    cell_[i] = cell_of(boxes[i].low);
    ++begin_[cell_[i] + 1];
  }
  std::size_t shared = 0;
  std::uint32_t sum = 0;
  for (std::size_t c = 1; c <= num_cells; ++c) {
    const std::uint32_t count = begin_[c];
    shared += std::size_t{count} * count;
    begin_[c] = sum;
    sum += count;
  }
  num_entries_ = sum;
  entries_.resize(sum + kMostAlways + 1);
  return num_large * kLeastPerLarge <= boxes.size() && shared <= kMostInCell * sum;
}

bool BoundsGrid::place(const std::vector<Bounds>& boxes) {
  large_.clear();
  if (!choose_cells(boxes) || !count_boxes(boxes)) return false;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (cell_[i] == kNoCell) continue;
    const Vector3& l = boxes[i].low;
    const Vector3& h = boxes[i].high;
    Entry& e = cell_[i] == kLarge ? large_.emplace_back() : entries_[begin_[cell_[i] + 1]++];
    e = {{l.x(), l.y(), l.z(), -h.z(), -h.x(), -h.y()}, static_cast<int>(i), cell_[i]};
  }
  return true;
}

// Writes the pairs that box a makes with entries. A pair that does not overlap is written too and
// then overwritten, and the first entries are always tested: this avoids branches that cannot be
// predicted.
class BoundsGrid::Meeting {
 public:
  Meeting(const BoundsGrid& grid, const Entry& a, Pair* out)
      : entries_(grid.entries_.data()), limits_(a.key), index_(a.index), out_(out) {}

  // Tests entries begin ... end, begin <= end; reads at least kAlways entries.
  template <std::uint32_t kAlways = kMostAlways>
  void with_range(std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < begin + kAlways; ++i) {
      with(entries_[i], i < end);
    }
    with_rest(begin + kAlways, end);
  }
  // Tests cell c of the ring of cells 0 ... last, and its two neighbours.
  void with_row(const std::uint32_t* begin, std::uint32_t c, std::uint32_t last) {
    if (c > 0 && c < last) {
      with_range(begin[c - 1], begin[c + 2]);
    } else {
      with_end_of_ring(begin, c, last);
    }
  }
  void with_rest(std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < end; ++i) with(entries_[i], 1);
  }
  Pair* end() const { return out_; }

 private:
  void with_end_of_ring(const std::uint32_t* begin, std::uint32_t c, std::uint32_t last) {
    with_rest(begin[c > 0 ? c - 1 : 0], begin[(c < last ? c + 1 : last) + 1]);
    if (c == 0 && last > 1) with_rest(begin[last], begin[last + 1]);
    if (c == last && last > 1) with_rest(begin[0], begin[1]);
  }
  void with(const Entry& b, std::uint32_t counts) {
    *out_ = {index_, b.index};
    out_ += counts & limits_.hold(b.key);
  }

  const Entry* entries_;
  Limits limits_;
  int index_;
  Pair* out_;
};

// Writes the pairs of an entry with later entries of its cell and with half of the neighbouring
// cells: one in its row, and those of kRows other rows.
template <int kRows>
inline BoundsGrid::Pair* BoundsGrid::meet_neighbours(std::uint32_t position, Pair* out) const {
  const Entry& a = entries_[position];
  Meeting meeting(*this, a, out);
  const std::uint32_t* const begin = begin_.data();
  const std::uint32_t c = a.cell;
  meeting.with_range<2>(position + 1, begin[c + (c < last_ ? 2 : 1)]);
  if (c == last_ && c > 0) meeting.with_rest(begin[0], begin[1]);
  const auto with_row = [&](std::uint32_t offset) {
    meeting.with_row(begin, (c + offset) & last_, last_);
  };
  if (kRows > 0) with_row(stride_[1]);
  if (kRows > 1) {
    with_row(stride_[2] - stride_[1]);
    with_row(stride_[2]);
    with_row(stride_[2] + stride_[1]);
  }
  return meeting.end();
}

// Writes the pairs of a large box with boxes in cells.
BoundsGrid::Pair* BoundsGrid::meet_covered(const Entry& a, Pair* out) const {
  const double low[] = {a.key[0], a.key[1], a.key[2]};
  const double high[] = {-a.key[4], -a.key[5], -a.key[3]};
  std::uint32_t cell = 0;
  std::uint32_t count[3];
  Meeting meeting(*this, a, out);
  for (int k = 0; k < 3; ++k) {
    const int axis = axis_[k];
    // A box of the cell before may reach into this box.
    const std::uint32_t first = coordinate(low[axis], axis) - 1;
    count[k] = k < dimensions_ ? coordinate(high[axis], axis) - first + 1 : 1;
    cell += first * stride_[k];
    if (count[k] > longest_[k]) {
      // The loop below would visit some cell twice.
      meeting.with_rest(0, num_entries_);
      return meeting.end();
    }
  }
  for (std::uint32_t z = 0; z < count[2]; ++z) {
    for (std::uint32_t y = 0; y < count[1]; ++y) {
      const std::uint32_t first = (cell + y * stride_[1] + z * stride_[2]) & last_;
      const std::uint32_t end = first + count[0];
      meeting.with_range(begin_[first], begin_[std::min(end, last_ + 1)]);
      if (end > last_ + 1) meeting.with_rest(begin_[0], begin_[end - last_ - 1]);
    }
  }
  return meeting.end();
}

void BoundsGrid::find_pairs(std::vector<Pair>& out) {
  if (dimensions_ < 2) {
    find_pairs_in_rows<0>(out);
  } else if (dimensions_ == 2) {
    find_pairs_in_rows<1>(out);
  } else {
    find_pairs_in_rows<4>(out);
  }
}

template <int kRows>
void BoundsGrid::find_pairs_in_rows(std::vector<Pair>& out) {
  // Makes room for all pairs that the next box can have.
  const std::size_t old_size = out.size();
  std::size_t size = old_size;
  const auto room = [&](std::size_t needed) {
    if (out.size() < size + needed) {
      out.resize(std::max(size + needed, std::min(2 * size, out.capacity())));
    }
    return out.data() + size;
  };
  const std::size_t most = num_entries_ + large_.size() + 1;
  for (std::uint32_t i = 0; i < num_entries_; ++i) {
    size = static_cast<std::size_t>(meet_neighbours<kRows>(i, room(most)) - out.data());
  }
  for (std::size_t i = 0; i < large_.size(); ++i) {
    const Entry& a = large_[i];
    size = static_cast<std::size_t>(meet_covered(a, room(most)) - out.data());
    const Limits limits(a.key);
    for (std::size_t k = i + 1; k < large_.size(); ++k) {
      out[size] = {a.index, large_[k].index};
      size += limits.hold(large_[k].key);
    }
  }
  out.resize(size);
  for (std::size_t i = old_size; i < size; ++i) {
    const auto [a, b] = out[i];
    out[i] = {std::min(a, b), std::max(a, b)};
  }
}

}  // namespace counterpoint::collision
