// Union-find over the integers 0 ... n - 1, for islands of velocity blocks and of trees.
#pragma once

#include <algorithm>
#include <vector>

namespace counterpoint::contact {

class DisjointSets {
 public:
  /// Starts with n sets of one element each.
  void reset(int n) {
    parent_.resize(n);
    for (int i = 0; i < n; ++i) parent_[i] = i;
  }
  /// Makes i a set of its own again. Valid only if all other elements of its set are isolated, too.
  void isolate(int i) { parent_[i] = i; }
  void join(int a, int b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }
  /// Returns the lowest element of the set of i.
  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

 private:
  std::vector<int> parent_;
};

}  // namespace counterpoint::contact
