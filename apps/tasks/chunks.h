// Which tasks are still to be handed out, and how many at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "task_list.h"

namespace counterpoint::apps::tasks {

/// Tasks first, first + stride, ..., `count` of them.
struct Chunk {
  std::int64_t first = 0, count = 0, stride = 1;
  bool empty() const { return count == 0; }
};

/// A place in the numbers of a list, that moves on as chunks are handed out: one bit a task at
/// most.
class Chunks {
 public:
  /// `done`: by number; or empty: none is.
  Chunks(std::int64_t count, const Share& share, std::vector<bool> done);

  std::int64_t left() const { return left_; }  ///< not handed out
  /// The next ones, at most `wanted`, and no more than a third of an even share of what is left
  /// among `ranks`, so that all come to their end together: guided self-scheduling
  /// (Polychronopoulos and Kuck, IEEE Trans. Computers 1987). Fewer where done ones are in between;
  /// empty: none is left.
  Chunk next(std::int64_t wanted, int ranks);

 private:
  bool is_done(std::int64_t number) const {
    return !done_.empty() && done_[static_cast<std::size_t>(number)];
  }
  std::int64_t count_, at_, stride_, left_ = 0;
  std::vector<bool> done_;
};

}  // namespace counterpoint::apps::tasks
