#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/collision/convex/feature_pairs.h"
#include "counterpoint/collision/convex/minkowski.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::collision {
namespace {

constexpr int kMaxVertices = 200;  // with more, the best depth found so far is used
constexpr int kMaxFaces = 600;     // limit of edges too; 200 vertices make 396 faces
// Relative to the size of the shapes. kDepthError: error of the depth at which the expansion stops;
// the depth is refined later, but of two ways out that differ by less, the longer may be taken.
// kVisible: distance above a face from which a point sees it.
constexpr double kDepthError = 1e-6;
constexpr double kVisible = 1e-14;
// Relative to the size: a face this close to the surface of the difference is part of it.
constexpr double kExact = 1e-13;
// Relative to a face's size: how far outside the face the foot of the origin may lie.
constexpr double kWeightError = 1e-9;
// Relative to the size. kCurvedError: a face this close to a curved surface may tell which pieces
// touch there. kClosedError: the face is closed if the depth found there exceeds the face's by no
// more than this: at 1e-3 one in a thousand deep overlaps of thin discs took a way out longer by up
// to 4e-4 of the size, at 1e-4 one of 48,000, by 3e-6.
constexpr double kCurvedError = 0.02;
constexpr double kClosedError = 1e-4;

struct Face {
  std::array<int, 3> vertex;  // counter-clockwise from outside
  Vector3 normal;             // unit, outward; zero if the face has no area
  double offset;              // normal . x on the face; infinite if it has no area
  bool closed;                // true: not to be expanded any more
};

struct Edge {
  int from, to;
};

// A convex polytope that grows by one vertex at a time; it needs no heap memory.
class Polytope {
 public:
  explicit Polytope(const MinkowskiDifference& difference) : difference_(difference) {}

  // Builds a tetrahedron from the simplex. False if the difference has no volume.
  bool start(const Simplex& simplex);
  // Returns the face nearest the origin that is not closed; -1 if there is none.
  int nearest_face() const;
  // Adds a vertex and replaces the faces that it sees. False if memory is full.
  bool expand(const DifferencePoint& p);
  const Face& face(int i) const { return faces_[i]; }
  // Sets the points of A and B that touch along the normal of a face of the difference; false if
  // the foot of the origin lies outside the face.
  bool witness(int face, Witness& out) const;
  // Calls settle_on_feature_pair with the corners of a face; the depth must not exceed `depth`.
  bool settle(int face, double depth, Witness& out) const;
  void close(int face) { faces_[face].closed = true; }
  // A direction in which the difference is thin, as found by start().
  const Vector3& flat_direction() const { return flat_direction_; }

 private:
  void add_vertex(const DifferencePoint& p) { vertices_[num_vertices_++] = p; }
  bool add_farthest(const Vector3& direction, bool (*far)(const Polytope&, const Vector3&));
  void add_face(int i, int j, int k);
  void toggle(int from, int to);

