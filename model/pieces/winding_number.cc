#include "counterpoint/model/pieces/winding_number.h"

#include <algorithm>
#include <cmath>

namespace counterpoint {
namespace {

constexpr double kPi = 3.14159265358979323846;
// Numbers of cubes along the longest side, and half the diagonal of one.
constexpr double kLeastCubes = 32.0, kMostCubes = 128.0, kHalfDiagonal = 0.8661;
// Width, in edges of a cube, from which on a passage has untouched cubes wherever it lies.
constexpr double kPassage = 2.0 * kHalfDiagonal + 1.0;
// Number of cubes after which all further hollows count as open: a fraction of a second.
constexpr std::size_t kMostExplored = 50'000;
// Distance, in radii of a cluster, from which on its area vector stands for its triangles.
constexpr double kFar = 2.0;

// Tangent of the angle below which two terms of the series give it to 1e-5.
constexpr double kNarrow = 0.1;

/// Solid angle of a triangle (Van Oosterom and Strackee 1983).
double solid_angle(const Vector3& a, const Vector3& b, const Vector3& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double y = a.dot(b.cross(c));
  const double x = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
  if (std::abs(y) > kNarrow * x) return 2.0 * std::atan2(y, x);
  return 2.0 * (y / x - y * y * y / (3.0 * x * x * x));
}

/// The next cube beyond one of the six faces.
Eigen::Array3i beside(Eigen::Array3i cube, int face) {
  cube[face / 2] += face % 2 == 0 ? 1 : -1;
  return cube;
}

}  // namespace

WindingNumber::WindingNumber(const TriangleMesh& mesh, const NearestTriangle& nearest,
                             double opening, const WindingNumber* hollows)
    : mesh_(mesh),
      hollows_(hollows),
      nearest_(nearest),
      tree_(nearest.tree()),
      clusters_(tree_.nodes.size()) {
  gather(0);
  const TriangleTree::Node& root = tree_.nodes[0];
  const double side = (root.high - root.low).maxCoeff();
  cube_ = std::clamp(opening / kPassage, side / kMostCubes, side / kLeastCubes);
  fills_ = opening / kPassage >= side / kMostCubes;
  count_ = ((root.high - root.low).array() / cube_).floor().cast<int>() + 1;
  known_.assign(static_cast<std::size_t>(count_.prod()), kUnknown);
}

bool WindingNumber::inside(const Vector3& p) const {
  const Eigen::Array3d at_cube = ((p - tree_.nodes[0].low).array() / cube_).floor();
  const Eigen::Array3i cube = at_cube.max(-1.0).min(count_.cast<double>()).cast<int>();
  if (!has(cube)) return false;
  if (known_at(cube) == kFree) explore(cube);
  const Known known = known_at(cube);
  return known == kTouched ? std::abs(at(0, p)) > 0.5 : known == kInside;
}

bool WindingNumber::has(const Eigen::Array3i& cube) const {
  return (cube >= 0).all() && (cube < count_).all();
}

std::size_t WindingNumber::index_of(const Eigen::Array3i& cube) const {
  return (static_cast<std::size_t>(cube.x()) * count_.y() + cube.y()) * count_.z() + cube.z();
}

Vector3 WindingNumber::middle_of(const Eigen::Array3i& cube) const {
  return tree_.nodes[0].low + cube_ * (cube.cast<double>() + 0.5).matrix();
}

WindingNumber::Known& WindingNumber::known_at(const Eigen::Array3i& i) const {
  Known& known = known_[index_of(i)];
  if (known != kUnknown) return known;
  const Vector3 middle = middle_of(i);
  if (nearest_.find(middle).distance < kHalfDiagonal * cube_)
    known = kTouched;
  else if (std::abs(at(0, middle)) > 0.5 || (hollows_ && hollows_->inside(middle)))
    known = kInside;
  else
    known = hollows_ ? kOutside : kFree;
  return known;
}

bool WindingNumber::leads_out(Vector3 p, int face) const {
  const TriangleTree::Node& root = tree_.nodes[0];
  const int axis = face / 2;
  while (p[axis] >= root.low[axis] && p[axis] <= root.high[axis]) {
    const double clear = nearest_.find(p).distance;
    if (clear < kHalfDiagonal * cube_) return false;
    p[axis] += face % 2 == 0 ? clear : -clear;
  }
  return true;
}

void WindingNumber::explore(const Eigen::Array3i& from) const {
  const auto is_outside = [&](const Eigen::Array3i& cube) {
    return !has(cube) || known_[index_of(cube)] == kOutside;
  };
  bool closed = fills_;
  for (int face = 0; face < 6 && closed; ++face) closed = !is_outside(beside(from, face));
  for (int face = 0; face < 6 && closed; ++face) closed = !leads_out(middle_of(from), face);
  std::vector<Eigen::Array3i> found{from}, open{from};
  known_at(from) = kSeen;
  while (closed && !open.empty()) {
    const Eigen::Array3i cube = open.back();
    open.pop_back();
    for (int face = 0; face < 6 && closed; ++face) {
      const Eigen::Array3i next = beside(cube, face);
      closed = !is_outside(next) && explored_ < kMostExplored;
      if (!closed || known_at(next) != kFree) continue;
      known_at(next) = kSeen;
      ++explored_;
      found.push_back(next);
      open.push_back(next);
    }
  }
  for (const Eigen::Array3i& cube : found) known_at(cube) = closed ? kInside : kOutside;
}

WindingNumber::Cluster WindingNumber::gather(int index) {
  const TriangleTree::Node& node = tree_.nodes[index];
  Cluster cluster;
  const auto add = [&](const Vector3& area, const Vector3& center, double total) {
    cluster.area += area;
    cluster.center += total * center;
    cluster.total += total;
  };
  if (node.count > 0) {
    for (int i = node.first; i < node.first + node.count; ++i) {
      const auto& t = mesh_.triangles[tree_.order[i]];
      const Vector3 &a = mesh_.vertices[t[0]], &b = mesh_.vertices[t[1]], &c = mesh_.vertices[t[2]];
      const Vector3 area = 0.5 * (b - a).cross(c - a);
      add(area, (a + b + c) / 3.0, area.norm());
    }
  } else {
    for (const int child : {index + 1, node.right}) {
      const Cluster part = gather(child);
      add(part.area, part.center, part.total);
    }
  }
  const Vector3 middle = 0.5 * (node.low + node.high);
  cluster.center = cluster.total > 0.0 ? Vector3(cluster.center / cluster.total) : middle;
  cluster.radius = 0.5 * (node.high - node.low).norm() + (cluster.center - middle).norm();
  clusters_[index] = cluster;
  return cluster;
}

double WindingNumber::at(int index, const Vector3& p) const {
  const Cluster& cluster = clusters_[index];
  const Vector3 away = cluster.center - p;
  const double distance = away.norm();
  if (distance > kFar * cluster.radius)
    return cluster.area.dot(away) / (4.0 * kPi * distance * distance * distance);
  const TriangleTree::Node& node = tree_.nodes[index];
  if (node.count == 0) return at(index + 1, p) + at(node.right, p);
  double sum = 0.0;
  for (int i = node.first; i < node.first + node.count; ++i) {
    const auto& t = mesh_.triangles[tree_.order[i]];
    sum +=
        solid_angle(mesh_.vertices[t[0]] - p, mesh_.vertices[t[1]] - p, mesh_.vertices[t[2]] - p);
  }
  return sum / (4.0 * kPi);
}

}  // namespace counterpoint
