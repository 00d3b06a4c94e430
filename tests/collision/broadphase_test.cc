// Broad phase: sweep, grid and tree against all pairs, with any history, and for invalid boxes.
#include "counterpoint/collision/broadphase/broadphase.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "support/allocation_guard.h"
#include "support/random_poses.h"

namespace counterpoint::test::broadphase_test {
namespace {

using collision::Bounds;
using collision::Broadphase;
using Pairs = std::vector<std::pair<int, int>>;
using Method = Broadphase::Method;

Pairs all_pairs(const std::vector<Bounds>& boxes) {
  Pairs out;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t j = i + 1; j < boxes.size(); ++j) {
      if ((boxes[i].low.array() <= boxes[j].high.array()).all() &&
          (boxes[j].low.array() <= boxes[i].high.array()).all()) {
        out.emplace_back(i, j);
      }
    }
  }
  return out;
}

// Boxes of many sizes in a volume stretched by `stretch`.
std::vector<Bounds> scattered(int size, const Vector3& stretch, std::mt19937& rng) {
  std::vector<Bounds> boxes;
  for (int i = 0; i < size; ++i) {
    const Vector3 center = random_vector(rng).cwiseProduct(stretch);
    const Vector3 half = 0.2 * random_vector(rng).cwiseAbs();
    boxes.push_back({center - half, center + half});
  }
  return boxes;
}

class EveryMethod : public ::testing::TestWithParam<Method> {
 protected:
  std::mt19937 rng{3};
  Broadphase broadphase{GetParam()};
  Pairs out;

  void find(const std::vector<Bounds>& boxes) { broadphase.find_pairs(boxes, out); }
};

INSTANTIATE_TEST_SUITE_P(Broadphase, EveryMethod,
                         ::testing::Values(Method::kAutomatic, Method::kSweep, Method::kGrid,
                                           Method::kTree));

TEST_P(EveryMethod, FindsAllPairs) {
  std::size_t found = 0;
  for (const int size : {0, 1, 2, 10, 300, 700, 700, 300}) {
    for (const Vector3& stretch : {Vector3(1, 1, 1), Vector3(0.01, 0.01, 50), Vector3(3, 3, 0)}) {
      const std::vector<Bounds> boxes = scattered(size, stretch, rng);
      find(boxes);
      EXPECT_EQ(out, all_pairs(boxes)) << size;
      found += out.size();
    }
  }
  EXPECT_GT(found, 5000u);
}

TEST_P(EveryMethod, TouchingAndEqualBoxesAreFound) {
  const Bounds box{Vector3::Zero(), Vector3::Ones()};
  const Bounds beside{Vector3(1, 0, 0), Vector3(2, 1, 1)};
  find({box, box, beside, box});
  EXPECT_EQ(out, (Pairs{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}));
}

// Hard cases for a grid: boxes as large as a cell that touch exactly; distant cells; cells in a
// row, a plane or at one place; sizes of all magnitudes; coordinates up to the largest.
TEST_P(EveryMethod, FindsAllPairsHoweverTheBoxesLie) {
  std::size_t found = 0;
  for (const double size : {1e-12, 0.0, 0.125, 0.1, 1e90}) {
    for (const Vector3& pitch : {Vector3(1, 1, 1), Vector3(1, 1, 0), Vector3(0, 0, 1),
                                 Vector3(1.5, 1, 2), Vector3(0.9, 8, 1), Vector3(1, 1e7, 1)}) {
      std::vector<Bounds> boxes;
      for (int i = 0; i < 216; ++i) {
        const Vector3 low = size * pitch.cwiseProduct(Vector3(i % 6, i / 6 % 6, i / 36));
        boxes.push_back({low, low + Vector3::Constant(size)});
      }
      // One distant box, some larger ones, and one that covers all.
      boxes[17].low.x() += 1e5;
      boxes[17].high.x() += 1e5;
      boxes[40].high += Vector3::Constant(30.0 * size);
      boxes[41].low -= Vector3::Constant(100.0 * size);
      boxes[42].high.y() += 7.0 * size;
      boxes[43] = {Vector3::Constant(-1e98), Vector3::Constant(1e98)};
      find(boxes);
      EXPECT_EQ(out, all_pairs(boxes)) << size << " at " << pitch.transpose();
      found += out.size();
    }
  }
  EXPECT_GT(found, 20000u);
}

