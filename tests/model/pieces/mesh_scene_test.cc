// Meshes in scene files: hull or pieces, names of pieces, mass of the solid.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "counterpoint/model/scene.h"
#include "support/shapes/solids.h"
#include "support/temp_folder.h"

namespace counterpoint::mesh_scene_test {
namespace {

std::string obj_of(const TriangleMesh& mesh) {
  std::string text;
  for (const Vector3& p : mesh.vertices) text += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
  for (const auto& t : mesh.triangles)
    text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

class MeshScene : public ::testing::Test {
 protected:
  MeshScene() { folder.write("l.obj", obj_of(test::bracket())); }
  Scene load(const std::string& meshes, const std::string& more = "") {
    return load_scene(folder.write(
        "s.yaml", meshes + "models:\n- {name: a, mesh: l.obj, mass: 8}\n" +
                      "environment:\n- {name: wall, mesh: l.obj, position: [9, 0, 0]}\n" + more));
  }
  test::TempFolder folder;
};

TEST_F(MeshScene, AConcaveMeshIsInPiecesUnlessTheSceneAsksForHulls) {
  EXPECT_EQ(load("").model.geometries().size(), 4U);
  EXPECT_EQ(load("meshes: {tolerance: 0.01}\n").model.geometries().size(), 4U);
  EXPECT_EQ(load("meshes: {kind: hull}\n").model.geometries().size(), 2U);
  EXPECT_EQ(load("meshes: {files: {l.obj: {kind: hull}}}\n").model.geometries().size(), 2U);
  EXPECT_EQ(load("meshes: {kind: hull, files: {l.obj: {kind: pieces, tolerance: 0.01}}}\n")
                .model.geometries()
                .size(),
            4U);
}

TEST_F(MeshScene, PiecesHaveTheNameOfTheMeshAndANumber) {
  const Scene scene = load("meshes: {kind: pieces}\n", "exclude:\n- [wall, a/body/shape]\n");
  const auto& all = scene.model.geometries();
  EXPECT_EQ(all[0].name, "a/body/shape#0");
  EXPECT_EQ(all[1].name, "a/body/shape#1");
  EXPECT_EQ(all[1].whole, 0);
  EXPECT_EQ(all[3].whole, 2);
  EXPECT_EQ(scene.model.excluded_geometry_pairs().size(), 4U);
}

// Bodies that share a mesh share the note on it.
TEST_F(MeshScene, ANoteOnAMeshIsSaidOnce) {
  const Scene scene = load("meshes: {kind: pieces}\n");  // a body and the environment have it
  int notes = 0;
  for (const Note& note : scene.model.notes())
    notes += note.message.find("2 convex pieces") != std::string::npos ? 1 : 0;
  EXPECT_EQ(notes, 1);
}

// Mass, centre and inertia are those of the solid: an L of areas 3 and 1, 1 m thick.
TEST_F(MeshScene, MassPropertiesAreThoseOfTheSolid) {
  constexpr double kRound = 1e-6;  // coordinates pass through single precision
  for (const char* kind : {"hull", "pieces"}) {
    const Scene scene = load(fmt::format("meshes: {{kind: {}}}\n", kind));
    const SpatialInertia& inertia = scene.model.body(1).inertia;
    EXPECT_NEAR(inertia.mass, 8.0, kRound);
    const Vector3 center((3.0 * 1.5 + 0.5) / 4.0, (3.0 * 0.5 + 1.5) / 4.0, 0.5);
    EXPECT_LT((inertia.center - center).norm(), kRound);
  }
}

TEST_F(MeshScene, FaultsAreNamed) {
  const auto message = [&](const std::string& meshes) -> std::string {
    try {
      load(meshes);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message("meshes: {kind: exact}\n").find("auto, hull or pieces"), std::string::npos);
  EXPECT_NE(message("meshes: {tolerance: -1}\n").find("s.yaml"), std::string::npos);
  EXPECT_NE(message("meshes: {most: 0}\n").find("s.yaml"), std::string::npos);
  TriangleMesh open = test::bracket();
  open.triangles.pop_back();
  folder.write("l.obj", obj_of(open));
  EXPECT_NE(message("").find("not closed"), std::string::npos);
}

}  // namespace
}  // namespace counterpoint::mesh_scene_test
