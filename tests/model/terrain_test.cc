// Triangle meshes and height fields: edges, files, and rejected input.
#include <gtest/gtest.h>

#include <limits>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/scene.h"
#include "support/random_model.h"
#include "support/temp_folder.h"

namespace counterpoint::terrain_test {
namespace {

using Edge = Terrain::Edge;

// PNG images of two rows: 8 bits (0 51 255 / 255 102 0), 16 bits (0 65535 / 13107 1), 1 bit (0 1 /
// 1 0), and colour.
constexpr unsigned char kGray8[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44,
    0x52, 0x00, 0x00, 0x00, 0x03, 0x00, 0x00, 0x00, 0x02, 0x08, 0x00, 0x00, 0x00, 0x00, 0xb8,
    0x1f, 0x39, 0xc6, 0x00, 0x00, 0x00, 0x10, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x60,
    0x30, 0xfe, 0xcf, 0xf0, 0x3f, 0x8d, 0x01, 0x00, 0x09, 0xfe, 0x02, 0x98, 0x5f, 0x04, 0x82,
    0x3d, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82,
};

constexpr unsigned char kGray16[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44,
    0x52, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x02, 0x10, 0x00, 0x00, 0x00, 0x00, 0x07,
    0x4d, 0x8e, 0xbb, 0x00, 0x00, 0x00, 0x12, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x60,
    0x60, 0xf8, 0xff, 0x9f, 0xc1, 0xd8, 0x98, 0x81, 0x11, 0x00, 0x0e, 0x63, 0x02, 0x66, 0x2d,
    0xa3, 0xba, 0xd0, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82,
};

constexpr unsigned char kGray1[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48,
    0x44, 0x52, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x02, 0x01, 0x00, 0x00, 0x00,
    0x00, 0x5a, 0xcd, 0x30, 0x89, 0x00, 0x00, 0x00, 0x0c, 0x49, 0x44, 0x41, 0x54, 0x78,
    0xda, 0x63, 0x70, 0x60, 0x68, 0x00, 0x00, 0x01, 0x44, 0x00, 0xc1, 0x04, 0x87, 0xcf,
    0xfa, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82,
};

constexpr unsigned char kColour[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48,
    0x44, 0x52, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x02, 0x08, 0x02, 0x00, 0x00,
    0x00, 0xfd, 0xd4, 0x9a, 0x73, 0x00, 0x00, 0x00, 0x0b, 0x49, 0x44, 0x41, 0x54, 0x78,
    0xda, 0x63, 0x60, 0x40, 0x06, 0x00, 0x00, 0x0e, 0x00, 0x01, 0x3a, 0x35, 0x04, 0x56,
    0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82,
};

template <size_t N>
std::string bytes(const unsigned char (&data)[N]) {
  return {reinterpret_cast<const char*>(data), N};
}

template <typename Action>
void expect_refused(Action action, const std::vector<std::string>& words) {
  try {
    action();
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    for (const std::string& word : words) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  }
}

// A unit square of two triangles with the corner (1, 1) lifted by z.
TriangleMesh square(double z) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, z}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 3}, {1, 2, 3}};
  return mesh;
}

TEST(Terrain, EdgesAreToldApartByTheirBend) {
  EXPECT_EQ(make_terrain(square(0.0))->triangles[0].edges[1], Edge::kFlat);
  EXPECT_EQ(make_terrain(square(1e-6))->triangles[0].edges[1], Edge::kFlat);
  EXPECT_EQ(make_terrain(square(0.1))->triangles[0].edges[1], Edge::kConcave);
  EXPECT_EQ(make_terrain(square(-0.1))->triangles[1].edges[2], Edge::kConvex);
  const auto terrain = make_terrain(square(0.1));
  EXPECT_EQ(terrain->triangles[0].edges[0], Edge::kRim);
  EXPECT_EQ(terrain->triangles[0].neighbors, (std::array<int, 3>{-1, 1, -1}));
  EXPECT_EQ(terrain->vertex_neighbors[1], (std::vector<int>{0, 2, 3}));
  EXPECT_EQ(terrain->misfits, 0);
}

