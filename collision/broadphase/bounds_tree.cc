#include "counterpoint/collision/broadphase/bounds_tree.h"

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/sphere.h>

#include <algorithm>
#include <limits>

namespace counterpoint::collision {
namespace {

// A box in the tree. The tree reads only an object's bounds, which FCL derives from a shape and a
// pose; ours are tighter and include the margin, so they are set directly.
class Leaf : public fcl::CollisionObject<double> {
 public:
  Leaf(const std::shared_ptr<fcl::CollisionGeometry<double>>& shape, int index)
      : fcl::CollisionObject<double>(shape), index_(index) {}
  void set_bounds(const Bounds& bounds) {
    aabb.min_ = bounds.low;
    aabb.max_ = bounds.high;
  }
  int index() const { return index_; }

 private:
  int index_;
};

bool add_pair(fcl::CollisionObject<double>* a, fcl::CollisionObject<double>* b, void* out) {
  const int i = static_cast<const Leaf*>(a)->index();
  const int j = static_cast<const Leaf*>(b)->index();
  static_cast<std::vector<std::pair<int, int>>*>(out)->emplace_back(std::min(i, j), std::max(i, j));
  return false;  // false: continue the search
}

}  // namespace

struct BoundsTree::Impl {
  void build(const std::vector<Bounds>& boxes);

  std::vector<std::unique_ptr<Leaf>> leaves;
  fcl::DynamicAABBTreeCollisionManager<double> manager;
};

void BoundsTree::Impl::build(const std::vector<Bounds>& boxes) {
  manager.clear();
  leaves.clear();
  const auto any_shape = std::make_shared<fcl::Sphere<double>>(1.0);
  std::vector<fcl::CollisionObject<double>*> objects;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    leaves.push_back(std::make_unique<Leaf>(any_shape, static_cast<int>(i)));
    leaves[i]->set_bounds(boxes[i]);
    objects.push_back(leaves[i].get());
  }
  // Rebalancing would allocate; instead each call reinserts a share of the leaves.
  manager.max_tree_nonbalanced_level = std::numeric_limits<int>::max();
  manager.tree_incremental_balance_pass = static_cast<int>(boxes.size() / 16);
  manager.registerObjects(objects);
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
  for (std::size_t i = 0; i < boxes.size(); ++i) impl_->leaves[i]->set_bounds(boxes[i]);
  impl_->manager.update();
  impl_->manager.collide(&out, add_pair);
}

}  // namespace counterpoint::collision
