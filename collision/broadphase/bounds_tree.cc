#include "counterpoint/collision/broadphase/bounds_tree.h"

#include <fcl/broadphase/detail/hierarchy_tree.h>

#include <algorithm>
#include <cstdint>

namespace counterpoint::collision {
namespace {

/// A box of the tree. FCL's templates are instantiated for it, so its library, which takes longer
/// to load than a small scene takes to run, is not linked.
struct Box : Bounds {
  using S = double;

  Box operator+(const Box& other) const {
    return {{low.cwiseMin(other.low), high.cwiseMax(other.high)}};
  }
  Box& operator+=(const Box& other) { return *this = *this + other; }
  double width() const { return high[0] - low[0]; }
  double height() const { return high[1] - low[1]; }
  double depth() const { return high[2] - low[2]; }
  double size() const { return (high - low).squaredNorm(); }
  bool equal(const Box& other) const { return low == other.low && high == other.high; }
  bool contain(const Box& other) const {
    return (low.array() <= other.low.array()).all() && (high.array() >= other.high.array()).all();
  }
  Vector3 center() const { return 0.5 * (low + high); }
  /// Returns twice the distance of the centers, in the sum norm.
  double distance(const Box& other) const {
    return ((low + high) - (other.low + other.high)).lpNorm<1>();
  }
};

}  // namespace
}  // namespace counterpoint::collision

/// FCL's choice of the child that a leaf is inserted into: the nearer one, as for its own boxes.
template <>
struct fcl::detail::SelectImpl<double, counterpoint::collision::Box> {
  using Node = NodeBase<counterpoint::collision::Box>;
  static std::size_t run(const Node& leaf, const Node& first, const Node& second) {
    return leaf.bv.distance(first.bv) < leaf.bv.distance(second.bv) ? 0 : 1;
  }
};

namespace counterpoint::collision {

struct BoundsTree::Impl {
  using Tree = fcl::detail::HierarchyTree<Box>;
  using Node = Tree::NodeType;

  void build(const std::vector<Bounds>& boxes);
  void add_pairs_within(const Node& node);
  void add_pairs_between(const Node& a, const Node& b);

  Tree tree;
  std::vector<Node*> leaves;
  std::vector<std::pair<int, int>>* pairs = nullptr;
};

void BoundsTree::Impl::build(const std::vector<Bounds>& boxes) {
  tree.clear();
  leaves.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i)
    leaves.push_back(tree.insert({boxes[i]}, reinterpret_cast<void*>(std::uintptr_t{i})));
  tree.balanceTopdown();
}

void BoundsTree::Impl::add_pairs_within(const Node& node) {
  if (node.isLeaf()) return;
  add_pairs_within(*node.children[0]);
  add_pairs_within(*node.children[1]);
  add_pairs_between(*node.children[0], *node.children[1]);
}

void BoundsTree::Impl::add_pairs_between(const Node& a, const Node& b) {
  if (!meet(a.bv, b.bv)) return;
  if (a.isLeaf() && b.isLeaf()) {
    const auto i = static_cast<int>(reinterpret_cast<std::uintptr_t>(a.data));
    const auto j = static_cast<int>(reinterpret_cast<std::uintptr_t>(b.data));
    pairs->emplace_back(std::min(i, j), std::max(i, j));
    return;
  }
  // The larger box is divided.
  const bool divide_a =
      b.isLeaf() || (!a.isLeaf() && (a.bv.high - a.bv.low).sum() > (b.bv.high - b.bv.low).sum());
  for (const int child : {0, 1})
    divide_a ? add_pairs_between(*a.children[child], b) : add_pairs_between(a, *b.children[child]);
}

BoundsTree::BoundsTree() : impl_(std::make_unique<Impl>()) {}
BoundsTree::~BoundsTree() = default;
BoundsTree::BoundsTree(BoundsTree&&) noexcept = default;
BoundsTree& BoundsTree::operator=(BoundsTree&&) noexcept = default;

std::size_t BoundsTree::size() const { return impl_->leaves.size(); }

void BoundsTree::prepare(const std::vector<Bounds>& boxes) {
  if (impl_->leaves.size() != boxes.size()) impl_->build(boxes);
}

void BoundsTree::find_pairs(const std::vector<Bounds>& boxes,
                            std::vector<std::pair<int, int>>& out) {
  prepare(boxes);
  for (std::size_t i = 0; i < boxes.size(); ++i) impl_->leaves[i]->bv = {boxes[i]};
  impl_->tree.refit();
  // Rebalancing the whole tree would allocate; instead each call reinserts a share of the leaves.
  impl_->tree.balanceIncremental(static_cast<int>(boxes.size() / 16));
  impl_->pairs = &out;
  impl_->add_pairs_within(*impl_->tree.getRoot());
}

}  // namespace counterpoint::collision
