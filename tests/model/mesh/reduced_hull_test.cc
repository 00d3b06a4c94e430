// Hulls with few vertices, shared between instances, and larger than their mesh.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/scene.h"
#include "support/random_model.h"
#include "support/temp_folder.h"

namespace counterpoint::reduced_hull_test {
namespace {

std::vector<Vector3> ball(int points) {
  test::Random random(3);
  std::vector<Vector3> out;
  for (int i = 0; i < points; ++i) out.push_back(random.unit_vector());
  return out;
}

TEST(ReducedHull, KeepsTheVerticesThatMatterAndSaysWhatItLost) {
  const auto full = make_convex_hull(ball(500));
  double last = 1.0;
  for (const int limit : {8, 32, 128}) {
    const auto reduced = reduce_hull(full, limit);
    EXPECT_EQ(static_cast<int>(reduced->vertices.size()), limit);
    EXPECT_LT(reduced->volume, full->volume);
    // Definition of the deviation: the largest distance of a vertex of the full hull from the
    // reduced one.
    double most = 0.0;
    for (size_t f = 0; f < reduced->faces.size(); ++f) {
      for (const Vector3& v : full->vertices) {
        most = std::max(most, reduced->face_normals[f].dot(v) - reduced->face_offsets[f]);
      }
    }
    // Beyond an edge the distance exceeds the distance to the face planes; for a round body hardly.
    EXPECT_GE(reduced->deviation, most - 1e-12);
    EXPECT_LT(reduced->deviation, 1.2 * most);
    EXPECT_LT(reduced->deviation, last);
    last = reduced->deviation;
  }
  // n caps of area 4 pi / n on the unit ball have the height 2 / n; greedy caps about twice that.
  EXPECT_LT(last, 2.5 * 2.0 / 128);
}

TEST(ReducedHull, SmallHullsStayAndTooSmallLimitsAreRefused) {
  const auto full = make_convex_hull(ball(20));
  EXPECT_EQ(reduce_hull(full, 20), full);
  EXPECT_EQ(full->deviation, 0.0);
  EXPECT_EQ(reduce_hull(full, 4)->vertices.size(), 4u);
  EXPECT_THROW(reduce_hull(full, 3), InputError);
}

TEST(ReducedHull, ACubeWithoutACornerMissesItByTheDistanceToTheCut) {
  std::vector<Vector3> points;
  for (int i = 0; i < 8; ++i) points.emplace_back(i & 1, i >> 1 & 1, i >> 2 & 1);
  // Seven corners of a unit cube: the face through the three neighbours is 1 / sqrt(3) from the
  // eighth.
  EXPECT_NEAR(reduce_hull(make_convex_hull(points), 7)->deviation, 1.0 / std::sqrt(3.0), 1e-12);
}

// An L-shaped bracket: a unit cube without a quarter, volume 0.75; its hull has 0.875.
const char* const kBracket =
    "v 0 0 0\nv 1 0 0\nv 1 0.5 0\nv 0.5 0.5 0\nv 0.5 1 0\nv 0 1 0\n"
    "v 0 0 1\nv 1 0 1\nv 1 0.5 1\nv 0.5 0.5 1\nv 0.5 1 1\nv 0 1 1\n"
    "f 1 4 3 2\nf 1 6 5 4\nf 7 8 9 10\nf 7 10 11 12\n"
    "f 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";

TEST(HullCache, InstancesShareOneHullAndItsVolumeIsToldOnce) {
  test::TempFolder folder;
  folder.write("bracket.obj", kBracket);
  const std::string robot =
      R"(<robot name="r"><link name="a"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="bracket.obj"/></geometry></collision>
<collision><geometry><mesh filename="bracket.obj" scale="2 1 1"/></geometry></collision></link></robot>)";
  folder.write("r.urdf", robot);
  folder.write("q.urdf", robot);
  const Scene scene = load_scene(folder.write(
      "s.yaml",
      "models:\n- {urdf: r.urdf, name: x, base: floating, count: 3, spacing: [3, 0, 0]}\n"
      "- {urdf: q.urdf, name: y, base: floating, position: [0, 9, 0]}\n"
      "environment:\n- {name: wall, mesh: bracket.obj, position: [0, -9, 0]}\n"
      "meshes: {kind: hull}\n"));
  const auto& g = scene.model.geometries();
  ASSERT_EQ(g.size(), 9u);
  for (const int i : {2, 4, 6, 8}) EXPECT_EQ(g[i].shape.mesh, g[0].shape.mesh);
  for (const int i : {3, 5, 7}) EXPECT_EQ(g[i].shape.mesh, g[1].shape.mesh);
  EXPECT_NE(g[0].shape.mesh, g[1].shape.mesh);
  EXPECT_NEAR(g[0].shape.mesh->volume / g[0].shape.mesh->source_volume, 0.875 / 0.75, 1e-6);
  int told = 0;
  for (const Note& note : scene.model.notes())
    told += note.message.find("1.17 times") != std::string::npos;
  EXPECT_EQ(told, 2);  // for each scale
}

TEST(HullCache, TheLimitOfASceneHoldsForEveryMesh) {
  test::TempFolder folder;
  folder.write("bracket.obj", kBracket);
  const Scene scene = load_scene(folder.write(
      "s.yaml",
      "hull_vertices: 6\nmeshes: {kind: hull}\nenvironment:\n- {name: wall, mesh: bracket.obj}\n"));
  const ConvexMesh& hull = *scene.model.geometries()[0].shape.mesh;
  EXPECT_EQ(hull.vertices.size(), 6u);
  EXPECT_GT(hull.deviation, 0.1);
  EXPECT_NEAR(hull.source_volume, 0.75, 1e-6);
}

TEST(HullCache, ALoneRobotTakesTheLimitFromTheOptions) {
  test::TempFolder folder;
  folder.write("bracket.obj", kBracket);
  const auto robot = folder.write(
      "r.urdf",
      R"(<robot name="r"><link name="a"><collision><geometry><mesh filename="bracket.obj"/></geometry>
</collision></link></robot>)");
  SceneOverrides overrides;
  overrides.meshes.kind = MeshKind::kHull;
  EXPECT_EQ(load_scene(robot, overrides).model.geometries()[0].shape.mesh->vertices.size(), 10u);
  overrides.hull_vertices = 5;
  EXPECT_EQ(load_scene(robot, overrides).model.geometries()[0].shape.mesh->vertices.size(), 5u);
}

}  // namespace
}  // namespace counterpoint::reduced_hull_test