TEST(Terrain, DropsWhatIsFlawedAndCountsIt) {
  TriangleMesh mesh = square(0.0);
  mesh.triangles.push_back({0, 1, 1});  // degenerate by index
  mesh.triangles.push_back({3, 0, 1});  // duplicate, rotated
  mesh.vertices.emplace_back(2, 0, 0);
  mesh.triangles.push_back({0, 1, 4});  // collinear vertices
  const auto terrain = make_terrain(mesh, "flawed");
  EXPECT_EQ(terrain->triangles.size(), 2u);
  EXPECT_EQ(terrain->dropped, 3);
  EXPECT_EQ(terrain->misfits, 0);
  std::swap(mesh.triangles[1][0], mesh.triangles[1][1]);
  const auto inverted = make_terrain(mesh);
  EXPECT_GT(inverted->misfits, 0);
  EXPECT_EQ(inverted->triangles[0].edges[1], Edge::kRim);
}

TEST(Terrain, BothSidesOfASheetKeepTheirOwnNeighbours) {
  TriangleMesh mesh = square(0.1);
  mesh.triangles.push_back({0, 3, 1});
  mesh.triangles.push_back({1, 3, 2});
  const auto terrain = make_terrain(mesh);
  EXPECT_EQ(terrain->triangles[0].neighbors[1], 1);
  EXPECT_EQ(terrain->triangles[0].edges[1], Edge::kConcave);
  EXPECT_EQ(terrain->triangles[2].neighbors[1], 3);
  EXPECT_EQ(terrain->triangles[2].edges[1], Edge::kConvex);
}

TEST(Terrain, RefusesWhatIsNoMesh) {
  TriangleMesh mesh = square(0.0);
  mesh.vertices[2].y() = std::numeric_limits<double>::quiet_NaN();
  expect_refused([&] { make_terrain(mesh, "a.stl"); }, {"a.stl", "vertex 2", "finite"});
  mesh = square(0.0);
  mesh.triangles[1][2] = 4;
  expect_refused([&] { make_terrain(mesh, "a.stl"); }, {"a.stl", "triangle 1", "vertex 4"});
  mesh.triangles = {{0, 0, 1}};
  expect_refused([&] { make_terrain(mesh, "a.stl"); }, {"a.stl", "area"});
}

