// Decomposition into convex pieces: known numbers of pieces, distances, volumes, invariance, and
// meshes that no solid has.
#include "counterpoint/model/pieces/pieces.h"

#include <gtest/gtest.h>

#include <random>

#include "support/random_poses.h"
#include "support/shapes/solids.h"
#include "support/sphere_points.h"

namespace counterpoint::pieces_test {
namespace {

using test::bracket;
using test::torus;

// Round-off of coordinates and volumes relative to a size of about 1.
constexpr double kRound = 1e-9;

Pieces cut(const TriangleMesh& mesh, double tolerance = 0.0, int most = 256) {
  return convex_pieces(mesh, {MeshKind::kPieces, tolerance, most}, "mesh");
}

double volume_of(const Pieces& pieces) {
  double sum = 0.0;
  for (const auto& piece : pieces.pieces) sum += piece->volume;
  return sum;
}

double area_of(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles) {
    const Vector3& p = mesh.vertices[t[0]];
    sum += 0.5 * (mesh.vertices[t[1]] - p).cross(mesh.vertices[t[2]] - p).norm();
  }
  return sum;
}

double depth_in(const ConvexMesh& piece, const Vector3& p) {
  double depth = std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < piece.faces.size(); ++f)
    depth = std::min(depth, piece.face_offsets[f] - piece.face_normals[f].dot(p));
  return depth;
}

/// Depth of a point in the piece that holds it deepest [m]; negative outside of all.
double depth_in(const Pieces& pieces, const Vector3& p) {
  double depth = -std::numeric_limits<double>::infinity();
  for (const auto& piece : pieces.pieces) depth = std::max(depth, depth_in(*piece, p));
  return depth;
}

/// A cube of half edge `half`; `hollow`: its faces look inwards.
TriangleMesh cube(double half, bool hollow) {
  return test::box_mesh(Vector3::Constant(-half), Vector3::Constant(half), !hollow);
}

void expect_within_tolerance(const Pieces& pieces) {
  EXPECT_LE(pieces.outside, pieces.tolerance);
  EXPECT_LE(pieces.inside, pieces.tolerance);
  EXPECT_EQ(pieces.reason, "");
}

TEST(Pieces, AConvexMeshIsOnePiece) {
  const auto ball = make_convex_hull(test::sphere_points(200));
  TriangleMesh mesh{ball->vertices, {}};
  for (const auto& face : ball->faces)
    for (std::size_t i = 2; i < face.size(); ++i)
      mesh.triangles.push_back({face[0], face[i - 1], face[i]});
  const Pieces pieces = cut(mesh, 1e-3);
  ASSERT_EQ(pieces.pieces.size(), 1U);
  EXPECT_NEAR(volume_of(pieces), ball->volume, kRound);
  EXPECT_LE(std::max(pieces.outside, pieces.inside), kRound);
}

// Rounding does not lift the distance of a convex mesh, none, above the tolerance.
TEST(Pieces, AConvexMeshIsOnePieceAtAnyTolerance) {
  const TriangleMesh mesh = cube(1.0, false);
  for (int k = 1; k <= 100; ++k) EXPECT_EQ(cut(mesh, 1e-3 * k / 7.0).pieces.size(), 1U) << k;
}

TEST(Pieces, AnLIsTwoExactPieces) {
  const Pieces pieces = cut(bracket());
  ASSERT_EQ(pieces.pieces.size(), 2U);
  EXPECT_NEAR(volume_of(pieces), 4.0, kRound);
  EXPECT_LE(std::max(pieces.outside, pieces.inside), kRound);
}

// A torus of flat-sided sectors is its sectors: convex, and no two have a convex union.
TEST(Pieces, ATorusOfSectorsIsItsSectors) {
  const TriangleMesh mesh = torus(5.0, 1.0, 24, 12);
  const Pieces pieces = cut(mesh, 1e-3);
  EXPECT_EQ(pieces.pieces.size(), 24U);
  EXPECT_NEAR(volume_of(pieces), enclosed_volume(mesh), kRound * 100.0);
}

TEST(Pieces, RoundBodiesAreWithinTheirTolerance) {
  for (const TriangleMesh& mesh : {torus(5.0, 1.0, 64, 24), test::cup(0.04, 0.1, 0.004, 32),
                                   test::bowl(0.4, 0.02, 0.5, 6, 32)}) {
    const double size = 2.0 * make_convex_hull(mesh.vertices)->radius;
    for (const double share : {0.02, 0.01}) {
      const Pieces pieces = cut(mesh, share * size);
      expect_within_tolerance(pieces);
      EXPECT_GT(pieces.pieces.size(), 1U);
      // The union lacks at most a layer of thickness `inside` of the solid.
      EXPECT_GE(volume_of(pieces), enclosed_volume(mesh) - area_of(mesh) * pieces.inside);
    }
  }
}

