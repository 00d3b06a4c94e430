// The work that a decomposition may take. Private to pieces.
#pragma once

#include <cstddef>

namespace counterpoint::pieces {

/// Counts operations, so that the same mesh ends at the same place on every machine; one takes
/// about a nanosecond.
struct Work {
  /// Operations of a search for the nearest triangle or of a winding number.
  static constexpr std::size_t kSearch = 4'000;

  std::size_t spent = 0;

  void spend(std::size_t operations) { spent += operations; }
};

}  // namespace counterpoint::pieces
