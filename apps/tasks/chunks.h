// Distribution of the remaining tasks in chunks.
#pragma once

#include <cstdint>
#include <vector>

#include "task_list.h"

namespace counterpoint::apps::tasks {

/// Tasks first, first + stride, ...; `count` of them.
struct Chunk {
  std::int64_t first = 0, count = 0, stride = 1;
  bool empty() const { return count == 0; }
};

/// Position in the numbers of a list, which advances as chunks are handed out; uses at most one bit
/// per task.
class Chunks {
 public:
  /// `done`: by task number; empty: none is done.
  Chunks(std::int64_t count, const Share& share, std::vector<bool> done);

  std::int64_t left() const { return left_; }  ///< tasks not yet handed out
  /// Next tasks: at most `wanted`, and at most a third of an even share of the remaining tasks
  /// among `ranks`, so that all ranks finish together: guided self-scheduling (Polychronopoulos and
  /// Kuck, IEEE Trans. Computers 1987). Fewer if done tasks lie in between; empty if none is left.
  Chunk next(std::int64_t wanted, int ranks);

 private:
  bool is_done(std::int64_t number) const {
    return !done_.empty() && done_[static_cast<std::size_t>(number)];
  }
  std::int64_t count_, at_, stride_, left_ = 0;
  std::vector<bool> done_;
};

}  // namespace counterpoint::apps::tasks
