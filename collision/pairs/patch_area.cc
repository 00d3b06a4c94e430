#include "counterpoint/collision/pairs/patch_area.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/convex/overlap.h"
#include "counterpoint/collision/shapes/core_shape.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

using Vector2 = Eigen::Vector2d;
using Matrix2 = Eigen::Matrix2d;

/// Largest 1 - cosine between normals of one patch.
constexpr double kOnePlane = 1e-9;
/// Ratio of width and length of a region below which its width is round-off.
constexpr double kLine = 1e-7;
/// Half the diagonal of the square that stands for ground, in radii of the other shape: wherever it
/// touches the middle, the shape lies within.
constexpr double kWide = 8.0;
/// The points that carry a patch, in units of the root of its second moments per area.
constexpr std::array<std::array<double, 2>, 4> kPlaces{{{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};

bool is_unbounded(const Shape& shape) {
  return shape.type == ShapeType::kPlane || shape.type == ShapeType::kTerrain;
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

/// Sets a face of a mesh, with its true area and centroid if it has more corners than a feature.
void sized_face(const ConvexMesh& mesh, size_t index, const Pose& X, Feature& out) {
  mesh_face(mesh, static_cast<int>(index), X, out);
  const std::vector<int>& face = mesh.faces[index];
  if (static_cast<int>(face.size()) <= out.size) return;
  resize(measure(out.size, [&](size_t i) { return out.vertices[i]; }),
         measure(static_cast<int>(face.size()),
                 [&](size_t i) { return X * mesh.vertices[static_cast<size_t>(face[i])]; }),
         out);
}

/// One shape of a pair, seen along the normal.
struct Side {
  const Shape& shape;
  Pose X;
  Vector3 direction;  ///< unit, towards the other shape
  Feature feature;    ///< the one that faces the other shape
  double top;         ///< how far the shape reaches along the direction [m]
};

/// Sets feature and top; the end of a cylinder has its true area. Ground: its tangent plane at
/// `surface`.
void find_feature(const Vector3& surface, double reach, Side& out) {
  Feature& feature = out.feature;
  if (is_unbounded(out.shape)) {
    const Matrix3 frame = frame_from_normal(out.direction);
    feature = Feature();
    for (int k = 0; k < 4; ++k) {
      const double angle = 0.5 * std::numbers::pi * k;
      feature.add(surface + kWide * reach *
                                (std::cos(angle) * frame.col(0) + std::sin(angle) * frame.col(1)));
    }
    feature.normal = out.direction;
    out.top = out.direction.dot(surface);
    return;
  }
  support_feature(out.shape, out.X, out.direction, 0, feature);
  out.top = out.direction.dot(CoreShape(out.shape, out.X).support(out.direction));
  if (!feature.round) return;
  const double turn = 2.0 * std::numbers::pi / Feature::kCapacity;
  const FaceSize corners = measure(feature.size, [&](size_t i) { return feature.vertices[i]; });
  resize(corners, {turn / std::sin(turn) * corners.area, corners.centroid}, feature);
}

/// Sets `out` to all flat faces towards the other shape that rise above `least` along the direction
/// [m]; for a shape that is not bounded by flat faces, to its feature.
void find_faces(const Side& side, const Matrix3& frame, double least, std::vector<PatchFace>& out) {
  out.clear();
  const auto add = [&](const Feature& face) {
    PatchFace& added = out.emplace_back(PatchFace{face, Eigen::AlignedBox2d()});
    for (int i = 0; i < face.size; ++i)
      added.bounds.extend(Vector2(frame.leftCols<2>().transpose() * face.vertices[i]));
  };
  Feature face;
  if (side.shape.type == ShapeType::kBox) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 along = side.X.rotation.col(axis);
      box_feature(side.shape, side.X, side.direction.dot(along) < 0.0 ? Vector3(-along) : along,
                  face);
      add(face);
    }
  } else if (side.shape.type == ShapeType::kConvexMesh) {
    const ConvexMesh& mesh = *side.shape.mesh;
    const Vector3 local = side.X.rotation.transpose() * side.direction;
    const double limit = least - side.direction.dot(side.X.translation);
    const auto is_high = [&](int vertex) { return local.dot(mesh.vertices[vertex]) > limit; };
    for (size_t i = 0; i < mesh.faces.size(); ++i) {
      const std::vector<int>& corners = mesh.faces[i];
      if (!(mesh.face_normals[i].dot(local) > 0.0) ||
          std::none_of(corners.begin(), corners.end(), is_high))
        continue;
      sized_face(mesh, i, side.X, face);
      add(face);
    }
  } else {
    add(side.feature);
  }
}

/// Radius of curvature across a segment or point feature [m]; 0 for polygons.
double round_radius(const Side& side) {
  const ShapeType type = side.shape.type;
  const bool is_round = type == ShapeType::kSphere || type == ShapeType::kCapsule ||
                        (type == ShapeType::kCylinder && side.feature.size == 2);
  return is_round ? side.shape.size[0] : 0.0;
}

/// Contact points of one normal that touch now or at the end of the step.
struct Group {
  std::array<int, Manifold::kCapacity> index;
  std::array<double, Manifold::kCapacity> now, ahead;  ///< gaps at both times [m]
  int size = 0;
};

/// Two shapes that face each other along the normal of a group. Places are relative to the origin.
struct Facing {
  Side a, b;
  Vector3 normal;     ///< unit, from A to B
  GapShift shift;     ///< change of the gaps within the step
  double most = 0.0;  ///< greatest amount of that change [m]

  Facing(const PatchPair& pair, const Vector3& origin, const ContactPoint& deepest)
      : a{pair.a, {pair.X_WA.rotation, pair.X_WA.translation - origin}, deepest.normal, {}, 0.0},
        b{pair.b, {pair.X_WB.rotation, pair.X_WB.translation - origin}, -deepest.normal, {}, 0.0},
        normal(deepest.normal),
        shift{normal.dot(pair.displacement.at(origin)), normal.cross(pair.displacement.angular)} {
    const double reach =
        std::max({bounding_radius(pair.a), bounding_radius(pair.b), std::abs(deepest.gap)});
    const Vector3 middle = deepest.position - origin, half = 0.5 * deepest.gap * normal;
    find_feature(middle - half, reach, a);
    find_feature(middle + half, reach, b);
    most = std::abs(shift.offset) + 2.0 * reach * shift.slope.norm();
  }
  bool is_flat() const { return a.feature.size > 2 && b.feature.size > 2; }
};

/// Returns the larger of the regions in which the faces overlap now and at the end of the step.
OverlapRegion flat_region(const Facing& f, PatchFaces& faces) {
  const Matrix3 frame = frame_from_normal(f.normal);
  find_faces(f.a, frame, -f.b.top - f.most, faces.a);
  find_faces(f.b, frame, -f.a.top - f.most, faces.b);
  OverlapRegion now, ahead;
  for (const PatchFace& of_a : faces.a)
    for (const PatchFace& of_b : faces.b)
      if (of_a.bounds.intersects(of_b.bounds))
        add_overlap(of_a.face, of_b.face, f.normal, f.shift, now, ahead);
  return now.area < ahead.area ? ahead : now;
}

/// Returns the square root of a symmetric matrix that is not negative.
Matrix2 square_root(const Matrix2& m) {
  const double root = std::sqrt(std::max(m.determinant(), 0.0));
  const double trace = std::sqrt(m.trace() + 2.0 * root);
  return trace > 0.0 ? Matrix2((m + root * Matrix2::Identity()) / trace) : Matrix2::Zero();
}

/// Adds four points of equal areas with the area, the centroid and the second moments of a region,
/// which lie within it if it is convex (Kannan, Lovasz and Simonovits 1995, "Isoperimetric problems
/// for convex bodies and a localization lemma"), and with the integral and the first moments of its
/// depth.
void add_patch(const OverlapRegion& region, const Vector3& normal, const Vector3& origin,
               Manifold& out) {
  const Vector2 centre = region.place / region.area, mean = region.fields / region.area;
  const Matrix2 width = square_root(region.places / region.area - centre * centre.transpose());
  Matrix2 slope = Matrix2::Zero();
  const double determinant = width.determinant(), trace = width.trace();
  if (determinant > kLine * trace * trace)
    slope = width.inverse() * (region.moments / region.area - centre * mean.transpose());
  const Matrix3 frame = frame_from_normal(normal);
  for (const auto& [x, y] : kPlaces) {
    const Vector2 at(x, y), place = centre + width * at, fields = mean + slope.transpose() * at;
    out.add(origin + frame * Vector3(place.x(), place.y(), fields[1]), normal, -fields[0]);
  }
}

/// Returns the area for which each of a group's points stands so that sum area depth is the volume
/// of the overlap, the larger of those now and at the end of the step [m^2].
double even_area(const Facing& f, const Group& g) {
  const double radius_a = round_radius(f.a), radius_b = round_radius(f.b);
  const double radius = radius_a > 0.0 && radius_b > 0.0
                            ? radius_a * radius_b / (radius_a + radius_b)
                            : radius_a + radius_b;
  const auto is_capped = [](const Side& side) {
    return side.shape.type == ShapeType::kSphere || side.shape.type == ShapeType::kCapsule;
  };
  double most = 0.0;
  for (const bool later : {false, true}) {
    const auto& gaps = later ? g.ahead : g.now;
    double depth = 0.0, least = 0.0;
    for (int k = 0; k < g.size; ++k) {
      depth += std::max(-gaps[k], 0.0);
      least = std::min(least, gaps[k]);
    }
    const double volume =
        round_overlap(f.a.feature, f.b.feature, f.normal, later ? f.shift : GapShift(), radius,
                      is_capped(f.a) || is_capped(f.b), least);
    if (depth > 0.0) most = std::max(most, volume / depth);
  }
  return most;
}

/// Returns the same area for points on flat faces that stay as they are.
double even_area(const OverlapRegion& region, const Group& g) {
  double depth = 0.0;
  for (int k = 0; k < g.size; ++k) depth += std::max(-g.now[k], 0.0);
  const double volume = region.fields[0];
  return depth > 0.0 && volume > 0.0 ? volume / depth : region.area / g.size;
}

/// Moves the contacts of the normal of the first one from `from` to `group` and to `same`.
void take_group(const Motion& displacement, Manifold& from, Manifold& same, Group& group) {
  const Vector3 normal = from.points[0].normal;
  const int all = from.size;
  from.size = same.size = group.size = 0;
  for (int i = 0; i < all; ++i) {
    const ContactPoint p = from.points[i];
    if (p.normal.dot(normal) < 1.0 - kOnePlane) {
      from.points[from.size++] = p;
      continue;
    }
    const double ahead = p.gap + p.normal.dot(displacement.at(p.position));
    if (std::min(p.gap, ahead) < 0.0) {
      group.index[group.size] = same.size;
      group.now[group.size] = p.gap;
      group.ahead[group.size++] = ahead;
    }
    same.points[same.size++] = p;
  }
}

const ContactPoint& deepest(const Manifold& contacts) {
  return *std::min_element(
      contacts.points.begin(), contacts.points.begin() + contacts.size,
      [](const ContactPoint& p, const ContactPoint& q) { return p.gap < q.gap; });
}

}  // namespace

