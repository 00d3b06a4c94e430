// The states of the last minute, to which a live session can be rewound.
#pragma once

#include <cstddef>
#include <deque>

#include "counterpoint/engine/state.h"

namespace counterpoint::live {

class History {
 public:
  /// Adds a state later than all others. The oldest ones are dropped beyond kMost states or
  /// kMostBytes.
  void add(const State& state);
  /// Returns the last state at or before a time [s], or the first one, and drops those after it;
  /// null if there is none. Valid until the next call.
  const State* rewind(double time);
  void clear();

  bool empty() const { return states_.empty(); }
  double start() const { return states_.front().time; }  ///< [s]; not if empty
  double end() const { return states_.back().time; }     ///< [s]; not if empty

  static constexpr size_t kMost = 3600, kMostBytes = size_t{128} << 20;

 private:
  std::deque<State> states_;
  size_t bytes_ = 0;
};

/// Memory of a state [bytes].
size_t bytes_of(const State& state);

}  // namespace counterpoint::live
