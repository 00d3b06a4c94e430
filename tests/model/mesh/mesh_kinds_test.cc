// How a mesh collides, hull or pieces, as robot files say: `optimization` of SDF 1.11 and Drake's
// <drake:declare_convex> in URDF; the scene's `meshes: files:` overrides both.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::mesh_kinds_test {
namespace {

/// A U of three walls, each 1 m thick, as OBJ: its hull has 5 / 3 of its volume.
std::string u_mesh() {
  const double x[] = {0, 3, 3, 2, 2, 1, 1, 0}, y[] = {0, 0, 3, 3, 1, 1, 3, 3};
  std::string text;
  for (const char* z : {"0", "1"})
    for (int i = 0; i < 8; ++i)
      text += "v " + std::to_string(x[i]) + " " + std::to_string(y[i]) + " " + z + "\n";
  const int faces[][3] = {{1, 2, 5}, {2, 4, 5}, {2, 3, 4}, {1, 5, 6}, {1, 6, 8}, {6, 7, 8}};
  const auto face = [&](int a, int b, int c) {
    text += "f " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
  };
  for (const auto& f : faces) {
    face(f[2], f[1], f[0]);
    face(f[0] + 8, f[1] + 8, f[2] + 8);
  }
  for (int i = 1; i <= 8; ++i) {
    const int j = i % 8 + 1;
    face(i, j, j + 8);
    face(i, j + 8, i + 8);
  }
  return text;
}

class MeshKinds : public testing::Test {
 protected:
  void SetUp() override {
    setenv("COUNTERPOINT_CACHE", "off", 1);
    folder_.write("u.obj", u_mesh());
  }
  void TearDown() override { unsetenv("COUNTERPOINT_CACHE"); }
  /// Number of shapes of a scene with one robot; `meshes`: the scene's settings.
  size_t shapes(const std::string& robot, const std::string& meshes = "") {
    return load_scene(folder_.write("s.yaml", meshes + "\nmodels: [{" + robot + "}]"))
        .model.geometries()
        .size();
  }
  size_t sdf(const std::string& mesh, const std::string& meshes = "") {
    folder_.write("m.sdf",
                  "<?xml version='1.0'?>\n<sdf version='1.11'><model name='m'><link name='b'>"
                  "<collision name='c'><geometry>\n" +
                      mesh + "</geometry></collision></link></model></sdf>");
    return shapes("sdf: m.sdf", meshes);
  }
  size_t urdf(const std::string& inside, const std::string& meshes = "") {
    folder_.write("m.urdf",
                  "<robot name='m'><link name='b'><inertial><mass value='1'/><inertia ixx='1' "
                  "iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry>"
                  "<mesh filename='u.obj'>" +
                      inside + "</mesh></geometry></collision></link></robot>");
    return shapes("urdf: m.urdf, base: floating", meshes);
  }
  std::string refusal(const std::string& mesh) {
    try {
      sdf(mesh);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  static std::string optimized(const std::string& word, const std::string& more = "") {
    return "<mesh optimization='" + word + "'><uri>u.obj</uri>" + more + "</mesh>";
  }
  test::TempFolder folder_;
};

constexpr const char* kTolerance = "meshes: {tolerance: 0.01}";

TEST_F(MeshKinds, SdfSaysHullOrPieces) {
  if (refusal(optimized("convex_hull")).find("built without SDF") != std::string::npos)
    GTEST_SKIP() << "no SDF";
  EXPECT_EQ(sdf("<mesh><uri>u.obj</uri></mesh>"), 3u);
  EXPECT_EQ(sdf("<mesh><uri>u.obj</uri></mesh>", kTolerance), 3u);
  EXPECT_EQ(sdf(optimized("convex_hull"), kTolerance), 1u);
  EXPECT_EQ(sdf(optimized("convex_decomposition")), 3u);
  const std::string two =
      "<convex_decomposition><max_convex_hulls>2</max_convex_hulls></convex_decomposition>";
  EXPECT_EQ(sdf(optimized("convex_decomposition", two)), 2u);
  // The scene has the last word.
  EXPECT_EQ(sdf(optimized("convex_hull"), "meshes: {files: {u.obj: {kind: pieces}}}"), 3u);
  EXPECT_EQ(sdf(optimized("convex_decomposition"), "meshes: {files: {u.obj: {kind: hull}}}"), 1u);
}

TEST_F(MeshKinds, SdfWithUnknownWordsIsRefused) {
  const std::string unknown = refusal(optimized("best"));
  if (unknown.find("built without SDF") != std::string::npos) GTEST_SKIP() << "no SDF";
  EXPECT_NE(unknown.find("convex_hull or convex_decomposition is expected"), std::string::npos)
      << unknown;
  EXPECT_NE(unknown.find("m.sdf:3"), std::string::npos) << unknown;
  const std::string none = refusal(optimized(
      "convex_decomposition",
      "<convex_decomposition><max_convex_hulls>0</max_convex_hulls></convex_decomposition>"));
  EXPECT_NE(none.find("max_convex_hulls"), std::string::npos) << none;
}

TEST_F(MeshKinds, UrdfDeclaresAMeshConvex) {
  EXPECT_EQ(urdf("", kTolerance), 3u);
  EXPECT_EQ(urdf("<drake:declare_convex/>", kTolerance), 1u);
  EXPECT_EQ(urdf("<drake:declare_convex/>", "meshes: {files: {u.obj: {kind: pieces}}}"), 3u);
}

}  // namespace
}  // namespace counterpoint::mesh_kinds_test
