#include "chunks.h"

#include <algorithm>

namespace counterpoint::apps::tasks {

Chunks::Chunks(std::int64_t count, const Share& share, std::vector<bool> done)
    : count_(count), at_(share.index), stride_(share.of), done_(std::move(done)) {
  if (count > share.index) left_ = (count - share.index + stride_ - 1) / stride_;
  if (done_.empty()) return;
  for (std::int64_t i = at_; i < count; i += stride_) left_ -= is_done(i) ? 1 : 0;
}

Chunk Chunks::next(std::int64_t wanted, int ranks) {
  while (at_ < count_ && is_done(at_)) at_ += stride_;
  Chunk chunk{at_, 0, stride_};
  const std::int64_t most = std::max<std::int64_t>(1, std::min(wanted, left_ / (3 * ranks)));
  for (; chunk.count < most && at_ < count_ && !is_done(at_); at_ += stride_) ++chunk.count;
  left_ -= chunk.count;
  return chunk;
}

}  // namespace counterpoint::apps::tasks