void spread_patches(const PatchPair& pair, PatchFaces& scratch, Manifold& contacts,
                    std::array<double, Manifold::kCapacity>& area) {
  area.fill(0.0);
  Manifold rest = contacts, same;
  Group group;
  const double total = contacts.size;
  const int spread = kPlaces.size();
  contacts.size = 0;
  while (rest.size > 0) {
    const Vector3 origin = rest.points[0].position;
    take_group(pair.displacement, rest, same, group);
    const int first = contacts.size;
    const double share = same.size / total;
    double each = 0.0;
    if (group.size > 0) {
      const Facing facing(pair, origin, deepest(same));
      const OverlapRegion region =
          facing.is_flat() ? flat_region(facing, scratch) : OverlapRegion();
      if (region.area > 0.0 && first + spread + rest.size <= Manifold::kCapacity) {
        add_patch(region, facing.normal, origin, contacts);
        for (int k = first; k < contacts.size; ++k) area[k] = share * region.area / spread;
        continue;
      }
      each = share * (facing.is_flat() ? even_area(region, group) : even_area(facing, group));
    }
    std::copy_n(same.points.begin(), same.size, contacts.points.begin() + first);
    contacts.size += same.size;
    for (int k = 0; k < group.size; ++k) area[first + group.index[k]] = each;
  }
}

}  // namespace counterpoint::collision