// The same for boxes of one size that lie at random across the cells.
TEST_P(EveryMethod, FindsAllPairsOfLikeBoxes) {
  std::size_t found = 0;
  for (int round = 0; round < 20; ++round) {
    const Vector3 half = 0.05 * random_vector(rng).cwiseAbs();
    const Vector3 stretch = random_vector(rng).cwiseProduct(random_vector(rng));
    std::vector<Bounds> boxes;
    for (int i = 0; i < 500; ++i) {
      const Vector3 center = Vector3::Constant(3.0) + random_vector(rng).cwiseProduct(stretch);
      boxes.push_back({center - half, center + half});
    }
    find(boxes);
    EXPECT_EQ(out, all_pairs(boxes)) << round;
    found += out.size();
  }
  EXPECT_GT(found, 5000u);
}

// Groups far from each other, so that the grid folds along one, two or three axes. Some boxes reach
// over a few cells, some over many. Every pair is found once.
TEST_P(EveryMethod, FindsAllPairsOfScatteredGroups) {
  std::size_t found = 0;
  for (const Vector3& spread : {Vector3(400, 0, 0), Vector3(90, 60, 0), Vector3(30, 20, 40)}) {
    for (const int size : {40, 200, 1500}) {
      std::vector<Bounds> boxes;
      Vector3 group = Vector3::Zero();
      for (int i = 0; i < size; ++i) {
        if (i % 10 == 0) group = random_vector(rng).cwiseProduct(spread);
        const Vector3 low = group + random_vector(rng);
        const double extent = i % 100 == 7 ? 60.0 : i % 50 == 3 ? 8.0 : 0.5;
        boxes.push_back({low, low + Vector3::Constant(extent)});
      }
      find(boxes);
      EXPECT_EQ(out, all_pairs(boxes)) << size << " over " << spread.transpose();
      found += out.size();
    }
  }
  EXPECT_GT(found, 1000u);
}

TEST_P(EveryMethod, UnsoundBoxesMeetNothing) {
  std::vector<Bounds> boxes = scattered(600, Vector3::Ones(), rng);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 600; i += 3) {
    const double values[] = {nan, inf, -inf, 1e300};
    boxes[i].low[i % 2] = values[i % 4];
    boxes[i].high[2] = values[i / 4 % 4];
  }
  find(boxes);
  for (int i = 0; i < 600; i += 3) boxes[i] = {Vector3::Ones(), -Vector3::Ones() * 9.0};
  EXPECT_EQ(out, all_pairs(boxes));
  EXPECT_GT(out.size(), 200u);
}

TEST_P(EveryMethod, NoAllocationWhileBoxesMove) {
  if (!counts_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  std::vector<Bounds> boxes = scattered(700, Vector3::Ones(), rng);
  out.reserve(700 * 700);
  find(boxes);
  for (int step = 0; step < 50; ++step) {
    // Small moves first, then moves to anywhere.
    for (Bounds& box : boxes) {
      const Vector3 move = random_vector(rng, step < 25 ? 0.01 : 1.0);
      box.low += move;
      box.high += move;
    }
    const std::size_t before = allocation_count();
    broadphase.find_pairs(boxes, out);
    EXPECT_EQ(allocation_count(), before);
  }
  find(boxes);
  EXPECT_EQ(out, all_pairs(boxes));
}

}  // namespace
}  // namespace counterpoint::test::broadphase_test
