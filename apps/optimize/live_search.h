// The page of `optimize --live`: the motion after each Newton step, and its figures.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "live/search_view.h"
#include "optimize/run.h"

namespace counterpoint::apps {

class LiveSearch {
 public:
  /// Prints the address of the page, waits for a reader, and shows the guess. @throws InputError as
  /// live::SearchView.
  LiveSearch(const optimization::ProblemFile& file, const std::vector<VectorX>& guess);

  /// Makes a search show its motions, and end where a page asks for that. This must outlive it.
  void watch(optimization::Settings& settings);
  /// Shows the motion found, and how the search ended.
  void end(const OptimizedStart& start);

 private:
  std::unique_ptr<live::SearchView> view_;
};

}  // namespace counterpoint::apps
