// HTML page of a sweep: recorded values over varied quantities.
#pragma once

#include "table.h"

namespace counterpoint::apps::sweep {

/// Collects points of plots as rows arrive; of many rows an even sample.
class Page {
 public:
  explicit Page(const Study& study);
  void add(std::int64_t task, const Row& row);
  std::string text(const Summary& summary, const std::string& table) const;

 private:
  /// Plot of a recorded value over an axis.
  struct Plot {
    std::size_t axis, recorded;
    std::vector<double> x, y;
    std::vector<std::string> remarks;
    std::vector<double> sums, counts;  ///< sums and counts over all rows, by level of the axis
  };

  const Study& study_;
  std::int64_t every_;
  std::vector<Plot> plots_;
};

}  // namespace counterpoint::apps::sweep
