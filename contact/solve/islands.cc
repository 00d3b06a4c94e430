#include "counterpoint/contact/solve/islands.h"

#include <algorithm>

namespace counterpoint::contact {

void Islands::compute(const Problem& problem, bool split) {
  const int num_blocks = problem.num_blocks(), num_constraints = problem.num_constraints();
  constexpr int kFree = -1, kConstrained = -2;
  sets_.reset(num_blocks);
  for (int b = 1; b < num_blocks && !split; ++b) sets_.join(0, b);
  island_of_.assign(num_blocks, split ? kFree : kConstrained);
  for (int c = 0; c < num_constraints; ++c) {
    const int block = problem.block(c, 0), other = problem.block(c, 1);
    island_of_[block] = kConstrained;
    if (other < 0) continue;
    sets_.join(block, other);
    island_of_[other] = kConstrained;
  }
  // Numbers the islands by their lowest block, then sorts blocks and constraints into them
  // (counting sort).
  int count = 0;
  block_range_.assign(1, 0);
  for (int b = 0; b < num_blocks; ++b) {
    if (island_of_[b] == kFree) continue;
    const int r = sets_.root(b);
    island_of_[b] = r == b ? count++ : island_of_[r];
    block_range_.resize(count + 1, 0);
    ++block_range_[island_of_[b] + 1];
  }
  constraint_range_.assign(count + 1, 0);
  for (int c = 0; c < num_constraints; ++c)
    ++constraint_range_[island_of_[problem.block(c, 0)] + 1];
  for (int i = 0; i < count; ++i) {
    block_range_[i + 1] += block_range_[i];
    constraint_range_[i + 1] += constraint_range_[i];
  }
  blocks_.resize(block_range_.back());
  constraints_.resize(num_constraints);
  // Filling from the back moves the end of each range to its start.
  for (int b = num_blocks - 1; b >= 0; --b) {
    if (island_of_[b] >= 0) blocks_[--block_range_[island_of_[b] + 1]] = b;
  }
  for (int c = num_constraints - 1; c >= 0; --c) {
    constraints_[--constraint_range_[island_of_[problem.block(c, 0)] + 1]] = c;
  }
  // Entry i + 1 now holds the start of island i; shifts it back into place.
  for (int i = 0; i < count; ++i) {
    block_range_[i] = block_range_[i + 1];
    constraint_range_[i] = constraint_range_[i + 1];
  }
  block_range_[count] = static_cast<int>(blocks_.size());
  constraint_range_[count] = num_constraints;
}

}  // namespace counterpoint::contact
