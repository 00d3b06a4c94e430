// Pairs of boxes that overlap, by a grid of cells, for boxes of like size.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "counterpoint/collision/broadphase/broadphase.h"

namespace counterpoint::collision {

/// A box lies in the cell of its low corner, and a cell is as large as the largest box: boxes that
/// overlap are in one cell or in neighbours. The few boxes far larger than the others lie in no
/// cell and look up all those they cover. The cells lie on a ring: cell (x, y, z) at x + y s + z t
/// modulo their number, which is a grid wound up if that is large enough, else a lattice that folds
/// any space onto about as many cells as boxes (a Korobov lattice: Niederreiter, Random Number
/// Generation and Quasi-Monte Carlo Methods, 1992, ch. 5). Time grows with the boxes and the pairs.
class BoundsGrid {
 public:
  /// Memory for so many boxes.
  void reserve(std::size_t size);
  /// Puts the boxes into cells; those that are not sound into none. False if the grid is of no use:
  /// sizes too different, or too many boxes in a cell.
  bool place(const std::vector<Bounds>& boxes);
  /// Appends the index pairs (first < second) of the boxes placed last that overlap, in any order.
  void find_pairs(std::vector<std::pair<int, int>>& out);

 private:
  struct alignas(16) Entry {
    std::array<double, 6> key;  // low x, low y, low z, -high z, -high x, -high y
    int index;                  // of the box
    std::uint32_t cell;
  };
  bool choose_cells(const std::vector<Bounds>& boxes);
  void set_cells(const Vector3& middle, const Vector3& spread, const Vector3& size,
                 std::size_t num_boxes);
  void fold(int log_cells);
  std::uint32_t coordinate(double x, int axis) const;
  std::uint32_t cell_of(const Vector3& low) const;
  bool count_boxes(const std::vector<Bounds>& boxes);
  using Pair = std::pair<int, int>;
  class Meeting;
  template <int kRows>
  Pair* meet_neighbours(std::uint32_t position, Pair* out) const;
  template <int kRows>
  void find_pairs_in_rows(std::vector<Pair>& out);
  Pair* meet_covered(const Entry& a, Pair* out) const;

  // Axes in the order of the cells in memory: along the first of them neighbours lie side by side.
  std::array<int, 3> axis_{0, 1, 2};
  int dimensions_ = 0;                               // axes along which there are several cells
  std::array<std::uint32_t, 3> stride_{};            // along axis_[k], of the number of a cell
  std::array<std::uint32_t, 3> longest_{};           // cells along axis_[k] that are all different
  std::uint32_t last_ = 0;                           // cell
  std::array<double, 3> origin_{}, inverse_cell_{};  // along x, y, z
  double most_ = 0.0;                                // extent of a box in a cell [m]
  std::vector<std::uint32_t> cell_;                  // of each box
  std::vector<std::uint32_t> begin_;                 // of each cell in entries_, and the end
  std::vector<Entry> entries_;                       // by cell; some more behind
  std::uint32_t num_entries_ = 0;
  std::vector<Entry> large_;
};

}  // namespace counterpoint::collision