// Beyond 10,000 triangles vertices are clustered; `outside` has how far they moved, at most the
// diagonal of a cell, here a 60th of the longest side.
TEST(Pieces, ManyTrianglesAreThinnedOut) {
  const TriangleMesh mesh = torus(5.0, 1.0, 150, 50);
  const Pieces pieces = cut(mesh, 0.12);
  EXPECT_LE(pieces.inside, pieces.tolerance);
  EXPECT_LE(pieces.outside, pieces.tolerance + std::sqrt(3.0) * 12.0 / 60.0);
  EXPECT_GE(pieces.pieces.size(), 8U);  // sectors of a ring within 1 % of its diameter
  EXPECT_LE(pieces.pieces.size(), 64U);
}

// Noise on a ball: far more notches than there is work for. It ends, and says how far it came.
TEST(Pieces, WorkEndsAndTheDistanceReachedIsGiven) {
  const auto ball = make_convex_hull(test::sphere_points(2000));
  TriangleMesh mesh{ball->vertices, {}};
  for (const auto& face : ball->faces)
    for (std::size_t i = 2; i < face.size(); ++i)
      mesh.triangles.push_back({face[0], face[i - 1], face[i]});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(0.8, 1.0);
  for (Vector3& p : mesh.vertices) p *= u(random);
  const Pieces pieces = cut(mesh, 1e-4, 64);
  EXPECT_LE(pieces.pieces.size(), 64U);
  EXPECT_GT(std::max(pieces.outside, pieces.inside), pieces.tolerance);
}

// A hollow that cannot be entered is solid: a closed box with thick walls is one box.
TEST(Pieces, AClosedHollowIsFilled) {
  const TriangleMesh mesh = test::both(cube(1.0, false), cube(0.6, true));
  const Pieces pieces = cut(mesh, 0.05);
  ASSERT_EQ(pieces.pieces.size(), 1U);
  EXPECT_NEAR(volume_of(pieces), 8.0, kRound);
  EXPECT_LE(std::max(pieces.outside, pieces.inside), kRound);
}

// The middle of a torus, the inside of a cup and the hole of a tube stay open.
TEST(Pieces, HollowsStayOpen) {
  const Pieces ring = cut(torus(5.0, 1.0, 48, 16)), mug = cut(test::cup(0.04, 0.1, 0.004, 32));
  // The middle of a hole of radius 0.03 is farther from the solid than the tolerance.
  const TriangleMesh tube = test::revolved({{0.03, 0}, {1, 0}, {1, 4}, {0.03, 4}}, 24, true);
  const Pieces pipe = cut(tube, 0.02);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    const Vector3 p(u(random), u(random), u(random));
    EXPECT_LT(depth_in(ring, 2.5 * p), 0.0);
    EXPECT_LT(depth_in(mug, {0.02 * p.x(), 0.02 * p.y(), 0.05 + 0.04 * p.z()}), 0.0);
    EXPECT_LT(depth_in(pipe, {0.0, 0.0, 2.0 + 2.0 * p.z()}), 0.0);
  }
  // With a tolerance above its radius it may be filled.
  expect_within_tolerance(cut(tube, 0.1));
}

// Rounding chooses between cuts that are as good by the symmetry of a mesh.
TEST(Pieces, MovingTurningAndScalingChangesOnlyRounding) {
  const Pose X{rotation_from_rpy(0.3, -1.1, 2.0), Vector3(3, -2, 5)};
  const TriangleMesh ring = torus(5.0, 1.0, 24, 12);
  const std::size_t parts = cut(ring).pieces.size();
  for (const TriangleMesh& mesh : {bracket(), ring}) {
    const Pieces here = cut(mesh);
    for (const double factor : {1.0, 1e-3, 250.0}) {
      TriangleMesh moved = mesh;
      for (Vector3& p : moved.vertices) p = factor * (X * p);
      const Pieces there = cut(moved);
      if (mesh.vertices.size() == ring.vertices.size()) {
        expect_within_tolerance(there);
        EXPECT_LE(there.pieces.size(), parts + 1);
        continue;
      }
      ASSERT_EQ(there.pieces.size(), here.pieces.size());
      for (std::size_t i = 0; i < here.pieces.size(); ++i) {
        const Vector3 expected = factor * (X * here.pieces[i]->interior_point);
        EXPECT_LT((there.pieces[i]->interior_point - expected).norm(), kRound * 20.0 * factor);
      }
    }
  }
}

TEST(Pieces, TheSameMeshGivesTheSameBits) {
  const TriangleMesh mesh = test::cup(0.04, 0.1, 0.004, 24);
  const Pieces one = cut(mesh), two = cut(mesh);
  ASSERT_EQ(one.pieces.size(), two.pieces.size());
  for (std::size_t i = 0; i < one.pieces.size(); ++i)
    EXPECT_EQ(one.pieces[i]->vertices, two.pieces[i]->vertices);
}

