#include "counterpoint/collision/pairs/patch_area.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/convex/feature.h"
#include "counterpoint/collision/shapes/core_shape.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

using Vector2 = Eigen::Vector2d;

/// Largest 1 - cosine between normals of one patch.
constexpr double kOnePlane = 1e-9;
/// Points within this share of their distance squared from a line have no area.
constexpr double kLine = 1e-9;
/// Least factor by which the centroid of a patch may reduce the weight of a point.
constexpr double kLeastShare = 0.1;
/// Half the diagonal of the square that stands for ground, in radii of the other shape: wherever it
/// touches the middle, the shape lies within.
constexpr double kWide = 8.0;

bool is_unbounded(const Shape& shape) {
  return shape.type == ShapeType::kPlane || shape.type == ShapeType::kTerrain;
}

/// Contact points of one normal.
struct Group {
  std::array<int, Manifold::kCapacity> index;
  std::array<Vector2, Manifold::kCapacity> place;      ///< in the plane of the contact [m]
  std::array<double, Manifold::kCapacity> now, ahead;  ///< gaps now and at the end of the step [m]
  std::array<double, Manifold::kCapacity> weight;      ///< part of the polygon's area [m^2]
  int size = 0;
};

double cross(const Vector2& a, const Vector2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Puts the convex hull of the places into `hull`, counter-clockwise; returns its size (Andrew
/// 1979, "Another efficient algorithm for convex hulls in two dimensions").
int find_hull(const Group& g, std::array<int, 2 * Manifold::kCapacity>& hull) {
  std::array<int, Manifold::kCapacity> order;
  for (int i = 0; i < g.size; ++i) order[i] = i;
  std::sort(order.begin(), order.begin() + g.size, [&](int i, int j) {
    const Vector2 &p = g.place[i], &q = g.place[j];
    return p.x() != q.x() ? p.x() < q.x() : p.y() < q.y();
  });
  int size = 0;
  const auto add = [&](int next, int least) {
    const auto turns = [&] {
      const Vector2& p = g.place[hull[size - 2]];
      return cross(g.place[hull[size - 1]] - p, g.place[next] - p) > 0.0;
    };
    while (size > least && !turns()) --size;
    hull[size++] = next;
  };
  for (int i = 0; i < g.size; ++i) add(order[i], 1);
  const int lower = size;
  for (int i = g.size - 2; i >= 0; --i) add(order[i], lower);
  return size - 1;
}

/// Weighs the points by a fan of triangles from their mean: each triangle's area goes to its
/// corners in equal parts, that of the mean to all points. This keeps the centroid. Without area
/// all points weigh the same.
void weigh(Group& g) {
  g.weight.fill(1.0);
  if (g.size < 3) return;
  std::array<int, 2 * Manifold::kCapacity> hull;
  const int corners = find_hull(g, hull);
  Vector2 mean = Vector2::Zero();
  double reach = 0.0, whole = 0.0;
  for (int i = 0; i < g.size; ++i) mean += g.place[i] / g.size;
  for (int i = 0; i < g.size; ++i) reach = std::max(reach, (g.place[i] - mean).squaredNorm());
  std::array<double, Manifold::kCapacity> part{};
  for (int k = 0; k < corners; ++k) {
    const int i = hull[k], j = hull[k + 1 == corners ? 0 : k + 1];
    const double third = cross(g.place[i] - mean, g.place[j] - mean) / 6.0;
    part[i] += third;
    part[j] += third;
    whole += third;
  }
  if (!(whole > kLine * reach)) return;
  for (int i = 0; i < g.size; ++i) g.weight[i] = part[i] + whole / g.size;
}

struct FaceSize {
  double area = 0.0;  ///< [m^2]
  Vector3 centroid = Vector3::Zero();
};

/// Measures a flat polygon; corner(i) is its i-th corner.
template <class Corner>
FaceSize measure(int count, Corner corner) {
  const Vector3 o = corner(0);
  Vector3 normal = Vector3::Zero(), moment = Vector3::Zero();
  const auto fan = [&](auto visit) {
    for (size_t i = 1; i + 1 < static_cast<size_t>(count); ++i) {
      const Vector3 p = corner(i) - o, q = corner(i + 1) - o;
      visit(p, q);
    }
  };
  fan([&](const Vector3& p, const Vector3& q) { normal += 0.5 * p.cross(q); });
  const double area = normal.norm();
  fan([&](const Vector3& p, const Vector3& q) {
    moment += 0.5 * p.cross(q).dot(normal) / area / 3.0 * (p + q);
  });
  return {area, o + moment / area};
}

/// Scales and shifts a polygon from one area and centroid to another.
void resize(const FaceSize& from, const FaceSize& to, Feature& out) {
  const double grow = std::sqrt(to.area / from.area);
  for (int i = 0; i < out.size; ++i)
    out.vertices[i] = to.centroid + grow * (out.vertices[i] - from.centroid);
}

/// Sets the feature of a shape that faces `direction`, with the true area of ends of cylinders and
/// of mesh faces, of which a feature has few corners. Ground: its tangent plane at `surface`.
void find_feature(const Shape& shape, const Pose& X, const Vector3& direction,
                  const Vector3& surface, double reach, Feature& out) {
  if (is_unbounded(shape)) {
    const Matrix3 frame = frame_from_normal(direction);
    out = Feature();
    for (int k = 0; k < 4; ++k) {
      const double angle = 0.5 * std::numbers::pi * k;
      out.add(surface +
              kWide * reach * (std::cos(angle) * frame.col(0) + std::sin(angle) * frame.col(1)));
    }
    out.normal = direction;
    return;
  }
  support_feature(shape, X, direction, 0, out);
  if (out.round) {
    const double turn = 2.0 * std::numbers::pi / Feature::kCapacity;
    const FaceSize corners = measure(out.size, [&](size_t i) { return out.vertices[i]; });
    resize(corners, {turn / std::sin(turn) * corners.area, corners.centroid}, out);
  }
  if (shape.type != ShapeType::kConvexMesh) return;
  const ConvexMesh& mesh = *shape.mesh;
  const int best = support_face(mesh, X.rotation.transpose() * direction, 0);
  const std::vector<int>& face = mesh.faces[static_cast<size_t>(best)];
  if (static_cast<int>(face.size()) <= out.size) return;
  resize(measure(out.size, [&](size_t i) { return out.vertices[i]; }),
         measure(static_cast<int>(face.size()),
                 [&](size_t i) { return X * mesh.vertices[static_cast<size_t>(face[i])]; }),
         out);
}

/// Radius of curvature across a segment or point feature [m]; 0 for polygons.
double round_radius(const Shape& shape, const Feature& feature) {
  const bool is_round = shape.type == ShapeType::kSphere || shape.type == ShapeType::kCapsule ||
                        (shape.type == ShapeType::kCylinder && feature.size == 2);
  return is_round ? shape.size[0] : 0.0;
}

/// Mean area over the touching points [m^2]: V over the weighted mean of their depths.
double mean_area(const Group& g, std::span<const double> gaps, const OverlapRegion& region) {
  if (region.whole) return region.area;
  double depth = 0.0, sum = 0.0;
  for (int k = 0; k < g.size; ++k) {
    depth += g.weight[k] * std::max(-gaps[static_cast<size_t>(k)], 0.0);
    sum += g.weight[k];
  }
  return depth > 0.0 ? region.volume * sum / depth : 0.0;
}

/// Moves the weighted mean of the points to the centroid of their patch, by factors linear in the
/// place. Leaves it where some weight would nearly vanish.
void centre(const Vector2& centroid, Group& g) {
  double sum = 0.0;
  Vector2 mean = Vector2::Zero();
  for (int k = 0; k < g.size; ++k) {
    sum += g.weight[k];
    mean += g.weight[k] * g.place[k];
  }
  mean /= sum;
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (int k = 0; k < g.size; ++k) {
    const Vector2 arm = g.place[k] - mean;
    moments += g.weight[k] * arm * arm.transpose();
  }
  const double trace = moments.trace();
  if (!(moments.determinant() > kLine * trace * trace)) return;
  const Vector2 slope = moments.inverse() * (sum * (centroid - mean));
  const auto factor = [&](int k) { return 1.0 + slope.dot(g.place[k] - mean); };
  for (int k = 0; k < g.size; ++k)
    if (!(factor(k) > kLeastShare)) return;
  for (int k = 0; k < g.size; ++k) g.weight[k] *= factor(k);
}

/// Returns the area that the touching points of one normal share [m^2], and centres their weights
/// if the whole patch overlaps.
double shared_area(const PatchPair& pair, const Vector3& origin, const ContactPoint& deepest,
                   Group& g) {
  const Vector3& n = deepest.normal;
  const Pose X_A{pair.X_WA.rotation, pair.X_WA.translation - origin},
      X_B{pair.X_WB.rotation, pair.X_WB.translation - origin};
  const double reach =
      std::max({bounding_radius(pair.a), bounding_radius(pair.b), std::abs(deepest.gap)});
  const Vector3 middle = deepest.position - origin, half = 0.5 * deepest.gap * n;
  Feature a, b;
  find_feature(pair.a, X_A, n, middle - half, reach, a);
  find_feature(pair.b, X_B, -n, middle + half, reach, b);
  const double radius_a = round_radius(pair.a, a), radius_b = round_radius(pair.b, b);
  const double radius = radius_a > 0.0 && radius_b > 0.0
                            ? radius_a * radius_b / (radius_a + radius_b)
                            : radius_a + radius_b;
  const auto is_capped = [](const Shape& s) {
    return s.type == ShapeType::kSphere || s.type == ShapeType::kCapsule;
  };
  const bool caps = is_capped(pair.a) || is_capped(pair.b);
  const GapShift shift{n.dot(pair.displacement.at(origin)), n.cross(pair.displacement.angular)};
  double most = 0.0;
  for (const bool later : {false, true}) {
    const auto& gaps = later ? g.ahead : g.now;
    const double least = *std::min_element(gaps.begin(), gaps.begin() + g.size);
    const OverlapRegion region =
        overlap_region(a, b, n, later ? shift : GapShift(), radius, caps, least);
    most = std::max(most, mean_area(g, {gaps.data(), static_cast<size_t>(g.size)}, region));
    if (!later && region.whole) centre(region.centroid, g);
  }
  return most;
}

}  // namespace

void patch_areas(const PatchPair& pair, std::span<const ContactPoint> points,
                 std::span<double> area) {
  std::fill(area.begin(), area.end(), 0.0);
  std::array<bool, Manifold::kCapacity> done{};
  for (size_t first = 0; first < points.size(); ++first) {
    if (done[first]) continue;
    const Vector3 origin = points[first].position;
    const Eigen::Matrix<double, 2, 3> plane =
        frame_from_normal(points[first].normal).leftCols<2>().transpose();
    Group g;
    int same = 0;
    size_t deepest = first;
    for (size_t i = first; i < points.size(); ++i) {
      const ContactPoint& p = points[i];
      if (done[i] || p.normal.dot(points[first].normal) < 1.0 - kOnePlane) continue;
      done[i] = true;
      ++same;
      if (p.gap < points[deepest].gap) deepest = i;
      const double ahead = p.gap + p.normal.dot(pair.displacement.at(p.position));
      if (!(std::min(p.gap, ahead) < 0.0)) continue;
      g.index[g.size] = static_cast<int>(i);
      g.place[g.size] = plane * (p.position - origin);
      g.now[g.size] = p.gap;
      g.ahead[g.size++] = ahead;
    }
    if (g.size == 0) continue;
    weigh(g);
    const double share = double(same) / double(points.size());
    const double all = share * shared_area(pair, origin, points[deepest], g);
    double sum = 0.0;
    for (int k = 0; k < g.size; ++k) sum += g.weight[k];
    for (int k = 0; k < g.size; ++k)
      area[static_cast<size_t>(g.index[k])] = all * g.weight[k] / sum;
  }
}

}  // namespace counterpoint::collision
