#include "counterpoint/model/mesh/round_hull.h"

#include <fmt/format.h>

#include <array>
#include <map>

#include "counterpoint/model/geometry.h"

namespace counterpoint {
namespace {

struct Ball {
  std::vector<Vector3> points;  // on the unit sphere
  std::vector<std::array<int, 3>> triangles;
};

Ball icosahedron() {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  Ball ball;
  for (const double a : {-1.0, 1.0})
    for (const double b : {-g, g})
      for (const Vector3& p : {Vector3(a, b, 0), Vector3(0, a, b), Vector3(b, 0, a)})
        ball.points.push_back(p.normalized());
  const auto& p = ball.points;
  const double edge = 1.1 * 2.0 / std::sqrt(1.0 + g * g);
  for (int i = 0; i < 12; ++i)
    for (int j = i + 1; j < 12; ++j)
      for (int k = j + 1; k < 12; ++k)
        if ((p[i] - p[j]).norm() < edge && (p[j] - p[k]).norm() < edge &&
            (p[i] - p[k]).norm() < edge)
          ball.triangles.push_back({i, j, k});
  return ball;
}

Ball halved(const Ball& coarse) {
  Ball fine{coarse.points, {}};
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int i, int j) {
    const auto [at, is_new] =
        middles.emplace(std::minmax(i, j), static_cast<int>(fine.points.size()));
    if (is_new) fine.points.push_back((coarse.points[i] + coarse.points[j]).normalized());
    return at->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const auto& t : {std::array{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}})
      fine.triangles.push_back(t);
  }
  return fine;
}

}  // namespace

RoundHull ellipsoid_hull(const Vector3& half_axes) {
  Ball ball = icosahedron();
  for (int i = 0; i < 3; ++i) ball = halved(ball);
  double inside = 1.0;  // distance of the nearest face from the centre of the unit ball
  for (const auto& [a, b, c] : ball.triangles) {
    const auto& p = ball.points;
    inside = std::min(inside, std::abs((p[b] - p[a]).cross(p[c] - p[a]).normalized().dot(p[a])));
  }
  // Scaled so that the corners are as far outside as the faces are inside.
  const double scale = 2.0 / (1.0 + inside);
  for (Vector3& p : ball.points) p = scale * p.cwiseProduct(half_axes);
  return {make_convex_hull(ball.points), (scale - 1.0) * half_axes.maxCoeff()};
}

std::string round_hull_note(const RoundHull& round) {
  return fmt::format("an ellipsoid touches as a polyhedron of {} corners, within {:.2g} m of it",
                     round.hull->vertices.size(), round.error);
}

}  // namespace counterpoint
