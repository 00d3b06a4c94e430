// The page of a sweep: what was recorded over what was varied.
#pragma once

#include "table.h"

namespace counterpoint::apps::sweep {

/// Collects points of plots as the rows come; of many rows an even sample.
class Page {
 public:
  explicit Page(const Study& study);
  void add(std::int64_t task, const Row& row);
  std::string text(const Summary& summary, const std::string& table) const;

 private:
  /// A recorded number over an axis.
  struct Plot {
    std::size_t axis, recorded;
    std::vector<double> x, y;
    std::vector<std::string> remarks;
    std::vector<double> sums, counts;  ///< by level of the axis, over all rows
  };

  const Study& study_;
  std::int64_t every_;
  std::vector<Plot> plots_;
};

}  // namespace counterpoint::apps::sweep
