#include "counterpoint/model/pieces/quick_hull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "counterpoint/model/pieces/solid.h"

namespace counterpoint::pieces {
namespace {

constexpr int kDirections = 128;
// Number of points from which on only extreme ones count.
constexpr std::size_t kManyPoints = 200;
// Relative to the size: a point is outside of a face from this height on.
constexpr double kOutside = 1e-11;
// Relative to the size: a hull is spoilt if points stand out so far.
constexpr double kSpoilt = 1e-6;
// Ratio of area and square of the edges below which a triangle has no direction.
constexpr double kSliver = 1e-8;

/// Evenly spread directions (a Fibonacci lattice), turned by `axes`.
Eigen::Matrix<double, kDirections, 3> directions(const Matrix3& axes) {
  constexpr double kGoldenAngle = 2.399963229728653;
  Eigen::Matrix<double, kDirections, 3> out;
  for (int i = 0; i < kDirections; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kDirections, r = std::sqrt(1.0 - z * z);
    out.row(i) = axes * Vector3(r * std::cos(kGoldenAngle * i), r * std::sin(kGoldenAngle * i), z);
  }
  return out;
}

/// Returns the points that are extreme in one of the directions.
std::vector<Vector3> extreme_points(const std::vector<Vector3>& points, const Matrix3& axes) {
  const Eigen::Matrix<double, kDirections, 3> along = directions(axes);
  std::array<std::size_t, kDirections> extreme{};
  Eigen::Matrix<double, kDirections, 1> most;
  most.setConstant(-std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Matrix<double, kDirections, 1> reach = along * points[i];
    if (!((reach - most).maxCoeff() > 0.0)) continue;
    for (int k = 0; k < kDirections; ++k)
      if (reach[k] > most[k]) extreme[k] = i;
    most = most.cwiseMax(reach);
  }
  std::sort(extreme.begin(), extreme.end());
  std::vector<Vector3> kept;
  for (std::size_t k = 0; k < extreme.size(); ++k)
    if (k == 0 || extreme[k] != extreme[k - 1]) kept.push_back(points[extreme[k]]);
  return kept;
}

/// A hull that grows point by point; its faces are triangles.
class GrowingHull {
 public:
  explicit GrowingHull(const std::vector<Vector3>& points)
      : points_(points), count_(points.size()), seen_(count_ * count_, 0) {
    // Points between others come after at least one of them.
    Vector3 middle = Vector3::Zero();
    for (const Vector3& p : points) middle += p / static_cast<double>(count_);
    std::stable_sort(points_.begin(), points_.end(), [&](const Vector3& p, const Vector3& q) {
      return (p - middle).squaredNorm() > (q - middle).squaredNorm();
    });
  }

  /// Returns the hull; its volume is less than zero if rounding spoilt it.
  QuickHull hull() {
    QuickHull out;
    if (!start()) return out;
    for (std::size_t i = 0; i < count_; ++i) {
      add(static_cast<int>(i));
      // A closed surface of triangles without handles has no more.
      if (faces_.size() > 2 * count_) return {-1.0, {}};
    }
    for (const Face& f : faces_)
      for (const Vector3& p : points_)
        if (f.normal.dot(p) - f.offset > kSpoilt / kOutside * outside_) return {-1.0, {}};
    for (const Face& f : faces_) {
      out.volume += (points_[f.b] - points_[f.a])
                        .cross(points_[f.c] - points_[f.a])
                        .dot(points_[f.a] - points_[0]) /
                    6.0;
      out.faces.push_back({f.normal, f.offset});
    }
    return out;
  }

 private:
  struct Face {
    int a, b, c;
    Vector3 normal;
    double offset;
  };

  /// Starts with a tetrahedron of far points; false if there is none.
  bool start() {
    const auto farthest = [&](const auto& measure) {
      int best = 0;
      double most = -1.0;
      for (std::size_t i = 0; i < count_; ++i) {
        const double value = measure(points_[i]);
        if (value > most * (1.0 + 1e-9)) {
          most = value;
          best = static_cast<int>(i);
        }
      }
      return std::pair(best, most);
    };
    const Vector3& p = points_[0];
    const auto [b, size] = farthest([&](const Vector3& q) { return (q - p).norm(); });
    outside_ = kOutside * size;
    if (!(size > 0.0)) return false;
    const Vector3 along = (points_[b] - p) / size;
    const auto [c, width] = farthest([&](const Vector3& q) { return along.cross(q - p).norm(); });
    if (!(width > outside_)) return false;
    const Vector3 normal = along.cross(points_[c] - p).normalized();
    const auto [d, height] =
        farthest([&](const Vector3& q) { return std::abs(normal.dot(q - p)); });
    if (!(height > outside_)) return false;
    const bool above = normal.dot(points_[d] - p) > 0.0;
    const int second = above ? c : b, third = above ? b : c;
    put(0, second, third);
    put(0, d, second);
    put(second, d, third);
    put(third, d, 0);
    return true;
  }

  void put(int a, int b, int c) {
    const Vector3 ab = points_[b] - points_[a], ac = points_[c] - points_[a];
    Vector3 normal = ab.cross(ac);
    const double area = normal.norm(), edges = ab.squaredNorm() + ac.squaredNorm();
    // A sliver has no direction, and no point is outside of it.
    normal = area > kSliver * edges ? Vector3(normal / area) : Vector3(Vector3::Zero());
    faces_.push_back({a, b, c, normal, normal.dot(points_[a])});
  }

  /// Replaces the faces that see a point by those between it and their rim.
  void add(int i) {
    const Vector3& p = points_[i];
    std::size_t kept = 0;
    gone_.clear();
    for (const Face& f : faces_) {
      if (f.normal.dot(p) - f.offset > outside_) {
        gone_.push_back(f);
      } else {
        faces_[kept++] = f;
      }
    }
    if (gone_.empty()) return;
    faces_.resize(kept, faces_.front());
    ++round_;
    for (const Face& f : gone_)
      for (const auto& [a, b] : {std::pair(f.a, f.b), {f.b, f.c}, {f.c, f.a}})
        seen_[a * count_ + b] = round_;
    for (const Face& f : gone_)
      for (const auto& [a, b] : {std::pair(f.a, f.b), {f.b, f.c}, {f.c, f.a}})
        if (seen_[b * count_ + a] != round_) put(a, b, i);
  }

  std::vector<Vector3> points_;
  std::size_t count_;
  double outside_ = 0.0;
  std::vector<Face> faces_, gone_;
  std::vector<std::uint16_t> seen_;  // round in which a face with this edge was replaced
  std::uint16_t round_ = 0;
};

}  // namespace

bool QuickHull::contains(const Vector3& p, double slack) const {
  return !faces.empty() && std::all_of(faces.begin(), faces.end(), [&](const CutPlane& face) {
    return face.height(p) <= slack;
  });
}

QuickHull quick_hull(const std::vector<Vector3>& points, const Matrix3& axes, Work& work) {
  if (points.size() < 4) return {};
  if (points.size() > kManyPoints) {
    work.spend(kDirections * points.size());
    return quick_hull(extreme_points(points, axes), axes, work);
  }
  work.spend(6 * points.size() * points.size());
  QuickHull out = GrowingHull(points).hull();
  if (out.volume >= 0.0) return out;
  work.spend(2'000 * points.size());
  const auto hull = hull_of(points, "");
  if (!hull) return {};
  out.volume = hull->volume;
  for (std::size_t f = 0; f < hull->faces.size(); ++f)
    out.faces.push_back({hull->face_normals[f], hull->face_offsets[f]});
  return out;
}

}  // namespace counterpoint::pieces
