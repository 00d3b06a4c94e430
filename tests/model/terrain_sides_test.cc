// Outside of a triangle mesh: closed meshes with inverted faces, and open ones whose faces point
// away from all moving bodies.
#include <gtest/gtest.h>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/scene.h"
#include "support/shapes/solids.h"
#include "support/temp_folder.h"

namespace counterpoint::terrain_sides_test {
namespace {

constexpr double kRounding = 1e-12;  // round-off of volumes near 1 m^3

/// A model with the terrain and a ball that starts at `ball`.
Model model_with(const TriangleMesh& mesh, const Vector3& ball) {
  ModelBuilder builder;
  builder.add_environment("ground", {ShapeType::kTerrain, {}, nullptr, make_terrain(mesh)}, Pose(),
                          {});
  builder.add_robot(object_of("ball", {ShapeType::kSphere, {0.1, 0, 0}, nullptr}, 1.0),
                    Base::kFloating, {Matrix3::Identity(), ball});
  return builder.build();
}

const Terrain& terrain_of(const Model& model) {
  for (const Geometry& g : model.geometries())
    if (g.shape.terrain) return *g.shape.terrain;
  throw std::out_of_range("no terrain");
}

double volume(const Model& model) {
  TriangleMesh mesh;
  mesh.vertices = terrain_of(model).vertices;
  for (const auto& t : terrain_of(model).triangles) mesh.triangles.push_back(t.vertices);
  return enclosed_volume(mesh);
}

const Vector3 kAbove(0.5, 0.5, 2), kWithin(0.5, 0.5, 0.5);
const TriangleMesh kUp = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{{0, 1, 2}}, {{1, 3, 2}}}};
const TriangleMesh kDown = {kUp.vertices, {{{0, 2, 1}}, {{1, 2, 3}}}};

TEST(TerrainSides, ClosedMeshesInsideOutAreTurnedAndNoted) {
  const Model right = model_with(test::box_mesh({0, 0, 0}, {1, 1, 1}), kAbove);
  EXPECT_TRUE(right.notes().empty());
  EXPECT_NEAR(volume(right), 1.0, kRounding);
  const Model turned = model_with(test::box_mesh({0, 0, 0}, {1, 1, 1}, false), kAbove);
  EXPECT_NEAR(volume(turned), 1.0, kRounding);
  ASSERT_EQ(turned.notes().size(), 1u);
  EXPECT_NE(turned.notes()[0].message.find("inside out"), std::string::npos);
  EXPECT_NE(turned.notes()[0].where.find("ground"), std::string::npos);
}

TEST(TerrainSides, HollowsStayHollowAndRoomsStayRooms) {
  // A house whose inner walls face the room, given correctly or inverted as a whole; both end up
  // correct.
  const auto house = [](bool outwards) {
    return test::both(test::box_mesh({-1, -1, -1}, {2, 2, 2}, outwards),
                      test::box_mesh({0, 0, 0}, {1, 1, 1}, !outwards));
  };
  for (const Vector3& ball : {kWithin, Vector3(0.5, 0.5, 4)})
    for (const bool outwards : {true, false}) {
      const Model model = model_with(house(outwards), ball);
      EXPECT_NEAR(volume(model), 26.0, 27.0 * kRounding);
      EXPECT_EQ(model.notes().size(), outwards ? 0u : 1u);
    }
  // A room without outer walls that contains all moving bodies.
  const Model room = model_with(test::box_mesh({0, 0, 0}, {1, 1, 1}, false), kWithin);
  EXPECT_NEAR(volume(room), -1.0, kRounding);
  EXPECT_TRUE(room.notes().empty());
}

TEST(TerrainSides, OnlyThePartsThatAreInsideOutAreTurned) {
  const Model model = model_with(
      test::both(test::box_mesh({0, 0, 0}, {1, 1, 1}), test::box_mesh({3, 0, 0}, {4, 1, 1}, false)),
      kAbove);
  EXPECT_NEAR(volume(model), 2.0, 2.0 * kRounding);
  EXPECT_EQ(model.notes().size(), 1u);
}

TEST(TerrainSides, OpenMeshesThatLookAwayFromAllThatMovesAreNoted) {
  EXPECT_TRUE(model_with(kUp, kAbove).notes().empty());
  EXPECT_TRUE(model_with(kDown, {0.5, 0.5, -1}).notes().empty());
  EXPECT_TRUE(
      model_with(test::box_mesh({0, 0, 0}, {1, 1, 1}, false, false), kWithin).notes().empty());
  for (const Model& model :
       {model_with(kDown, kAbove), model_with(kUp, {0.5, 0.5, -1}),
        model_with(test::box_mesh({0, 0, 0}, {1, 1, 1}, true, false), kWithin)}) {
    ASSERT_EQ(model.notes().size(), 1u);
    EXPECT_NE(model.notes()[0].message.find("behind its faces"), std::string::npos);
  }
}

TEST(TerrainSides, MirroringScalesKeepTheOutsideOutside) {
  test::TempFolder folder;
  // A closed wedge with correct orientation.
  folder.write("w.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  folder.write("up.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nf 1 2 3\nf 2 4 3\n");
  for (const std::string scale :
       {"[1, 1, 1]", "[-1, 1, 1]", "[1, -2, 1]", "[1, 1, -1]", "[-1, -1, -1]", "[-1, -1, 1]"}) {
    const auto load = [&](const std::string& mesh, const std::string& z) {
      return load_scene(
                 folder.write("s.yaml",
                              "models: [{name: b, sphere: 0.1, mass: 1, position: [0.1, 0.1, " + z +
                                  "]}]\nenvironment: [{name: m, triangle_mesh: " + mesh +
                                  ", scale: " + scale + "}]\n"))
          .model;
    };
    const bool down = scale == "[1, 1, -1]" || scale == "[-1, -1, -1]";
    const Model wedge = load("w.obj", "3"), sheet = load("up.obj", down ? "-3" : "3");
    const Terrain& closed = terrain_of(wedge);
    for (const Terrain::Triangle& t : closed.triangles) {
      const Vector3 middle = 0.25 * (closed.low + closed.high);  // inside
      EXPECT_GT(t.normal.dot(closed.vertices[t.vertices[0]] - middle), 0.0) << scale;
    }
    EXPECT_TRUE(wedge.notes().empty()) << scale;
    EXPECT_TRUE(sheet.notes().empty()) << scale;
  }
}

}  // namespace
}  // namespace counterpoint::terrain_sides_test
