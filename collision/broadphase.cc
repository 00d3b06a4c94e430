#include "counterpoint/collision/broadphase.h"

#include <algorithm>

namespace counterpoint::collision {

void Broadphase::find_pairs(const std::vector<Bounds>& boxes,
                            std::vector<std::pair<int, int>>& out) {
  if (boxes.size() < 2) return;
  Vector3 sum = Vector3::Zero();
  Vector3 sum2 = Vector3::Zero();
  for (const Bounds& box : boxes) {
    const Vector3 center = 0.5 * (box.low + box.high);
    sum += center;
    sum2 += center.cwiseAbs2();
  }
  const Vector3 variance = sum2 - sum.cwiseAbs2() / static_cast<double>(boxes.size());
  int axis = 0;
  variance.maxCoeff(&axis);
  const int axis1 = (axis + 1) % 3;
  const int axis2 = (axis + 2) % 3;

  entries_.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Bounds& box = boxes[i];
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
        out.emplace_back(std::min(a->index, b->index), std::max(a->index, b->index));
      }
    }
  }
}

}  // namespace counterpoint::collision
