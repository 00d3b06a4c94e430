#include "counterpoint/model/pieces/pieces.h"

#include <fmt/format.h>

#include <cmath>

#include "counterpoint/model/mesh/hull_standoff.h"
#include "counterpoint/model/pieces/cache.h"
#include "counterpoint/model/pieces/solid.h"
#include "counterpoint/model/pieces/thinned.h"

namespace counterpoint {
namespace pieces {
namespace {

constexpr double kDefaultTolerance = 0.02;  // relative to the hull's diameter
constexpr double kLeastTolerance = 1e-5;
constexpr int kMostPieces = 4096;
// Relative difference of volumes that count as equal, so that the order does not depend on
// rounding.
constexpr double kEqualVolumes = 1e-6;
// Error of the mesh that is cut, relative to the tolerance.
constexpr double kSimplified = 0.25;
// Parts cut for each piece allowed, before they are joined.
constexpr int kPartsPerPiece = 3;
// Operations after which no part is cut, and after which pieces are joined only to keep their
// number.
constexpr std::size_t kCutWork = 3'000'000'000, kAllWork = 4'000'000'000;

MeshCollision checked(const MeshCollision& options, double diameter, const std::string& source) {
  MeshCollision out = options;
  if (!(out.tolerance >= 0.0) || !std::isfinite(out.tolerance))
    throw InputError(
        fmt::format("{}: a tolerance of {} m; a length is expected", source, out.tolerance));
  if (out.most < 1 || out.most > kMostPieces)
    throw InputError(
        fmt::format("{}: {} pieces; 1 to {} are expected", source, out.most, kMostPieces));
  if (out.tolerance == 0.0) out.tolerance = kDefaultTolerance * diameter;
  out.tolerance = std::max(out.tolerance, kLeastTolerance * diameter);
  return out;
}

/// Cuts parts until all are within the tolerance, the largest first.
std::vector<Piece> cut(const Solid& solid, Piece&& whole, int most) {
  const std::string source = whole.hull->source;
  std::vector<Piece> done, open;
  open.push_back(std::move(whole));
  while (!open.empty()) {
    const auto next = std::max_element(open.begin(), open.end(), [](const auto& a, const auto& b) {
      return a.hull->volume * (1.0 + kEqualVolumes) < b.hull->volume;
    });
    Piece piece = std::move(*next);
    open.erase(next);
    std::optional<CutPlane> plane;
    if (piece.error > solid.tolerance && solid.work.spent < kCutWork &&
        static_cast<int>(done.size() + open.size()) < kPartsPerPiece * most)
      plane = best_cut(solid, piece);
    if (!plane) {
      done.push_back(std::move(piece));
      continue;
    }
    for (Part& part : piece.part.split(*plane, solid.near, solid.winding_simple, *piece.hull)) {
      Piece side{std::move(part), nullptr};
      side.hull = hull_of(side.part.points(), source);
      if (!side.hull) continue;  // without thickness
      side.part.reflex = piece.part.reflex;
      solid.work.spend(500 * side.part.triangles.size());
      measure_piece(solid, side);
      open.push_back(std::move(side));
    }
  }
  return done;
}

}  // namespace
}  // namespace pieces

Pieces convex_pieces(const TriangleMesh& triangles, const MeshCollision& options,
                     const std::string& source) {
  TriangleMesh mesh = triangles;
  // In some files all triangles face inwards.
  if (enclosed_volume(mesh) < 0.0)
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  const auto outer = make_convex_hull(mesh.vertices, source);
  const MeshCollision limits = pieces::checked(options, 2.0 * outer->radius, source);
  Pieces out;
  out.tolerance = limits.tolerance;
  const pieces::ThinnedMesh few = pieces::thinned(mesh);
  const auto hull = few.moved > 0.0 ? pieces::hull_of(few.mesh.vertices, source) : outer;
  if (!hull || few.mesh.triangles.empty()) {
    out.pieces = {outer};
    out.outside = out.inside = 2.0 * outer->radius;
    out.reason = "it has too many triangles, and none left when they are thinned out";
    return out;
  }
  // Thinning takes up to half of the tolerance; the pieces have the rest.
  const double tolerance = std::max(limits.tolerance - few.moved, 0.5 * limits.tolerance);
  const TriangleMesh simple = pieces::simplified(few.mesh, pieces::kSimplified * tolerance);
  const pieces::Solid solid(few.mesh, simple, *hull, tolerance);
  pieces::Piece whole{solid.whole(), pieces::hull_of(simple.vertices, source)};
  pieces::measure_piece(solid, whole);
  std::vector<pieces::Piece> parts = pieces::cut(solid, std::move(whole), limits.most);
  if (parts.size() > 1) pieces::join_pieces(solid, limits.most, pieces::kAllWork, parts);
  for (const pieces::Piece& piece : parts) out.pieces.push_back(piece.hull);
  if (out.pieces.empty()) out.pieces = {outer};
  pieces::measure_pieces(solid, mesh, out);
  out.outside += few.moved;
  if (out.pieces.size() == 1 && out.outside > limits.tolerance)
    out.reason = "no plane cuts it into parts with a volume";
  return out;
}

// The default takes pieces that stand off at most this share of the hull's distance.
constexpr double kGain = 0.5;

void add_pieces(const TriangleMesh& mesh, const MeshCollision& collision, ConvexMesh& hull) {
  const Pieces found = cached_pieces(mesh, collision, hull.source, cache_folder());
  const double standoff = std::max(found.outside, found.inside);
  // A bag of triangles that bounds no solid has no pieces that are near it.
  if (collision.kind == MeshKind::kAuto && standoff > kGain * hull.standoff) {
    hull.hull_reason = fmt::format("convex pieces would stand {:.2g} m off it", standoff);
    return;
  }
  hull.union_standoff = standoff;
  if (found.pieces.size() < 2) {
    hull.hull_reason = found.reason;
    return;
  }
  for (const auto& piece : found.pieces) {
    ConvexMesh one = *piece;
    one.union_standoff = hull.union_standoff;
    one.source.clear();  // the file alone does not give it
    hull.pieces.push_back(std::make_shared<const ConvexMesh>(std::move(one)));
  }
}

std::shared_ptr<const ConvexMesh> convex_mesh_of(const TriangleMesh& mesh,
                                                 const MeshCollision& collision,
                                                 const std::string& source) {
  const int count = static_cast<int>(mesh.vertices.size());
  for (const auto& t : mesh.triangles)
    for (const int v : t)
      if (v < 0 || v >= count)
        throw InputError(
            fmt::format("{}: a triangle names vertex {} of {}, from 0 on", source, v, count));
  ConvexMesh hull = *make_convex_hull(mesh.vertices, source);
  hull.standoff = hull_standoff(hull, mesh);
  // In some files all triangles face inwards.
  if (is_closed(mesh)) hull.source_volume = std::abs(enclosed_volume(mesh));
  if (collision.kind == MeshKind::kPieces ||
      (collision.kind == MeshKind::kAuto && is_visibly_concave(hull)))
    add_pieces(mesh, collision, hull);
  return std::make_shared<const ConvexMesh>(std::move(hull));
}

std::shared_ptr<const ConvexMesh> load_convex_mesh(const std::filesystem::path& file,
                                                   const Vector3& scale,
                                                   const MeshCollision& collision) {
  return convex_mesh_of(load_mesh(file, scale), collision, file.string());
}

}  // namespace counterpoint
