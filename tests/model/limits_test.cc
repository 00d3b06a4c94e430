// Hostile files: each is rejected with file, line and reason within the limits of model/limits.h,
// and none accesses files outside the permitted folders.
#include "counterpoint/model/limits.h"

#include <gtest/gtest.h>

#include <string>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"
#include "counterpoint/model/urdf/srdf.h"
#include "support/temp_folder.h"

namespace counterpoint::limits_test {
namespace {

const char* const kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

class LimitsTest : public testing::Test {
 protected:
  /// Expects a message that contains all the words.
  template <typename Read>
  static void expect_refused(const Read& read, std::initializer_list<std::string> words) {
    try {
      read();
      ADD_FAILURE() << "accepted; expected a refusal that names " << *words.begin();
    } catch (const InputError& error) {
      for (const std::string& word : words) {
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos)
            << std::string(error.what()).substr(0, 300) << "\n  does not name: " << word;
      }
    }
  }
  void expect_scene_refused(const std::string& text, std::initializer_list<std::string> words) {
    expect_refused([&] { load_scene(folder_.write("s.yaml", text)); }, words);
  }
  void expect_urdf_refused(const std::string& text, std::initializer_list<std::string> words) {
    expect_refused([&] { load_scene(folder_.write("robots/r.urdf", text)); }, words);
  }
  static std::string with_mesh(const std::string& name) {
    return "<robot name='r'><link name='a'><collision><geometry><mesh filename='" + name +
           "'/></geometry></collision></link></robot>";
  }
  static std::string box(const std::string& half, const std::string& mass,
                         const std::string& position = "[0, 0, 0]") {
    return "models:\n  - {name: b, box: [1, 1, " + half + "], mass: " + mass +
           ", position: " + position + "}\n";
  }