TEST(Pieces, NeverMoreThanAllowed) {
  for (const int most : {1, 2, 5}) {
    const Pieces pieces = cut(torus(5.0, 1.0, 24, 12), 1e-3, most);
    EXPECT_LE(pieces.pieces.size(), static_cast<std::size_t>(most));
    EXPECT_GT(std::max(pieces.outside, pieces.inside), pieces.tolerance);
  }
}

TEST(Pieces, MeshesThatBoundNoSolidStayWithinTheLimits) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const auto check = [](const TriangleMesh& mesh) {
    const Pieces pieces = cut(mesh, 0.05, 16);
    EXPECT_GE(pieces.pieces.size(), 1U);
    EXPECT_LE(pieces.pieces.size(), 16U);
    EXPECT_TRUE(std::isfinite(pieces.outside) && std::isfinite(pieces.inside));
  };
  TriangleMesh open = test::cup(0.5, 1.0, 0.1, 12);
  open.triangles.resize(open.triangles.size() / 2);
  check(open);
  TriangleMesh turned = bracket();  // some triangles face the other way
  for (std::size_t i = 0; i < turned.triangles.size(); i += 3)
    std::swap(turned.triangles[i][0], turned.triangles[i][1]);
  check(turned);
  for (int i = 0; i < 5; ++i) {
    TriangleMesh soup;  // triangles anywhere, some of them slivers
    for (int k = 0; k < 60; ++k) {
      const Vector3 p(u(random), u(random), u(random)), q(u(random), u(random), u(random));
      const Vector3 r = k % 3 == 0 ? Vector3(0.5 * (p + q) + 1e-9 * Vector3::UnitX())
                                   : Vector3(u(random), u(random), u(random));
      const int first = static_cast<int>(soup.vertices.size());
      soup.vertices.insert(soup.vertices.end(), {p, q, r});
      soup.triangles.push_back({first, first + 1, first + 2});
    }
    check(soup);
  }
  TriangleMesh sheet;  // two planes that cross, without thickness
  for (const Vector3& n : {Vector3(Vector3::UnitX()), Vector3(Vector3::UnitY())}) {
    const int first = static_cast<int>(sheet.vertices.size());
    for (const double s : {-1.0, 1.0})
      for (const double z : {-1.0, 1.0}) sheet.vertices.push_back(s * n + z * Vector3::UnitZ());
    sheet.triangles.push_back({first, first + 1, first + 2});
    sheet.triangles.push_back({first + 1, first + 3, first + 2});
  }
  check(sheet);
}

TEST(Pieces, BadLimitsAreRefused) {
  EXPECT_THROW(cut(bracket(), -1.0), InputError);
  EXPECT_THROW(cut(bracket(), std::nan("")), InputError);
  EXPECT_THROW(cut(bracket(), 0.1, 0), InputError);
}

TEST(MeshCollision, AutoTakesPiecesWhereTheHullIsFarOff) {
  const auto by = [](const TriangleMesh& mesh, MeshKind kind) {
    return convex_mesh_of(mesh, {kind, 0.01, 64}, "m");
  };
  EXPECT_EQ(convex_mesh_of(bracket(), {MeshKind::kAuto, 0.0, 64})->pieces.size(), 2U);
  EXPECT_EQ(by(bracket(), MeshKind::kAuto)->pieces.size(), 2U);
  EXPECT_NE(hull_note(*by(bracket(), MeshKind::kAuto)).find("2 convex pieces"), std::string::npos);
  EXPECT_TRUE(by(bracket(), MeshKind::kHull)->pieces.empty());
  EXPECT_NE(hull_note(*by(bracket(), MeshKind::kHull)).find("convex hull"), std::string::npos);
  // A dent that adds 1 % to the volume and is 1 % deep.
  const TriangleMesh flat = test::extruded({{0, 0}, {2, 0}, {2, 1}, {1, 0.98}, {0, 1}}, 1.0);
  EXPECT_TRUE(by(flat, MeshKind::kAuto)->pieces.empty());
  EXPECT_EQ(convex_mesh_of(flat, {MeshKind::kPieces, 1e-3, 64})->pieces.size(), 2U);
}

// One cut alone saves nothing of a dent in the middle of a face.
TEST(Pieces, ADentInAFaceStaysOpen) {
  const Pieces pieces = cut(test::cup(2.0, 2.0, 1.2, 4), 0.05);
  expect_within_tolerance(pieces);
  EXPECT_LE(pieces.pieces.size(), 5U);  // a floor and four walls
  EXPECT_LT(depth_in(pieces, {0.0, 0.0, 1.9}), 0.0);
}

TEST(MeshCollision, ATriangleNamesOnlyVerticesThatAre) {
  TriangleMesh mesh = bracket();
  mesh.triangles[3][1] = static_cast<int>(mesh.vertices.size());
  EXPECT_THROW(convex_mesh_of(mesh, {}), InputError);
  mesh.triangles[3][1] = -1;
  EXPECT_THROW(convex_mesh_of(mesh, {}), InputError);
}

}  // namespace
}  // namespace counterpoint::pieces_test
