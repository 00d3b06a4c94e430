#include "counterpoint/model/pieces/pieces.h"

#include <fmt/format.h>

#include <cmath>

#include "counterpoint/model/mesh/hull_standoff.h"
#include "counterpoint/model/pieces/solid.h"

namespace counterpoint {
namespace pieces {
namespace {

constexpr double kDefaultTolerance = 0.01;  // relative to the hull's diameter
constexpr double kLeastTolerance = 1e-5;
constexpr int kMostPieces = 4096;
// Relative difference of volumes that count as equal, so that the order does not depend on
// rounding.
constexpr double kTie = 1e-6;
// Parts cut for each piece allowed, before they are joined.
constexpr int kPartsPerPiece = 3;

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
std::vector<Piece> cut(const Solid& solid, const std::shared_ptr<const ConvexMesh>& hull,
                       double error, int most) {
  std::vector<Piece> done, open;
  open.push_back({solid.whole(), hull, error});
  while (!open.empty()) {
    const auto next = std::max_element(open.begin(), open.end(), [](const auto& a, const auto& b) {
      return a.hull->volume * (1.0 + kTie) < b.hull->volume;
    });
    Piece piece = std::move(*next);
    open.erase(next);
    std::optional<CutPlane> plane;
    if (piece.error > solid.tolerance &&
        static_cast<int>(done.size() + open.size()) < kPartsPerPiece * most)
      plane = best_cut(solid, piece);
    if (!plane) {
      done.push_back(std::move(piece));
      continue;
    }
    for (Part& part : piece.part.split(*plane, solid.slack, solid.winding)) {
      Piece side{std::move(part), nullptr, 0.0};
      side.hull = hull_of(side.part.points(), hull->source);
      if (!side.hull) continue;  // without thickness
      side.part.reflex = piece.part.reflex;
      side.error = piece_error(solid, side.part, *side.hull);
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
  const auto hull = make_convex_hull(mesh.vertices, source);
  const MeshCollision limits = pieces::checked(options, 2.0 * hull->radius, source);
  const pieces::Solid solid(mesh, *hull, limits.tolerance);
  Pieces out;
  out.tolerance = limits.tolerance;
  const double error = pieces::piece_error(solid, solid.whole(), *hull);
  std::vector<pieces::Piece> parts = pieces::cut(solid, hull, error, limits.most);
  if (parts.size() > 1) pieces::join_pieces(solid, limits.most, parts);
  for (pieces::Piece& piece : parts) out.pieces.push_back(std::move(piece.hull));
  if (out.pieces.empty()) out.pieces = {hull};
  pieces::measure_pieces(solid, out);
  if (out.pieces.size() > 1 || error <= limits.tolerance) return out;
  out.reason = "no plane cuts it into parts with a volume";
  return out;
}

void add_pieces(const TriangleMesh& mesh, const MeshCollision& collision, ConvexMesh& hull) {
  Pieces found = convex_pieces(mesh, collision, hull.source);
  hull.union_standoff = std::max(found.outside, found.inside);
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
  ConvexMesh hull = *make_convex_hull(mesh.vertices, source);
  hull.standoff = hull_standoff(hull, mesh);
  // In some files all triangles face inwards.
  if (is_closed(mesh)) hull.source_volume = std::abs(enclosed_volume(mesh));
  if (collision.kind == MeshKind::kPieces ||
      (collision.kind == MeshKind::kAuto && collision.tolerance > 0.0 && is_visibly_concave(hull)))
    add_pieces(mesh, collision, hull);
  return std::make_shared<const ConvexMesh>(std::move(hull));
}

std::shared_ptr<const ConvexMesh> load_convex_mesh(const std::filesystem::path& file,
                                                   const Vector3& scale,
                                                   const MeshCollision& collision) {
  return convex_mesh_of(load_mesh(file, scale), collision, file.string());
}

}  // namespace counterpoint