  test::TempFolder folder_;
};

TEST_F(LimitsTest, YamlThatNeverEnds) {
  expect_scene_refused("models: &a\n  - *a\n", {"s.yaml:", "alias within itself"});
  // Ten aliases of ten aliases, and so on: 10^9 values in 300 bytes.
  std::string laughs = "name: &a0 x\n";
  for (int i = 1; i < 10; ++i) {
    const std::string below = "*a" + std::to_string(i - 1);
    laughs += "n" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + below;
    for (int k = 1; k < 10; ++k) laughs += ", " + below;
    laughs += "]\n";
  }
  expect_scene_refused(laughs, {"s.yaml:", "more than", "aliases"});
  expect_scene_refused("name: " + std::string(limits::kMaxYamlDepth + 1, '[') +
                           std::string(limits::kMaxYamlDepth + 1, ']') + "\n",
                       {"s.yaml:1", "deeper"});
  // Far beyond the capacity of the parser's stack.
  expect_scene_refused("name: " + std::string(1'000'000, '['), {"s.yaml:1", "malformed"});
  expect_scene_refused(std::string(limits::kMaxYamlBytes + 1, '#'), {"s.yaml", "larger than"});
}

TEST_F(LimitsTest, YamlThatSaysMoreThanIsRead) {
  expect_scene_refused("name: a\n---\nname: b\n", {"s.yaml:", "second YAML document"});
  // yaml-cpp reads text to the left of the first line as an endless series of empty documents.
  expect_scene_refused("  name: a\ngravity: [0, 0, 0]\n", {"s.yaml:"});
  expect_scene_refused("packages: {a: x, a: y}\n", {"s.yaml:1", "given twice"});
}

TEST_F(LimitsTest, XmlWithEntities) {
  const std::string laughs =
      "<?xml version='1.0'?>\n<!DOCTYPE r [<!ENTITY a 'aaaaaaaa'><!ENTITY b '&a;&a;&a;&a;'>]>\n";
  expect_urdf_refused(laughs + "<robot name='r'><link name='&b;'/></robot>",
                      {"r.urdf:2", "DOCTYPE", "remove"});
  expect_refused([&] { load_srdf(folder_.write("r.srdf", laughs + "<robot name='r'/>")); },
                 {"r.srdf:2", "DOCTYPE"});
  expect_refused([&] { load_mesh(folder_.write("m.dae", laughs + "<COLLADA/>")); },
                 {"m.dae:2", "DOCTYPE"});
}

TEST_F(LimitsTest, XmlTooDeepOrTooLarge) {
  std::string deep = "<robot name='r'>";
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  expect_urdf_refused(deep, {"r.urdf:1", "100 deep"});
  std::string many = "<robot name='r'>\n";
  while (many.size() < 4 * limits::kMaxXmlMarks + 100) many += "<a/>";
  expect_urdf_refused(many + "</robot>", {"r.urdf:2", "more than", "elements"});
  std::string links = "<robot name='r'>\n";
  for (int i = 0; i <= limits::kMaxLinks; ++i)
    links += "<link name='l" + std::to_string(i) + "'/>\n";
  expect_urdf_refused(links + "</robot>",
                      {"r.urdf:" + std::to_string(limits::kMaxLinks + 2), "links"});
}

TEST_F(LimitsTest, TreesWhoseInertiaCannotBeChecked) {
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"
      "</inertial>";
  std::string chain = "<robot name='r'><link name='l0'/>\n";
  for (int i = 1; i <= limits::kMaxTreeCoordinates + 1; ++i) {
    const std::string n = std::to_string(i);
    chain += "<link name='l" + n + "'>" + inertial + "</link><joint name='j" + n +
             "' type='continuous'><parent link='l" + std::to_string(i - 1) + "'/><child link='l" +
             n + "'/></joint>\n";
  }
  expect_urdf_refused(chain + "</robot>", {"r.urdf:2", "coordinates", "closures"});
}

TEST_F(LimitsTest, NumbersNoSceneHas) {
  expect_scene_refused(box("1", "1e300"), {"s.yaml:2", "mass", "1e+300", "units"});
  expect_scene_refused(box("1", "1e-300"), {"s.yaml:2", "mass", "1e-300"});
  expect_scene_refused(box("1e-300", "1"), {"s.yaml:2", "units"});
  expect_scene_refused(box("1e300", "1"), {"s.yaml:2", "finite"});  // its inertia overflows
  expect_scene_refused(box("1e12", "1"), {"s.yaml:2", "1e+12", "units"});
  expect_scene_refused(box("1", "1", "[0, 1e200, 0]"), {"s.yaml:2", "1e+200"});
  expect_scene_refused(box("1", ".inf"), {"s.yaml:2", "finite number"});
  expect_scene_refused(box("1", ".nan"), {"s.yaml:2", "finite number"});
  EXPECT_NO_THROW(load_scene(folder_.write("s.yaml", box("1e-9", "1e-20"))));
}

TEST_F(LimitsTest, ScenesThatMultiply) {
  expect_scene_refused(
      "models:\n"
      "  - {name: a, sphere: 1, mass: 1, count: 100000, spacing: [3, 0, 0]}\n"
      "  - {name: b, sphere: 1, mass: 1, count: 100000, spacing: [3, 0, 0], position: [0, 9, 0]}\n"
      "  - {name: c, sphere: 1, mass: 1}\n",
      {"s.yaml:4", "moving bodies"});
  // 1500 x 1500 pairs in 20 kB.
  std::string group =
      "models: [{name: a, sphere: 1, mass: 1, count: 1500, spacing: [3, 0, 0]}]\n"
      "groups:\n  g: [a0/body";
  for (int i = 1; i < 1500; ++i) group += ", a" + std::to_string(i) + "/body";
  expect_scene_refused(group + "]\nexclude: [[g, g]]\n", {"s.yaml:4", "excluded"});
}

TEST_F(LimitsTest, MeshesThatMultiply) {
  const auto dae = [](const std::string& nodes) {
    return "<COLLADA version='1.4.1'><asset><up_axis>Z_UP</up_axis></asset>\n<library_nodes>" +
           nodes + "</library_nodes></COLLADA>";
  };
  expect_refused(
      [&] {
        load_mesh(folder_.write("m.dae", dae("<node id='a'><instance_node url='#a'/></node>")));
      },
      {"m.dae:2", "itself"});
  expect_refused([&] { load_mesh(folder_.write("m.dae", "<input/>\n" + dae(""))); },
                 {"m.dae:1", "COLLADA"});
  expect_refused([&] { load_mesh(folder_.write("m.dae", dae("") + "\n<input/>")); },
                 {"m.dae:3", "one element"});
  // "#" refers to a node without a name, here to the enclosing one; "Scene" to a scene without a
  // name.
  expect_refused(
      [&] {
        load_mesh(folder_.write("m.dae", dae("<node id='a'><instance_node url='#'/></node>")));
      },
      {"m.dae:2", "itself"});
  expect_refused(
      [&] {
        load_mesh(folder_.write("m.dae",
                                "<COLLADA version='1.4.1'>\n<visual_scene id='s'><node id='a'>"
                                "<instance_node url='#Scene'/></node></visual_scene></COLLADA>"));
      },
      {"m.dae:2", "itself"});
  std::string doubling = "<node id='n0'/>";
  for (int i = 1; i < 60; ++i) {
    const std::string below = "<instance_node url='#n" + std::to_string(i - 1) + "'/>";
    doubling += "\n<node id='n" + std::to_string(i) + "'>" + below + below + "</node>";
  }
  expect_refused([&] { load_mesh(folder_.write("m.dae", dae(doubling))); },
                 {"m.dae:", "comes to more than"});
  std::string chain = "<node id='n0'/>";
  for (int i = 1; i < 5000; ++i) {
    chain += "\n<node id='n" + std::to_string(i) + "'><instance_node url='#n" +
             std::to_string(i - 1) + "'/></node>";
  }
  expect_refused([&] { load_mesh(folder_.write("m.dae", dae(chain))); }, {"m.dae:", "deeper"});
}

TEST_F(LimitsTest, MeshesTooLargeToBeCut) {
  std::string polygon = "f";
  std::string points;
  for (int i = 1; i <= limits::kMaxPolygonCorners + 1; ++i) {
    points.append("v ").append(std::to_string(i)).append(" ");
    points.append(std::to_string(i * i)).append(" 0\n");
    polygon.append(" ").append(std::to_string(i));
  }
  expect_refused([&] { load_mesh(folder_.write("m.obj", points + polygon + "\n")); },
                 {"m.obj", "corners", "triangles"});
  // A binary STL with one triangle whose header claims 2^32 - 1.
  std::string stl(80, ' ');
  stl += std::string(4, '\xff') + std::string(50, '\0');
  expect_refused([&] { load_mesh(folder_.write("m.stl", stl)); }, {"m.stl"});
}

TEST_F(LimitsTest, HeightFieldsTooLarge) {
  const int columns = limits::kMaxHeightsPerSide;
  std::string row = "0";
  for (int c = 1; c < columns; ++c) row += ",0";
  row += "\n";
  std::string table;
  const int rows = static_cast<int>(limits::kMaxHeights) / columns + 1;
  for (int r = 0; r < rows; ++r) table += row;
  expect_refused([&] { load_height_table(folder_.write("h.csv", table)); },
                 {"h.csv:" + std::to_string(rows), "heights"});
  expect_refused(
      [&] { load_height_table(folder_.write("w.csv", row.substr(0, row.size() - 1) + "," + row)); },
      {"w.csv:1", "columns"});
}

TEST_F(LimitsTest, MimicsThatOverflow) {
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"
      "</inertial>";
  expect_urdf_refused(
      "<robot name='r'><link name='a'/><link name='b'>" + inertial + "</link>\n<link name='c'>" +
          inertial +
          "</link>\n<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>\n"
          "<joint name='k' type='continuous'><parent link='b'/><child link='c'/>"
          "<mimic joint='j' offset='1e300'/></joint></robot>",
      {"r.urdf:4", "'k'", "1e+300"});
}

TEST_F(LimitsTest, RobotsStayInTheirFolders) {
  folder_.write("robots/here.obj", kTetrahedron);
  folder_.write("ws/pkg/meshes/m.obj", kTetrahedron);
  folder_.write("ws/secret.obj", kTetrahedron);
  const std::filesystem::path secret = folder_.path() / "ws/secret.obj";
  const auto load = [&](const std::string& name, const UrdfOptions& options = {}) {
    return load_urdf(folder_.write("ws/pkg/robots/r.urdf", with_mesh(name)), options);
  };
  const auto expect_outside = [&](const std::string& name) {
    SCOPED_TRACE(name);
    expect_refused([&] { load(name); }, {"r.urdf:1", "outside", "--package", "packages"});
    UrdfOptions options;
    options.packages["any"] = folder_.path() / "ws";
    EXPECT_NO_THROW(load(name, options));
  };
  expect_outside("../../secret.obj");
  expect_outside(secret.string());
  expect_outside("file://" + secret.string());
  expect_outside("file://localhost" + secret.string());
  expect_outside("package://pkg/../secret.obj");
  std::filesystem::create_symlink(secret, folder_.path() / "ws/pkg/meshes/link.obj");
  expect_outside("../meshes/link.obj");
  expect_outside("package://pkg/meshes/link.obj");
  // A path that starts in a listed package and leaves it.
  UrdfOptions options;
  options.packages["p"] = folder_.path() / "ws/pkg/meshes";
  expect_refused([&] { load("package://p/../../secret.obj", options); }, {"outside"});
  EXPECT_NO_THROW(load("../meshes/m.obj"));
  EXPECT_NO_THROW(load("package://pkg/meshes/m.obj"));
  // Three folders down, only package.xml tells where the package begins. The --package that the
  // message proposes must work for all its meshes.
  folder_.write("ws/pkg/meshes/other/n.obj", kTetrahedron);
  const auto nested =
      folder_.write("ws/pkg/robots/arms/nested/r.urdf", with_mesh("../../../meshes/m.obj"));
  const std::string package = std::filesystem::canonical(folder_.path() / "ws/pkg").string();
  expect_refused([&] { load_urdf(nested); }, {"outside", "--package NAME=" + package + ","});
  options.packages["p"] = package;
  EXPECT_NO_THROW(load_urdf(nested, options));
  folder_.write("ws/pkg/robots/arms/nested/r.urdf", with_mesh("../../../meshes/other/n.obj"));
  EXPECT_NO_THROW(load_urdf(nested, options));
  folder_.write("ws/pkg/package.xml", "<package/>");
  EXPECT_NO_THROW(load_urdf(nested));
}

TEST_F(LimitsTest, CollectionsOfRobotsShareFolders) {
  // The folder structure of dex-urdf: robots/assembly/x/x.urdf names robots/arms/y/meshes/m.obj.
  folder_.write("c/robots/arms/y/meshes/m.obj", kTetrahedron);
  folder_.write("c/robots/m.obj", kTetrahedron);
  folder_.write("c/robots/arms/y/meshes/m.txt", kTetrahedron);
  const auto load = [&](const std::string& name) {
    load_urdf(folder_.write("c/robots/assembly/x/x.urdf", with_mesh(name)));
  };
  EXPECT_NO_THROW(load("../../arms/y/meshes/m.obj"));
  expect_refused([&] { load("../../m.obj"); }, {"outside"});                // not in a subfolder
  expect_refused([&] { load("../../arms/y/meshes/m.txt"); }, {"outside"});  // not a mesh
  expect_refused([&] { load("../../../robots/m.obj"); }, {"outside"});      // three levels up
  expect_refused([&] { load("../../arms/../../robots/m.obj"); },
                 {"outside"});  // leaves the folder again
}

TEST_F(LimitsTest, RobotsInTheCurrentFolder) {
  folder_.write("m.obj", kTetrahedron);
  folder_.write("r.urdf", with_mesh("m.obj"));
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder_.path());
  EXPECT_NO_THROW(load_urdf("r.urdf"));
  std::filesystem::current_path(before);
}

TEST_F(LimitsTest, MeshesOpenNoOtherFile) {
  // Assimp would read this file's materials; a folder in their place must not matter.
  std::filesystem::create_directory(folder_.path() / "x.mtl");
  EXPECT_NO_THROW(load_mesh(folder_.write("m.obj", std::string("mtllib x.mtl\n") + kTetrahedron)));
}

}  // namespace
}  // namespace counterpoint::limits_test
