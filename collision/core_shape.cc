#include "counterpoint/collision/core_shape.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "counterpoint/collision/wide.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace counterpoint::collision {

namespace {

// With no more vertices than this looking at all is faster than climbing.
constexpr int kScanAtMost = 128;

// As many as coarse_vertices is a multiple of.
constexpr int kTogether = 8;
using Floats = float __attribute__((vector_size(4 * kTogether)));
using Ints = std::int32_t __attribute__((vector_size(4 * kTogether)));

// The vertex farthest along the direction, of equals the lowest.
int scan_all(const ConvexMesh& mesh, const Vector3& direction) {
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

// Of the listed vertices the one farthest along the direction, of equals the first.
int highest_of(const ConvexMesh& mesh, const Vector3& direction, const int* list, int size) {
  // Heights are over the mean of all vertices, so that one at least is not below and in the list.
  // cppcheck-suppress uninitvar
  int best = list[0];
  double height = mesh.vertices[best].dot(direction);
  for (int k = 1; k < size; ++k) {
    const double h = mesh.vertices[list[k]].dot(direction);
    best = h > height ? list[k] : best;
    height = h > height ? h : height;
  }
  return best;
}

// Single-precision heights of a mesh along a direction. The last bits of each hold the vertex, so
// that the highest brings its own along.
struct Heights {
  static constexpr std::int32_t kVertex = kScanAtMost - 1;
  static_assert(kScanAtMost == 128);
  Floats all[kScanAtMost / kTogether];
  float highest, next;
};

// Of two highest and two others, lane by lane, the two highest. By reference: vectors this wide
// have no place in the calling convention of narrow machines.
inline void keep_highest(const Floats& other_first, const Floats& other_second, Floats& first,
                         Floats& second) {
  const Floats lower = first < other_first ? first : other_first;
  second = second > other_second ? second : other_second;
  second = second > lower ? second : lower;
  first = first > other_first ? first : other_first;
}

COUNTERPOINT_WIDE void find_heights(const ConvexMesh& mesh, float x, float y, float z,
                                    Heights& out) {
  const float* const xs = mesh.coarse_vertices[0].data();
  const float* const ys = mesh.coarse_vertices[1].data();
  const float* const zs = mesh.coarse_vertices[2].data();
  const int size = static_cast<int>(mesh.vertices.size());
  const Floats lowest = Floats{} + std::numeric_limits<float>::lowest();
  Floats first = lowest, second = lowest;
  Ints vertices = {0, 1, 2, 3, 4, 5, 6, 7};
  for (int i = 0; i < size; i += kTogether, vertices += kTogether) {
    Floats px, py, pz;
    std::memcpy(&px, xs + i, sizeof px);
    std::memcpy(&py, ys + i, sizeof py);
    std::memcpy(&pz, zs + i, sizeof pz);
    const Floats height = px * x + py * y + pz * z;
    const auto tagged =
        reinterpret_cast<Floats>((reinterpret_cast<Ints>(height) & ~Heights::kVertex) | vertices);
    out.all[i / kTogether] = tagged;
    keep_highest(tagged, lowest, first, second);
  }
  // Lanes against those four, two and one away; the masks have to be constants.
  keep_highest(__builtin_shufflevector(first, first, 4, 5, 6, 7, 0, 1, 2, 3),
               __builtin_shufflevector(second, second, 4, 5, 6, 7, 0, 1, 2, 3), first, second);
  keep_highest(__builtin_shufflevector(first, first, 2, 3, 0, 1, 6, 7, 4, 5),
               __builtin_shufflevector(second, second, 2, 3, 0, 1, 6, 7, 4, 5), first, second);
  keep_highest(__builtin_shufflevector(first, first, 1, 0, 3, 2, 5, 4, 7, 6),
               __builtin_shufflevector(second, second, 1, 0, 3, 2, 5, 4, 7, 6), first, second);
  out.highest = first[0];
  out.next = second[0];
}

// One bit a lane that is `least` or more.
unsigned lanes_from(const Floats& heights, float least) {
#if defined(__SSE2__)
  __m128 low, high;
  std::memcpy(&low, &heights, sizeof low);
  std::memcpy(&high, reinterpret_cast<const char*>(&heights) + sizeof low, sizeof high);
  const __m128 limit = _mm_set1_ps(least);
  return static_cast<unsigned>(_mm_movemask_ps(_mm_cmpge_ps(low, limit)) |
                               _mm_movemask_ps(_mm_cmpge_ps(high, limit)) << 4);
#else
  unsigned lanes = 0;
  for (int i = 0; i < kTogether; ++i) lanes |= static_cast<unsigned>(heights[i] >= least) << i;
  return lanes;
#endif
}

// The same as scan_all for at most kScanAtMost vertices: in single precision, and in double among
// those that come close.
int scan_few(const ConvexMesh& mesh, const Vector3& direction) {
  // Vertices are at most 1 long. Relative to the direction's length the six roundings of a product
  // lose 4e-7, the bits that hold the vertex 1.6e-5.
  constexpr float kClose = 4e-5f;
  // Of the direction; beyond, single precision may run out.
  constexpr float kShortest = 1e-18f;
  constexpr float kLongest = 1e18f;
  const auto x = static_cast<float>(direction.x());
  const auto y = static_cast<float>(direction.y());
  const auto z = static_cast<float>(direction.z());
  const float length = std::abs(x) + std::abs(y) + std::abs(z);
  if (!(length > kShortest && length < kLongest)) return scan_all(mesh, direction);
  Heights heights;
  find_heights(mesh, x, y, z, heights);
  const float least = heights.highest - kClose * length;
  if (heights.next < least) return std::bit_cast<std::int32_t>(heights.highest) & Heights::kVertex;
  const int size = static_cast<int>(mesh.vertices.size());
  int close[kScanAtMost];
  int num_close = 0;
  for (int first = 0; first < size; first += kTogether) {
    unsigned lanes = lanes_from(heights.all[first / kTogether], least);
    if (size - first < kTogether) lanes &= (1u << (size - first)) - 1u;
    for (; lanes != 0; lanes &= lanes - 1) close[num_close++] = first + std::countr_zero(lanes);
  }
  return highest_of(mesh, direction, close, num_close);
}

}  // namespace

int scan_vertices(const ConvexMesh& mesh, const Vector3& direction) {
  return static_cast<int>(mesh.vertices.size()) <= kScanAtMost ? scan_few(mesh, direction)
                                                               : scan_all(mesh, direction);
}

int support_vertex(const ConvexMesh& mesh, const Vector3& direction, int start) {
  if (static_cast<int>(mesh.vertices.size()) <= kScanAtMost) {
    return scan_few(mesh, direction);
  }
  int best = start;
  double height = mesh.vertices[best].dot(direction);
  for (bool climbed = true; climbed;) {
    climbed = false;
    const int from = best;
    for (const int i : mesh.vertex_neighbors[from]) {
      const double h = mesh.vertices[i].dot(direction);
      if (h > height) {
        height = h;
        best = i;
        climbed = true;
      }
    }
  }
  return best;
}

Vector3 CoreShape::support(const Vector3& direction) const {
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
  return shape.type == ShapeType::kConvexMesh &&
         static_cast<int>(shape.mesh->vertices.size()) > kScanAtMost;
}

double CoreShape::scan_support(const Vector3& direction) const {
  if (!climbs()) return direction.dot(support(direction));
  const int i = scan_vertices(*shape.mesh, X.rotation.transpose() * direction);
  return direction.dot(X * shape.mesh->vertices[i]);
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
