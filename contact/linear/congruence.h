// J'GJ of one constraint, into the blocks of a matrix. It never allocates.
#pragma once

#include <cstddef>
#include <span>

namespace counterpoint::contact {

/// Where a part of J'GJ goes: two ranges of columns of J, and a column-major block.
struct CongruencePlace {
  std::ptrdiff_t offset;
  int leading;
  int row, num_rows;
  int column, num_columns;
  bool diagonal;  ///< both ranges are the same
};

/// For every place, block[i, j] += (J' G J)[i, j]. J: rows x columns, row-major, and G: rows x
/// rows. `upper`: also J' G' J into the blocks there, but the diagonal ones, where lower has it
/// all. leading: of J, in whole fours, zero after the last column. scratch: 2 rows leading.
void add_congruence(int rows, int leading, const double* jacobian, const double* g,
                    std::span<const CongruencePlace> places, double* scratch, double* lower,
                    double* upper);  // Parameters: matrices and their places

}  // namespace counterpoint::contact
