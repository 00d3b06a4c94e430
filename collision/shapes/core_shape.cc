#include "counterpoint/collision/shapes/core_shape.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "counterpoint/contact/lanes/wide.h"

namespace counterpoint::collision {

namespace {

// Up to this many vertices, testing all is faster than hill climbing.
constexpr std::size_t kScanAtMost = 128;

using Four = double __attribute__((vector_size(32)));
using FourBits = std::int64_t __attribute__((vector_size(32)));

bool is_scanned(const ConvexMesh& mesh) { return mesh.vertices.size() <= kScanAtMost; }

// Returns the vertex farthest along the direction, the lowest index of equals.
[[gnu::noinline]] int scan_all(const ConvexMesh& mesh, const Vector3& direction) {
  int best = 0;
  double height = mesh.vertices[0].dot(direction);
  for (int i = 1; i < static_cast<int>(mesh.vertices.size()); ++i) {
    const double h = mesh.vertices[i].dot(direction);
    if (h > height) {
      height = h;
      best = i;
    }
  }
  return best;
}

// Mask of the bits of a height that hold an index: they change the height by 6e-14 of it.
constexpr std::int64_t kIndex = 2 * kScanAtMost - 1;

// Computes the heights of four points along the direction; their last bits are replaced by the
// index.
COUNTERPOINT_INTO_EACH void find_heights(const double* xs, const double* ys, const double* zs,
                                         const double (&direction)[3], const FourBits& height_bits,
                                         const FourBits& index, Four& out) {
  Four px, py, pz;
  std::memcpy(&px, xs, sizeof px);
  std::memcpy(&py, ys, sizeof py);
  std::memcpy(&pz, zs, sizeof pz);
  const Four height = px * direction[0] + py * direction[1] + pz * direction[2];
  out = reinterpret_cast<Four>((reinterpret_cast<FourBits>(height) & height_bits) | index);
}

// Returns the point farthest along the direction, among a multiple of eight points. The greatest
// height carries its index in its last bits, so nothing branches.
COUNTERPOINT_INTO_EACH int find_farthest(const std::array<std::vector<double>, 3>& columns,
                                         const double (&direction)[3]) {
  const int size = static_cast<int>(columns[0].size());
  const double* xs = columns[0].data();
  const double* ys = columns[1].data();
  const double* zs = columns[2].data();
  const FourBits height_bits = FourBits{} + ~kIndex;
  FourBits index = {0, 1, 2, 3};
  Four most = Four{} + std::numeric_limits<double>::lowest();
  Four more = most;
  for (const double* const end = xs + size; xs != end; xs += 8, ys += 8, zs += 8, index += 4) {
    Four first, second;
    find_heights(xs, ys, zs, direction, height_bits, index, first);
    index += 4;
    find_heights(xs + 4, ys + 4, zs + 4, direction, height_bits, index, second);
    most = first > most ? first : most;
    more = second > more ? second : more;
  }
  most = most > more ? most : more;
  // Reduce the four lanes: compare with the lane two away, then one away.
  const Four two_away = __builtin_shufflevector(most, most, 2, 3, 0, 1);
  most = most > two_away ? most : two_away;
  const Four one_away = __builtin_shufflevector(most, most, 1, 0, 3, 2);
  most = most > one_away ? most : one_away;
  return static_cast<int>(std::bit_cast<std::int64_t>(most[0]) & kIndex);
}

COUNTERPOINT_WIDE int find_farthest_face(const ConvexMesh& mesh, const Vector3& n) {
  const int last = static_cast<int>(mesh.face_normals.size()) - 1;
  return std::min(find_farthest(mesh.normal_columns, {n.x(), n.y(), n.z()}), last);
}

// True if heights along the direction can be compared.
COUNTERPOINT_INTO_EACH bool has_length(const double (&direction)[3]) {
  constexpr double kShortest = 1e-100;  // products of two neither underflow nor overflow
  constexpr double kLongest = 1e100;
  const double length = std::abs(direction[0]) + std::abs(direction[1]) + std::abs(direction[2]);
  return length > kShortest && length < kLongest;
}

COUNTERPOINT_WIDE int find_farthest_vertex(const ConvexMesh& mesh, const Vector3& d) {
  const double direction[] = {d.x(), d.y(), d.z()};
  if (!has_length(direction)) return scan_all(mesh, d);
  const int last = static_cast<int>(mesh.vertices.size()) - 1;
  return std::min(find_farthest(mesh.vertex_columns, direction), last);
}

// Returns the largest d . (x - interior point) over all vertices x, eight at a time.
COUNTERPOINT_WIDE double reach_along(const ConvexMesh& mesh, const Vector3& d) {
  const double direction[] = {d.x(), d.y(), d.z()};
  const double* xs = mesh.vertex_columns[0].data();
  const double* ys = mesh.vertex_columns[1].data();
  const double* zs = mesh.vertex_columns[2].data();
  const FourBits all = FourBits{} - 1, none = {};
  Four most = Four{} + std::numeric_limits<double>::lowest();
  Four more = most;
  for (const double* const end = xs + mesh.vertex_columns[0].size(); xs != end;
       xs += 8, ys += 8, zs += 8) {
    Four first, second;
    find_heights(xs, ys, zs, direction, all, none, first);
    find_heights(xs + 4, ys + 4, zs + 4, direction, all, none, second);
    most = first > most ? first : most;
    more = second > more ? second : more;
  }
  most = most > more ? most : more;
  return std::max(std::max(most[0], most[1]), std::max(most[2], most[3]));
}

// Returns the vertex farthest along a direction in the mesh's parent frame; sets its position
// there.
COUNTERPOINT_WIDE int place_farthest_vertex(const ConvexMesh& mesh, const Pose& X, const Vector3& d,
                                            Vector3& place) {
  const double* const R = X.rotation.data();
  double direction[3];
  for (int i = 0; i < 3; ++i) {
    direction[i] = R[3 * i] * d.x() + R[3 * i + 1] * d.y() + R[3 * i + 2] * d.z();
  }
  int best = 0;
  if (has_length(direction)) [[likely]] {
    const int last = static_cast<int>(mesh.vertices.size()) - 1;
    best = std::min(find_farthest(mesh.vertex_columns, direction), last);
  } else {
    best = scan_all(mesh, {direction[0], direction[1], direction[2]});
  }
  place = X * Vector3(mesh.vertices[best]);
  return best;
}

// Returns the face whose normal is closest to the direction. The search climbs from face to face
// around shared corners, starting with the faces around `vertex`, and remembers a few visited
// corners.
int climb_faces(const ConvexMesh& mesh, const Vector3& direction, int vertex) {
  constexpr int kRemembered = 16;  // visiting a corner again costs only time
  std::array<int, kRemembered> seen;
  int num_seen = 0;
  int best = mesh.vertex_faces[vertex][0];
  double most = mesh.face_normals[best].dot(direction);
  const auto look_around = [&](int v) {
    if (std::find(seen.begin(), seen.begin() + num_seen, v) != seen.begin() + num_seen) return;
    if (num_seen < kRemembered) seen[num_seen++] = v;
    for (const int f : mesh.vertex_faces[v]) {
      const double along = mesh.face_normals[f].dot(direction);
      best = along > most ? f : best;
      most = along > most ? along : most;
    }
  };
  look_around(vertex);
  for (int from = -1; from != best;) {
    from = best;
    for (const int v : mesh.faces[from]) look_around(v);
  }
  return best;
}

}  // namespace

int scan_vertices(const ConvexMesh& mesh, const Vector3& direction) {
  return is_scanned(mesh) ? find_farthest_vertex(mesh, direction) : scan_all(mesh, direction);
}

int likely_vertex(const ConvexMesh& mesh, const Vector3& direction) {
  constexpr std::size_t kStride = 24;  // any vertex is a valid start of the climb
  if (is_scanned(mesh)) return 0;
  std::size_t best = 0;
  double height = mesh.vertices[0].dot(direction);
  for (std::size_t i = kStride; i < mesh.vertices.size(); i += kStride) {
    const double h = mesh.vertices[i].dot(direction);
    best = h > height ? i : best;
    height = h > height ? h : height;
  }
  return static_cast<int>(best);
}

int support_vertex(const ConvexMesh& mesh, const Vector3& direction, int start) {
  if (is_scanned(mesh)) return find_farthest_vertex(mesh, direction);
  int best = start;
  double height = mesh.vertices[best].dot(direction);
  for (int from = -1; from != best;) {
    from = best;
    for (const auto& next : mesh.vertex_neighbors[from]) {  // no branches in the selection
      const double h = next.place.dot(direction);
      best = h > height ? next.vertex : best;
      height = h > height ? h : height;
    }
  }
  return best;
}

namespace {

/// Four search directions, with the best vertex and its height for each.
struct ClimbLanes {
  Four x{}, y{}, z{}, height{};
  FourBits best{};

