// Parts of the trees of a model, on which threads work side by side.
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "counterpoint/contact/thread_pool.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

/// Calls visit(part) for ranges of whole trees that together are `ranges`, which are such ranges
/// themselves, on the threads of the pool in any order; one after the other where it is null.
/// visit must write only what belongs to the bodies of its part.
template <class Visit>
void for_each_part(const Model& model, std::span<const BodyRange> ranges, contact::ThreadPool* pool,
                   const Visit& visit) {
  if (pool == nullptr || pool->size() == 1) {
    for (const BodyRange& range : ranges) visit(range);
    return;
  }
  constexpr int kPartsAtOnce = 64, kPartsOfAThread = 4;
  int bodies = 0;
  for (const BodyRange& range : ranges) bodies += range.end - range.begin;
  const int least = std::max(1, bodies / std::min(kPartsAtOnce, kPartsOfAThread * pool->size()));
  std::array<BodyRange, kPartsAtOnce> parts;
  int count = 0;
  const auto run = [&] {
    pool->run(count, [&](int i, int) { visit(parts[static_cast<size_t>(i)]); });
    count = 0;
  };
  for (const BodyRange& range : ranges) {
    for (int begin = range.begin; begin < range.end;) {
      int end = begin;
      while (end < range.end && end - begin < least)
        end = model.trees()[static_cast<size_t>(model.body(end).tree)].body_end;
      parts[static_cast<size_t>(count++)] = {begin, end};
      if (count == kPartsAtOnce) run();
      begin = end;
    }
  }
  run();
}

}  // namespace counterpoint
