// Union-find over 0 ... n - 1, for islands of blocks and trees.
#pragma once

#include <algorithm>
#include <vector>

namespace counterpoint::contact {

class DisjointSets {
 public:
  /// n sets of one element each.
  void reset(int n) {
    parent_.resize(n);
    for (int i = 0; i < n; ++i) parent_[i] = i;
  }
  /// Takes an element out again, where all of its set are taken out.
  void isolate(int i) { parent_[i] = i; }
  void join(int a, int b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }
  /// The lowest element of i's set.
  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

 private:
  std::vector<int> parent_;
};

}  // namespace counterpoint::contact