  // Summed in the order of Eigen's dot product, so that the two agree to the bit.
  COUNTERPOINT_INTO_EACH void look_at(const Vector3& v, std::int64_t index) {
    const Four h = v.x() * x + (v.y() * y + v.z() * z);
    best = h > height ? FourBits{} + index : best;
    height = h > height ? h : height;
  }
};

/// Finds, for each direction, the highest among a vertex and its neighbors.
COUNTERPOINT_WIDE void climb_once(const ConvexMesh& mesh, std::span<const Vector3> directions,
                                  int vertex, std::span<int> best) {
  ClimbLanes lanes[kSupportsAtOnce / 4];
  for (std::size_t k = 0; k < directions.size(); ++k) {
    lanes[k / 4].x[k % 4] = directions[k].x();
    lanes[k / 4].y[k % 4] = directions[k].y();
    lanes[k / 4].z[k % 4] = directions[k].z();
  }
  for (ClimbLanes& four : lanes) {
    four.height += std::numeric_limits<double>::lowest();
    four.best += vertex;
    four.look_at(mesh.vertices[vertex], vertex);
  }
  for (const auto& next : mesh.vertex_neighbors[vertex])
    for (ClimbLanes& four : lanes) four.look_at(next.place, next.vertex);
  for (std::size_t k = 0; k < directions.size(); ++k)
    best[k] = static_cast<int>(lanes[k / 4].best[k % 4]);
}

}  // namespace

void support_vertices(const ConvexMesh& mesh, std::span<const Vector3> directions, int start,
                      std::span<int> vertices) {
  const bool climbs = !is_scanned(mesh);
  std::fill(vertices.begin(), vertices.end(), start);
  if (climbs) climb_once(mesh, directions, start, vertices);
  for (std::size_t k = 0; k < directions.size(); ++k)
    if (!climbs || vertices[k] != start)
      vertices[k] = support_vertex(mesh, directions[k], vertices[k]);
}

int support_face(const ConvexMesh& mesh, const Vector3& direction, int vertex) {
  // A polyhedron has less than twice as many faces as vertices.
  return mesh.face_normals.size() <= 2 * kScanAtMost ? find_farthest_face(mesh, direction)
                                                     : climb_faces(mesh, direction, vertex);
}

Vector3 CoreShape::support(const Vector3& direction) const {
  if (shape.type == ShapeType::kConvexMesh && is_scanned(*shape.mesh)) {
    Vector3 place;
    hint = place_farthest_vertex(*shape.mesh, X, direction, place);
    return place;
  }
  const Vector3 local = X.rotation.transpose() * direction;
  const Vector3& size = shape.size;
  switch (shape.type) {
    case ShapeType::kSphere:
      return X.translation;
    case ShapeType::kCapsule:
      return X.translation + X.rotation.col(2) * (local.z() < 0.0 ? -size[1] : size[1]);
    case ShapeType::kBox:
      return X * Vector3(local.x() < 0.0 ? -size[0] : size[0], local.y() < 0.0 ? -size[1] : size[1],
                         local.z() < 0.0 ? -size[2] : size[2]);
    case ShapeType::kCylinder: {
      const double radial = std::sqrt(local.x() * local.x() + local.y() * local.y());
      const double scale = radial > 0.0 ? size[0] / radial : 0.0;
      return X *
             Vector3(local.x() * scale, local.y() * scale, local.z() < 0.0 ? -size[1] : size[1]);
    }
    case ShapeType::kConvexMesh:
      hint = scan ? scan_vertices(*shape.mesh, local) : support_vertex(*shape.mesh, local, hint);
      return X * shape.mesh->vertices[hint];
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      break;
  }
  return X.translation;
}

bool CoreShape::climbs() const {
  return shape.type == ShapeType::kConvexMesh && !is_scanned(*shape.mesh);
}

double CoreShape::scan_support(const Vector3& direction) const {
  if (!climbs()) return direction.dot(support(direction));
  return direction.dot(center()) + reach_along(*shape.mesh, X.rotation.transpose() * direction);
}

Vector3 CoreShape::center() const {
  return shape.type == ShapeType::kConvexMesh ? X * shape.mesh->interior_point : X.translation;
}

double CoreShape::extent() const {
  switch (shape.type) {
    case ShapeType::kCapsule:
      return shape.size[1];
    case ShapeType::kBox:
      return shape.size.norm();
    case ShapeType::kCylinder:
      return shape.size[0] + shape.size[1];
    case ShapeType::kConvexMesh:
      return shape.mesh->radius;
    case ShapeType::kSphere:
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      break;
  }
  return 0.0;
}

}  // namespace counterpoint::collision
