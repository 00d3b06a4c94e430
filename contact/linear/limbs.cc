#include "counterpoint/contact/linear/limbs.h"

#include <bit>
#include <cstddef>
#include <numeric>

namespace counterpoint::contact {
namespace {

// The velocities of a floating base stay together, whatever zeros its axes make.
constexpr int kBase = 6;

}  // namespace

void Limbs::find(const double* mass, int n) {
  if (n <= kBase) {
    sizes_.assign(n > 0 ? 1 : 0, n);
    couples_.clear();
    entries_.clear();
    parent_.resize(n);
    std::iota(parent_.begin(), parent_.end(), -1);
    return;
  }
  words_ = (n + 63) / 64;
  known_.swap(entries_);
  entries_.assign(static_cast<size_t>(n) * words_, 0);
  known_.reserve(entries_.size());  // the next call swaps the two
  for (int i = 0; i < n; ++i) {
    const double* row = mass + static_cast<std::ptrdiff_t>(i) * n;
    for (int w = 0; 64 * w < i; ++w) {
      uint64_t bits = 0;
      const int last = i - 64 * w < 64 ? i - 64 * w : 64;
      for (int j = 0; j < last; ++j) bits |= uint64_t{row[64 * w + j] != 0.0} << j;
      entries_[static_cast<size_t>(i) * words_ + w] = bits;
    }
  }
  if (entries_ == known_) return;  // the pattern of the last call
  sizes_.clear();
  couples_.clear();
  filled_ = entries_;
  find_branchings(n);
  find_couples();
}

// Finds parents and limbs. The parent of a velocity is the last earlier one in its row, fill
// included.
void Limbs::find_branchings(int n) {
  parent_.assign(n, -1);
  num_children_.assign(n, 0);
  for (int i = n - 1; i > 0; --i) {
    const uint64_t* row = filled_.data() + static_cast<size_t>(i) * words_;
    int w = words_ - 1;
    while (w >= 0 && row[w] == 0) --w;
    if (w < 0) continue;
    const int parent = 64 * w + 63 - std::countl_zero(row[w]);
    parent_[i] = parent;
    ++num_children_[parent];
    uint64_t* to = filled_.data() + static_cast<size_t>(parent) * words_;
    for (int v = 0; v <= w; ++v) to[v] |= row[v];
    to[parent / 64] &= ~(uint64_t{1} << (parent % 64));
  }
  for (int i = 0; i < n; ++i) {
    if (i == 0 || (i >= kBase && (parent_[i] != i - 1 || num_children_[i - 1] != 1))) {
      sizes_.push_back(1);
    } else {
      ++sizes_.back();
    }
  }
}

void Limbs::find_couples() {
  const int count = static_cast<int>(sizes_.size());
  start_.resize(count + 1);
  start_[0] = 0;
  for (int g = 0; g < count; ++g) start_[g + 1] = start_[g] + sizes_[g];
  // The first row of filled_, which is no longer needed, collects the entries of all rows of a
  // limb.
  for (int g = 0; g < count; ++g) {
    uint64_t* all = filled_.data();
    for (int w = 0; w < words_; ++w) all[w] = 0;
    for (int i = start_[g]; i < start_[g + 1]; ++i) {
      for (int w = 0; w < words_; ++w) all[w] |= entries_[static_cast<size_t>(i) * words_ + w];
    }
    for (int h = 0; h < g; ++h) {
      for (int j = start_[h]; j < start_[h + 1]; ++j) {
        if ((all[j / 64] >> (j % 64) & 1) == 0) continue;
        couples_.emplace_back(g, h);
        break;
      }
    }
  }
}

}  // namespace counterpoint::contact
