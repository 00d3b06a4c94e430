#include <algorithm>
#include <cmath>

#include "counterpoint/model/pieces/solid.h"

namespace counterpoint::pieces {
namespace {

struct Join {
  // Volume of the common hull without those of the two, in billionths of the size cubed: whole, so
  // that the order does not depend on rounding.
  double growth;
  int a, b;

  bool operator<(const Join& other) const {
    return std::tie(growth, a, b) < std::tie(other.growth, other.a, other.b);
  }
};

bool meet(const ConvexMesh& a, const ConvexMesh& b, double slack) {
  const auto apart = [&](const ConvexMesh& one, const ConvexMesh& other) {
    for (std::size_t f = 0; f < one.faces.size(); ++f) {
      double least = std::numeric_limits<double>::infinity();
      for (const Vector3& p : other.vertices)
        least = std::min(least, one.face_normals[f].dot(p) - one.face_offsets[f]);
      if (least > slack) return true;
    }
    return false;
  };
  return (a.interior_point - b.interior_point).norm() <= a.radius + b.radius + slack &&
         !apart(a, b) && !apart(b, a);
}

std::vector<Vector3> points_of(const ConvexMesh& a, const ConvexMesh& b) {
  std::vector<Vector3> points = a.vertices;
  points.insert(points.end(), b.vertices.begin(), b.vertices.end());
  return points;
}

/// Lists the joins of piece `b` with those before it, and of later ones if it is new.
void add_joins(const Solid& solid, const std::vector<Piece>& pieces, int b,
               std::vector<Join>& joins) {
  for (int a = 0; a < b; ++a) {
    if (!pieces[a].hull || !meet(*pieces[a].hull, *pieces[b].hull, 1e3 * solid.slack)) continue;
    const double together = convex_hull_volume(points_of(*pieces[a].hull, *pieces[b].hull));
    const double growth = together - pieces[a].hull->volume - pieces[b].hull->volume;
    joins.push_back({std::round(1e9 * growth / std::pow(solid.size, 3)), a, b});
  }
}

/// Returns the common piece; without hull if it is not within the tolerance.
Piece joined(const Solid& solid, const Piece& a, const Piece& b) {
  Piece out;
  out.part.triangles = a.part.triangles;
  out.part.triangles.insert(out.part.triangles.end(), b.part.triangles.begin(),
                            b.part.triangles.end());
  // A plane between the two does not bound the common piece, whose hull has no face in it.
  out.part.planes = a.part.planes;
  out.part.planes.insert(out.part.planes.end(), b.part.planes.begin(), b.part.planes.end());
  out.hull = hull_of(points_of(*a.hull, *b.hull), a.hull->source);
  if (out.hull) out.error = piece_error(solid, out.part, *out.hull);
  return out;
}

}  // namespace

void join_pieces(const Solid& solid, int most, std::vector<Piece>& pieces) {
  std::vector<Join> joins, refused;
  for (int b = 0; b < static_cast<int>(pieces.size()); ++b) add_joins(solid, pieces, b, joins);
  int count = static_cast<int>(pieces.size());
  const auto add = [&](const Join& join, Piece&& common) {
    for (const int old : {join.a, join.b}) pieces[old].hull.reset();
    const auto gone = [&](const Join& other) {
      return !pieces[other.a].hull || !pieces[other.b].hull;
    };
    std::erase_if(joins, gone);
    std::erase_if(refused, gone);
    pieces.push_back(std::move(common));
    add_joins(solid, pieces, static_cast<int>(pieces.size()) - 1, joins);
    --count;
  };
  while (!joins.empty() || (count > most && !refused.empty())) {
    std::vector<Join>& from = joins.empty() ? refused : joins;
    const auto next = std::min_element(from.begin(), from.end());
    const Join join = *next;
    from.erase(next);
    Piece common = joined(solid, pieces[join.a], pieces[join.b]);
    if (!common.hull) continue;
    if (common.error <= solid.tolerance || &from == &refused) {
      add(join, std::move(common));
    } else {
      refused.push_back(join);
    }
  }
  std::erase_if(pieces, [](const Piece& piece) { return !piece.hull; });
}

}  // namespace counterpoint::pieces
