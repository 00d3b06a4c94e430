// Product J'GJ of one constraint, added to the blocks of a matrix. It never allocates.
#pragma once

#include <cstddef>
#include <span>

namespace counterpoint::contact {

/// Destination of a part of J'GJ: two ranges of columns of J, and a column-major block.
struct CongruencePlace {
  std::ptrdiff_t offset;
  int leading;
  int row, num_rows;
  int column, num_columns;
  bool diagonal;  ///< both ranges are the same
};

/// Adds J'GJ: block[i, j] += (J' G J)[i, j] at every place. J: rows x columns, row-major; G: rows x
/// rows. If `upper` is given, J' G' J is added to the blocks there, except to diagonal ones, which
/// `lower` holds completely. leading: row length of J, a multiple of four, zero after the last
/// column. scratch: 2 rows leading numbers.
void add_congruence(int rows, int leading, const double* jacobian, const double* g,
                    std::span<const CongruencePlace> places, double* scratch, double* lower,
                    double* upper);

}  // namespace counterpoint::contact
