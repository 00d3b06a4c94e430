// Pairs of overlapping boxes, found with a uniform grid; for boxes of similar size.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "counterpoint/collision/broadphase/broadphase.h"

namespace counterpoint::collision {

/// A box lies in the cell of its low corner, and cells are as large as the largest box, so that
/// overlapping boxes are in the same cell or in neighbours. The few boxes far larger than the
/// others lie in no cell and visit all cells they cover. Cells are numbered on a ring: cell (x, y,
/// z) is x + y s + z t modulo the number of cells. If the ring is long enough this is a grid in row
/// order, else a lattice that folds all space onto about as many cells as boxes (a Korobov lattice:
/// Niederreiter, Random Number Generation and Quasi-Monte Carlo Methods, 1992, ch. 5). Time is
/// linear in the number of boxes and pairs.
class BoundsGrid {
 public:
  /// Reserves memory for this number of boxes.
  void reserve(std::size_t size);
  /// Puts the boxes into cells; boxes that are not sound go into none. False if a grid does not
  /// help: sizes differ too much, or cells hold too many boxes.
  bool place(const std::vector<Bounds>& boxes);
  /// Appends the index pairs (first < second) of overlapping boxes of the last place(), in any
  /// order.
  void find_pairs(std::vector<std::pair<int, int>>& out);

 private:
  struct alignas(16) Entry {
    std::array<double, 6> key;  // low x, low y, low z, -high z, -high x, -high y
    int index;                  // index of the box
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

  // Axes in the order of cells in memory: neighbours along the first are adjacent.
  std::array<int, 3> axis_{0, 1, 2};
  int dimensions_ = 0;                      // number of axes with several cells
  std::array<std::uint32_t, 3> stride_{};   // difference of cell numbers along axis_[k]
  std::array<std::uint32_t, 3> longest_{};  // number of distinct cells along axis_[k]
  std::uint32_t last_ = 0;                  // number of the last cell: the number of cells less one
  std::array<double, 3> origin_{}, inverse_cell_{};  // along x, y, z: [m], [1/m]
  double most_ = 0.0;                                // largest extent of a box in a cell [m]
  std::vector<std::uint32_t> cell_;                  // cell of each box
  std::vector<std::uint32_t> begin_;  // for each cell its first index in entries_, then the end
  std::vector<Entry> entries_;        // sorted by cell; some unused ones follow
  std::uint32_t num_entries_ = 0;
  std::vector<Entry> large_;
};

}  // namespace counterpoint::collision
