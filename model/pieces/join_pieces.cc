#include <algorithm>
#include <cmath>

#include "counterpoint/model/pieces/quick_hull.h"
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
void add_joins(const Solid& solid, const std::vector<Piece>& pieces, int b, std::size_t most_work,
               std::vector<Join>& joins) {
  for (int a = 0; a < b; ++a) {
    if (!pieces[a].hull || !meet(*pieces[a].hull, *pieces[b].hull, 1e3 * solid.slack)) continue;
    // Once the work is used up, balls around the pieces stand for their hulls.
    const double reach = (pieces[a].hull->interior_point - pieces[b].hull->interior_point).norm() +
                         pieces[a].hull->radius + pieces[b].hull->radius;
    const double together =
        solid.work.spent > most_work
            ? std::pow(reach, 3)
            : quick_hull(points_of(*pieces[a].hull, *pieces[b].hull), solid.axes, solid.work)
                  .volume;
    const double growth = together - pieces[a].hull->volume - pieces[b].hull->volume;
    joins.push_back({std::round(1e9 * growth / std::pow(solid.size, 3)), a, b});
  }
}

class Joiner {
 public:
  Joiner(const Solid& solid, std::size_t most_work, std::vector<Piece>& pieces)
      : solid_(solid), most_work_(most_work), pieces_(pieces), count_(pieces.size()) {
    for (std::size_t b = 0; b < pieces.size(); ++b)
      add_joins(solid, pieces, static_cast<int>(b), most_work, joins_);
  }

  void run(std::size_t most) {
    while (!joins_.empty() || (count_ > most && !refused_.empty())) {
      const bool tired = solid_.work.spent > most_work_;
      if (tired && count_ <= most) break;
      const bool force = joins_.empty() || tired;
      std::vector<Join>& from = joins_.empty() ? refused_ : joins_;
      const auto next = std::min_element(from.begin(), from.end());
      const Join join = *next;
      from.erase(next);
      Piece common = joined(pieces_[join.a], pieces_[join.b], force);
      if (!common.hull) continue;
      if (force || common.error <= solid_.tolerance) {
        add(join, std::move(common));
      } else {
        refused_.push_back(join);
      }
    }
    std::erase_if(pieces_, [](const Piece& piece) { return !piece.hull; });
  }

 private:
  /// Returns the common piece, not measured if it is kept whatever its error; without hull if it is
  /// flat.
  Piece joined(const Piece& a, const Piece& b, bool force) const {
    Piece out;
    out.hull = hull_of(points_of(*a.hull, *b.hull), a.hull->source);
    if (!out.hull) return out;
    solid_.work.spend(2'000 * out.hull->vertices.size());
    out.error = solid_.size;
    if (!force) measure_piece(solid_, out);
    return out;
  }

  void add(const Join& join, Piece&& common) {
    for (const int old : {join.a, join.b}) pieces_[old].hull.reset();
    const auto gone = [&](const Join& other) {
      return !pieces_[other.a].hull || !pieces_[other.b].hull;
    };
    std::erase_if(joins_, gone);
    std::erase_if(refused_, gone);
    pieces_.push_back(std::move(common));
    add_joins(solid_, pieces_, static_cast<int>(pieces_.size()) - 1, most_work_, joins_);
    --count_;
  }

  const Solid& solid_;
  std::size_t most_work_;
  std::vector<Piece>& pieces_;
  std::size_t count_;  // number of pieces with a hull
  std::vector<Join> joins_, refused_;
};

}  // namespace

void join_pieces(const Solid& solid, int most, std::size_t most_work, std::vector<Piece>& pieces) {
  Joiner(solid, most_work, pieces).run(static_cast<std::size_t>(most));
}

}  // namespace counterpoint::pieces
