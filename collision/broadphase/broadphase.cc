#include "counterpoint/collision/broadphase/broadphase.h"

#include <algorithm>

#include "counterpoint/collision/broadphase/bounds_grid.h"
#include "counterpoint/collision/broadphase/bounds_tree.h"

namespace counterpoint::collision {
namespace {

// Numbers of boxes below which the sweep was faster in every measured scene
// (docs/decisions/README.md).
constexpr std::size_t kFewestForGrid = 32;
constexpr std::size_t kFewestForTree = 500;

}  // namespace

Broadphase::Broadphase(Method method)
    : method_(method),
      grid_(std::make_unique<BoundsGrid>()),
      tree_(std::make_unique<BoundsTree>()) {}
Broadphase::~Broadphase() = default;
Broadphase::Broadphase(Broadphase&&) noexcept = default;
Broadphase& Broadphase::operator=(Broadphase&&) noexcept = default;

void Broadphase::find_pairs(const std::vector<Bounds>& boxes,
                            std::vector<std::pair<int, int>>& out) {
  out.clear();
  found_.clear();
  if (boxes.size() < 2) return;
  // Reserve memory for every method now, so that a step does not allocate when the method changes.
  found_.reserve(out.capacity());
  boxes_.reserve(boxes.size());
  entries_.reserve(boxes.size());
  place_.reserve(boxes.size() + 1);
  grid_->reserve(boxes.size());
  if (boxes.size() >= kFewestForTree && tree_->size() != boxes.size()) {
    copy_sound(boxes);
    tree_->prepare(boxes_);
  }
  const bool try_grid =
      method_ == Method::kGrid || (method_ == Method::kAutomatic && boxes.size() >= kFewestForGrid);
  if (try_grid && grid_->place(boxes)) {
    grid_->find_pairs(found_);
  } else {
    sweep_or_tree(boxes);
  }
  move_sorted(boxes.size(), out);
}

void Broadphase::copy_sound(const std::vector<Bounds>& boxes) {
  boxes_.clear();
  for (const Bounds& box : boxes) boxes_.push_back(is_sound(box) ? box : kNowhere);
}

void Broadphase::sweep_or_tree(const std::vector<Bounds>& boxes) {
  copy_sound(boxes);
  const int axis = widest_axis();
  if (method_ == Method::kTree || (method_ == Method::kAutomatic && crowded(axis))) {
    tree_->find_pairs(boxes_, found_);
  } else {
    sweep(axis);
  }
}

// Moves the found pairs to `out` in ascending order, by counting sort of the second, then the first
// index.
void Broadphase::move_sorted(std::size_t num_boxes, std::vector<std::pair<int, int>>& out) {
  using Pairs = std::vector<std::pair<int, int>>;
  constexpr std::size_t kFewPairs = 64;  // fewer are sorted by comparison: no pass over the boxes
  if (found_.size() < std::max(kFewPairs, num_boxes / 8)) {
    std::sort(found_.begin(), found_.end());
    out.assign(found_.begin(), found_.end());
    return;
  }
  const auto sort_by = [&](int std::pair<int, int>::*index, const Pairs& from, Pairs& to) {
    place_.assign(num_boxes + 1, 0);
    for (const auto& pair : from) ++place_[static_cast<std::size_t>(pair.*index) + 1];
    for (std::size_t i = 1; i < num_boxes; ++i) place_[i] += place_[i - 1];
    for (const auto& pair : from) to[place_[static_cast<std::size_t>(pair.*index)]++] = pair;
  };
  out.resize(found_.size());
  sort_by(&std::pair<int, int>::second, found_, out);
  sort_by(&std::pair<int, int>::first, out, found_);
  out.swap(found_);
}

// Returns the axis with the largest variance of the box centres.
int Broadphase::widest_axis() const {
  Vector3 sum = Vector3::Zero();
  Vector3 sum2 = Vector3::Zero();
  for (const Bounds& box : boxes_) {
    const Vector3 center = 0.5 * (box.low + box.high);
    sum += center;
    sum2 += center.cwiseAbs2();
  }
  const Vector3 variance = sum2 - sum.cwiseAbs2() / static_cast<double>(boxes_.size());
  int axis = 0;
  variance.maxCoeff(&axis);
  return axis;
}

// Estimates from a few boxes whether the tree is faster. Its work grows with the number of boxes,
// that of the sweep with the number of boxes that overlap along the axis.
bool Broadphase::crowded(int axis) const {
  constexpr std::size_t kSamples = 16;     // each takes a pass over the boxes
  constexpr std::size_t kNeighbours = 24;  // affects only the time, not the pairs
  if (boxes_.size() < kFewestForTree) return false;
  std::size_t met = 0;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const Bounds& sample = boxes_[k * boxes_.size() / kSamples];
    for (const Bounds& box : boxes_) {
      met += box.low[axis] <= sample.high[axis] && sample.low[axis] <= box.high[axis];
    }
  }
  return met > kSamples * kNeighbours;
}

void Broadphase::sweep(int axis) {
  const int axis1 = (axis + 1) % 3;
  const int axis2 = (axis + 2) % 3;
  entries_.clear();
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    const Bounds& box = boxes_[i];
    entries_.push_back({box.low[axis], box.high[axis], box.low[axis1], box.high[axis1],
                        box.low[axis2], box.high[axis2], static_cast<int>(i)});
  }
  std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return a.low != b.low ? a.low < b.low : a.index < b.index;
  });
  for (auto a = entries_.begin(); a != entries_.end(); ++a) {
    for (auto b = a + 1; b != entries_.end() && b->low <= a->high; ++b) {
      if (a->low1 <= b->high1 && b->low1 <= a->high1 && a->low2 <= b->high2 &&
          b->low2 <= a->high2) {
        found_.emplace_back(std::min(a->index, b->index), std::max(a->index, b->index));
      }
    }
  }
}

}  // namespace counterpoint::collision