TEST(Terrain, TheTreeFindsWhatEveryTriangleSays) {
  test::Random random(4);
  TriangleMesh mesh;
  for (int i = 0; i < 900; ++i) {
    const Vector3 corner = random.vector(2.0);
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(corner + random.vector(0.2));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const auto terrain = make_terrain(mesh);
  for (int k = 0; k < 100; ++k) {
    const Vector3 low = random.vector(2.0);
    const Vector3 high = low + random.vector(1.0).cwiseAbs();
    std::vector<int> expected, found;
    for (int t = 0; t < 900; ++t) {
      Vector3 a = mesh.vertices[3 * t], b = a;
      for (int v = 1; v < 3; ++v) {
        a = a.cwiseMin(mesh.vertices[3 * t + v]);
        b = b.cwiseMax(mesh.vertices[3 * t + v]);
      }
      if ((a.array() <= high.array()).all() && (b.array() >= low.array()).all())
        expected.push_back(t);
    }
    terrain->find(low, high, found);
    EXPECT_EQ(found, expected);
  }
}

TEST(HeightField, ReadsImagesOfEveryDepth) {
  test::TempFolder folder;
  const HeightGrid eight = load_height_image(folder.write("a.png", bytes(kGray8)));
  EXPECT_EQ(eight.rows, 2);
  EXPECT_EQ(eight.columns, 3);
  EXPECT_EQ(eight.heights, (std::vector<double>{0, 0.2, 1, 1, 0.4, 0}));
  EXPECT_EQ(load_height_image(folder.write("b.png", bytes(kGray16))).heights,
            (std::vector<double>{0, 1, 0.2, 1 / 65535.0}));
  EXPECT_EQ(load_height_image(folder.write("c.png", bytes(kGray1))).heights,
            (std::vector<double>{0, 1, 1, 0}));
}

TEST(HeightField, RefusesOtherFiles) {
  test::TempFolder folder;
  const auto refused = [&](const std::string& name, const std::string& content,
                           const std::string& word) {
    expect_refused([&] { load_height_image(folder.write(name, content)); }, {name, word});
  };
  refused("colour.png", bytes(kColour), "grayscale");
  refused("text.png", "hello, hello", "grayscale PNG");
  refused("empty.png", "", "grayscale PNG");
  std::string cut = bytes(kGray8);
  refused("cut.png", cut.substr(0, cut.size() - 20), "grayscale PNG");
  cut[cut.size() - 20] ^= 1;
  refused("flipped.png", cut, "grayscale PNG");
  expect_refused([&] { load_height_image(folder.path() / "missing.png"); }, {"missing.png"});
}

TEST(HeightField, ReadsTables) {
  test::TempFolder folder;
  const HeightGrid grid =
      load_height_table(folder.write("a.csv", "# heights\n0, 1.5 ,2\n\n-1,+3e-1,0\r\n"));
  EXPECT_EQ(grid.rows, 2);
  EXPECT_EQ(grid.heights, (std::vector<double>{0, 1.5, 2, -1, 0.3, 0}));
  const auto refused = [&](const std::string& content, const std::string& word) {
    expect_refused([&] { load_height_table(folder.write("b.csv", content)); }, {"b.csv", word});
  };
  refused("", "no heights");
  refused("1,2\n1,2,3\n", ":2");
  refused("1,nan\n", "nan");
  refused("1,,2\n", "no height");
  refused("1 2\n", "commas");
}

TEST(HeightField, LiesAsTheImageIsLookedAt) {
  const HeightGrid grid{2, 3, {1, 2, 3, 4, 5, 6}};
  const TriangleMesh mesh = height_field_mesh(grid, 4.0, 2.0, 0.5, "grid");
  EXPECT_EQ(mesh.vertices[0], Vector3(-2, 1, 0.5));
  EXPECT_EQ(mesh.vertices[5], Vector3(2, -1, 3));
  EXPECT_EQ(mesh.triangles.size(), 4u);
  const auto terrain = make_terrain(mesh);
  for (const Terrain::Triangle& t : terrain->triangles) EXPECT_GT(t.normal.z(), 0.0);
  expect_refused([] { height_field_mesh({1, 3, {1, 2, 3}}, 1, 1, 1, "thin.csv"); }, {"thin.csv"});
}

TEST(HeightField, StandsInAScene) {
  test::TempFolder folder;
  folder.write("hill.png", bytes(kGray8));
  folder.write("hill.csv", "0,1\n1,0\n");
  folder.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\nf 2 3 4\n");
  const auto scene = folder.write(
      "a.yaml",
      "environment:\n"
      "- {name: hill, height_field: {file: hill.png, size: [4, 2], height: 0.5}}\n"
      "- {name: table, height_field: {file: hill.csv, size: [1, 1]}, position: [5, 0, 0]}\n"
      "- {name: sheet, triangle_mesh: sheet.obj, scale: [2, 2, 1]}\n");
  const Scene loaded = load_scene(scene);
  ASSERT_EQ(loaded.model.geometries().size(), 3u);
  EXPECT_EQ(loaded.model.geometries()[0].shape.terrain->high, Vector3(2, 1, 0.5));
  EXPECT_EQ(loaded.model.geometries()[2].shape.terrain->high, Vector3(2, 2, 0));
  // The sheet's third triangle coincides with the second, with the opposite orientation.
  ASSERT_EQ(loaded.model.notes().size(), 1u);
  EXPECT_NE(loaded.model.notes()[0].message.find("opposite"), std::string::npos);
  const auto refused = [&](const std::string& item, const std::vector<std::string>& words) {
    expect_refused([&] { load_scene(folder.write("b.yaml", "environment:\n- " + item + "\n")); },
                   words);
  };
  refused("{name: a, height_field: {file: hill.png, size: [4, 2]}}", {"b.yaml:2", "height"});
  refused("{name: a, height_field: {file: hill.csv, size: [4, 2], height: 2}}",
          {"b.yaml:2", "metres"});
  refused("{name: a, height_field: {file: hill.csv, size: [4, 0]}}", {"b.yaml:2", "two lengths"});
  refused("{name: a, height_field: {file: hill.jpg, size: [4, 1]}}", {"b.yaml:2", ".png"});
  refused("{name: a, height_field: {file: no.csv, size: [4, 1]}}", {"b.yaml:2", "no.csv"});
  refused("{name: a, triangle_mesh: no.obj}", {"b.yaml:2", "no.obj"});
}

}  // namespace
}  // namespace counterpoint::terrain_test
