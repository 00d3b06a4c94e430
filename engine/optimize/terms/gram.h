// J'J of rows that are zero in most columns: a joint's force does not depend on the joints of other
// limbs, nor a point's position.
#pragma once

#include <cstdint>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint::optimization {

/// Adds products of rows with themselves. Scratch memory inside: one object per thread.
class GramSum {
 public:
  /// Adds J'J to the lower triangle of gram (n x n); J: rows x n. Neighbouring rows that are zero
  /// in the same columns are multiplied without those. Does not allocate for sizes seen before.
  void add(const Eigen::Ref<const MatrixX>& J, MatrixX& gram);

 private:
  void find_patterns(const Eigen::Ref<const MatrixX>& J);
  bool same_pattern(Eigen::Index i, Eigen::Index j) const;
  void add_rows(const Eigen::Ref<const MatrixX>& J, MatrixX& gram);

  Eigen::Index words_ = 0;               ///< words of a pattern
  std::vector<std::uint64_t> patterns_;  ///< per row: one bit for each column that is not zero
  std::vector<int> columns_;             ///< columns of the rows in work
  std::vector<double> packed_;           ///< their entries in those columns, row after row
  std::vector<double> product_;          ///< their J'J, column after column
};

}  // namespace counterpoint::optimization