  const MinkowskiDifference& difference_;
  std::array<DifferencePoint, kMaxVertices> vertices_;
  std::array<Face, kMaxFaces> faces_;
  std::array<Edge, kMaxFaces> horizon_;
  int num_vertices_ = 0, num_faces_ = 0, num_edges_ = 0;
  Vector3 flat_direction_ = Vector3::UnitZ();
};

void Polytope::add_face(int i, int j, int k) {
  Face& f = faces_[num_faces_++];
  f.vertex = {i, j, k};
  f.closed = false;
  const Vector3& p = vertices_[i].w;
  const Vector3 e1 = vertices_[j].w - p;
  const Vector3 e2 = vertices_[k].w - p;
  f.normal = e1.cross(e2);
  const double area2 = f.normal.squaredNorm();
  if (area2 > 1e-26 * e1.squaredNorm() * e2.squaredNorm()) {
    f.normal /= std::sqrt(area2);
    f.offset = f.normal.dot(p);
  } else {
    f.normal.setZero();
    f.offset = std::numeric_limits<double>::infinity();
  }
}

// Adds the first of the support points along direction and -direction that `far` accepts; false if
// none.
bool Polytope::add_farthest(const Vector3& direction,
                            bool (*far)(const Polytope&, const Vector3&)) {
  for (const double sign : {1.0, -1.0}) {
    const DifferencePoint p = difference_.support(sign * direction);
    if (far(*this, p.w)) {
      add_vertex(p);
      return true;
    }
  }
  return false;
}

bool Polytope::start(const Simplex& simplex) {
  for (int i = 0; i < simplex.size; ++i) add_vertex(simplex.points[i]);
  if (num_vertices_ == 1) {
    const auto far = [](const Polytope& t, const Vector3& p) {
      return (p - t.vertices_[0].w).norm() > 1e-10 * t.difference_.scale;
    };
    for (int i = 0; i < 3 && num_vertices_ == 1; ++i) add_farthest(Vector3::Unit(i), far);
    if (num_vertices_ == 1) return false;
  }
  if (num_vertices_ == 2) {
    const Vector3 line = (vertices_[1].w - vertices_[0].w).normalized();
    const Matrix3 frame = frame_from_normal(line);
    flat_direction_ = frame.col(0);
    const auto far = [](const Polytope& t, const Vector3& p) {
      const Vector3 edge = (t.vertices_[1].w - t.vertices_[0].w).normalized();
      return edge.cross(p - t.vertices_[0].w).norm() > 1e-10 * t.difference_.scale;
    };
    for (int i = 0; i < 2 && num_vertices_ == 2; ++i) add_farthest(frame.col(i), far);
    if (num_vertices_ == 2) return false;
  }
  if (num_vertices_ == 3) {
    const Vector3 normal = (vertices_[1].w - vertices_[0].w).cross(vertices_[2].w - vertices_[0].w);
    if (normal.norm() == 0.0) return false;
    flat_direction_ = normal.normalized();
    const auto far = [](const Polytope& t, const Vector3& p) {
      return std::abs(t.flat_direction_.dot(p - t.vertices_[0].w)) > 1e-13 * t.difference_.scale;
    };
    if (!add_farthest(flat_direction_, far)) return false;
  }
  const Vector3& p = vertices_[0].w;
  const double volume = (vertices_[1].w - p).cross(vertices_[2].w - p).dot(vertices_[3].w - p);
  if (volume > 0.0) std::swap(vertices_[1], vertices_[2]);
  add_face(0, 1, 2);
  add_face(0, 3, 1);
  add_face(0, 2, 3);
  add_face(1, 3, 2);
  return true;
}

bool Polytope::witness(int face, Witness& out) const {
  const Face& f = faces_[face];
  const DifferencePoint& p = vertices_[f.vertex[0]];
  const DifferencePoint& q = vertices_[f.vertex[1]];
  const DifferencePoint& r = vertices_[f.vertex[2]];
  const Vector3 foot = f.offset * f.normal - p.w;
  const Vector3 e1 = q.w - p.w;
  const Vector3 e2 = r.w - p.w;
  const double area = e1.cross(e2).dot(f.normal);
  const double wq = foot.cross(e2).dot(f.normal) / area;
  const double wr = e1.cross(foot).dot(f.normal) / area;
  const double wp = 1.0 - wq - wr;
  if (!(std::min({wp, wq, wr}) >= -kWeightError)) return false;
  out.point_a = wp * p.a + wq * q.a + wr * r.a;
  out.point_b = wp * p.b + wq * q.b + wr * r.b;
  return true;
}

bool Polytope::settle(int face, double depth, Witness& out) const {
  const Face& f = faces_[face];
  const DifferencePoint corners[] = {vertices_[f.vertex[0]], vertices_[f.vertex[1]],
                                     vertices_[f.vertex[2]]};
  return settle_on_feature_pair(difference_, corners, 3, -f.normal, -depth, out);
}

int Polytope::nearest_face() const {
  int best = -1;
  for (int i = 0; i < num_faces_; ++i) {
    if (!faces_[i].closed && (best < 0 || faces_[i].offset < faces_[best].offset)) best = i;
  }
  return best;
}

void Polytope::toggle(int from, int to) {
  for (int i = 0; i < num_edges_; ++i) {
    if (horizon_[i].from == to && horizon_[i].to == from) {
      horizon_[i] = horizon_[--num_edges_];
      return;
    }
  }
  horizon_[num_edges_++] = {from, to};
}

bool Polytope::expand(const DifferencePoint& p) {
  if (num_vertices_ == kMaxVertices) return false;
  num_edges_ = 0;
  int kept = 0;
  for (int i = 0; i < num_faces_; ++i) {
    const Face& f = faces_[i];
    if (f.normal.dot(p.w) - f.offset <= kVisible * difference_.scale) {
      if (kept != i) faces_[kept] = f;
      ++kept;
      continue;
    }
    if (num_edges_ + 3 > kMaxFaces) return false;
    for (int k = 0; k < 3; ++k) toggle(f.vertex[k], f.vertex[k == 2 ? 0 : k + 1]);
  }
  num_faces_ = kept;
  if (num_faces_ + num_edges_ > kMaxFaces) return false;
  const int apex = num_vertices_;
  add_vertex(p);
  for (int i = 0; i < num_edges_; ++i) add_face(horizon_[i].from, horizon_[i].to, apex);
  return num_faces_ > 0;
}

}  // namespace

bool expand_polytope(const MinkowskiDifference& difference, const Simplex& start, Witness& out) {
  const double scale = difference.scale;
  const bool curved = difference.curved();
  Polytope polytope(difference);
  const bool solid = polytope.start(start);
  // The offset of the nearest face bounds the depth from below, the support plane along its normal
  // from above. `out` keeps the best upper bound: however the loop ends, its normal is valid.
  out.normal = -polytope.flat_direction();
  out.distance = difference.distance_along(out.normal);
  bool certain = false;
  while (solid) {
    const int index = polytope.nearest_face();
    if (index < 0) break;
    const Face& nearest = polytope.face(index);
    if (nearest.offset >= -out.distance - (certain ? kDepthError : kExact) * scale) break;
    const DifferencePoint p = difference.support(nearest.normal);
    const double bound = nearest.normal.dot(p.w);
    if (bound < -out.distance - kExact * scale) {
      out.normal = -nearest.normal;
      out.distance = -bound;
      certain = bound - nearest.offset <= kExact * scale && polytope.witness(index, out);
    }
    Witness settled;
    if (curved && bound - nearest.offset < kCurvedError * scale &&
        polytope.settle(index, bound + kExact * scale, settled)) {
      if (settled.distance > out.distance - kExact * scale) {
        out = settled;
        certain = true;
      }
      // No way out through this face is shorter.
      if (-settled.distance - nearest.offset < kClosedError * scale) {
        polytope.close(index);
        continue;
      }
    }
    if (!polytope.expand(p)) break;
  }
  return certain;
}

}  // namespace counterpoint::collision
