#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "counterpoint/model/geometry.h"
#include "support/hull_check.h"
#include "support/random_model.h"
#include "support/temp_folder.h"

namespace counterpoint::mesh_test {
namespace {

using test::expect_valid;
using test::kMerged;
using test::kSinglePrecision;

// A tetrahedron with a corner at the origin and legs 1, 2, 3: volume 1.
constexpr double kLegs[3] = {1, 2, 3};
const char* const kObj = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

std::string ascii_stl() {
  const Vector3 p[4] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::ostringstream out;
  out << "solid t\n";
  for (const auto& f : faces) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (int v : f) out << "vertex " << p[v].transpose() << "\n";
    out << "endloop\nendfacet\n";
  }
  out << "endsolid t\n";
  return out.str();
}

std::string binary_stl() {
  const float p[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::string out(80, ' ');
  const std::uint32_t count = 4;
  out.append(reinterpret_cast<const char*>(&count), 4);
  for (const auto& f : faces) {
    out.append(12, '\0');
    for (int v : f) out.append(reinterpret_cast<const char*>(p[v]), 12);
    out.append(2, '\0');
  }
  return out;
}

std::string dae(const std::string& up, const std::string& unit) {
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="u" meter=")" +
         unit + R"("/><up_axis>)" + up + R"(</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 0 2 0 0 0 3</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
)";
}

Vector3 highest(const TriangleMesh& mesh) {
  Vector3 high = mesh.vertices[0];
  for (const Vector3& p : mesh.vertices) high = high.cwiseMax(p);
  return high;
}

void expect_tetrahedron(const TriangleMesh& mesh, const Vector3& legs) {
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(enclosed_volume(mesh), legs.prod() / 6, kSinglePrecision * legs.prod());
  EXPECT_LT((highest(mesh) - legs).norm(), kSinglePrecision * legs.norm());
}

/// Expects a message that names the file and contains the word.
void expect_refused(const std::filesystem::path& file, const std::string& word,
                    const Vector3& scale = Vector3::Ones()) {
  try {
    load_convex_mesh(file, scale);
    ADD_FAILURE() << file << " was accepted; expected: " << word;
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find(file.filename().string()), std::string::npos) << message;
    EXPECT_NE(message.find(word), std::string::npos) << message;
  }
}

TEST(Mesh, ReadsEveryFormat) {
  test::TempFolder folder;
  const Vector3 legs(kLegs[0], kLegs[1], kLegs[2]);
  expect_tetrahedron(load_mesh(folder.write("t.obj", kObj)), legs);
  expect_tetrahedron(load_mesh(folder.write("a.stl", ascii_stl())), legs);
  expect_tetrahedron(load_mesh(folder.write("b.STL", binary_stl())), legs);
  expect_tetrahedron(load_mesh(folder.write("z.dae", dae("Z_UP", "1"))), legs);
  expect_tetrahedron(load_mesh(folder.write("cm.dae", dae("Z_UP", "0.01"))), 0.01 * legs);
}

TEST(Mesh, ColladaUpAxisBecomesZ) {
  test::TempFolder folder;
  // The file's y axis (leg 2) is up; its z axis (leg 3) becomes -y.
  const TriangleMesh mesh = load_mesh(folder.write("y.dae", dae("Y_UP", "1")));
  EXPECT_LT((highest(mesh) - Vector3(1, 0, 2)).norm(), kSinglePrecision);
  EXPECT_NEAR(enclosed_volume(mesh), 1.0, kSinglePrecision);
}

const std::string kColladaTriangles =
    R"(<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>)";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

// The same tetrahedron by every kind of polygon; the fan and the two strips have inner edges.
TEST(Mesh, ColladaPolygonsOfEveryKind) {
  test::TempFolder folder;
  const std::string input = R"(<input semantic="VERTEX" source="#v" offset="0"/>)";
  const std::string p = "<p>0 2 1 0 1 3 0 3 2 1 2 3</p>", sizes = "<vcount>3 3 3 3</vcount>";
  const std::string kinds[] = {
      "<polylist count='4'>" + input + sizes + p + "</polylist>",
      "<polylist count='4'><extra>" + p + "</extra>" + p + input + sizes + "</polylist>",
      "<polylist count='5'>" + input + "<vcount>3 3 2 3 3</vcount>" +
          "<p>0 2 1 0 1 3 0 1 0 3 2 1 2 3</p></polylist>",
      "<polygons count='4'>" + input +
          "<p>0 2 1</p><p>0 1 3</p><p>0 3 2</p><p>1 2 3</p></polygons>",
      "<trifans count='2'>" + input + "<p>0 2 1 3 2</p><p>1 2 3</p></trifans>",
      "<tristrips count='1'>" + input + "<p>0 2 1 3 0 2</p></tristrips>",
      // Vertices at the second of three offsets, missing normals, and an additional line.
      "<triangles count='4'><input semantic='NORMAL' source='#n' offset='2'/>"
      "<input semantic='VERTEX' source='#v' offset='1'/><p>9 0 0 9 2 0 9 1 0  9 0 1 9 1 1 9 3 1 "
      "9 0 2 9 3 2 9 2 2  9 1 3 9 2 3 9 3 3</p></triangles><lines count='1'>" +
          input + "<p>0 99</p></lines>",
      "<triangles>" + input + "<p>0 2 1 0 1<!-- \n --> 3 0 3 2 <![CDATA[1 2 3]]></p></triangles>",
  };
  for (const std::string& kind : kinds) {
    SCOPED_TRACE(kind);
    const std::string text = replaced(dae("Z_UP", "1"), kColladaTriangles, kind);
    expect_tetrahedron(load_mesh(folder.write("m.dae", text)),
                       Vector3(kLegs[0], kLegs[1], kLegs[2]));
  }
}

// Assimp would crash on some of these and read others as a different solid.
TEST(Mesh, ColladaThatIsNotWhatItSaysIsRefused) {
  test::TempFolder folder;
  const std::string input = R"(<input semantic="VERTEX" source="#v" offset="0"/>)";
  const std::string p = "<p>0 2 1 0 1 3 0 3 2 1 2 3</p>";
  const auto polygons = [&](const std::string& kind, const std::string& inside) {
    return std::pair(kColladaTriangles, "<" + kind + " count='4'>" + inside + "</" + kind + ">");
  };
  const std::string instance = R"(<instance_geometry url="#g"/>)";
  const std::string vertices = R"(<vertices id="v"><input semantic="POSITION" source="#p"/>)";
  const std::string array = "<float_array id=\"pa\" count=\"12\">";
  const std::pair<std::pair<std::string, std::string>, const char*> cases[] = {
      {polygons("polylist", input + p), "has no <vcount>"},
      {polygons("polylist", "<vcount>3 3 3 3</vcount>" + p), "VERTEX"},
      {polygons("polylist", input + "<vcount>3 3 3 4</vcount>" + p), "polygon of 4"},
      {polygons("polylist", input + "<vcount>3 3 3</vcount>" + p), "as many"},
      {polygons("polylist", input + "<vcount>3 3 6</vcount>" + p), "as many"},
      {polygons("polylist", input + "<vcount>3 3 3 0 3</vcount>" + p), "polygon of 0"},
      {polygons("triangles", input + p + p), "second time"},
      {polygons("triangles", input + input + p), "second time"},
      {polygons("triangles", input + "<p>0 2 4 0 1 3 0 3 2 1 2 3</p>"), "index 4"},
      {polygons("triangles", input + "<p>0 2 -1 0 1 3 0 3 2 1 2 3</p>"), "index -1"},
      {polygons("triangles", input + "<p>0 2 1.5 0 1 3 0 3 2 1 2 3</p>"), "'1.5"},
      {polygons("polygons", input + "<ph><p>0 1 2</p><h>0 1 3</h></ph>"), "<ph> stands in"},
      {polygons("triangles", "<input semantic='VERTEX' source='#p' offset='0'/>" + p), "vertices"},
      {{vertices, vertices + R"(<input semantic="POSITION" source="#p"/>)"}, "second time"},
      {{vertices, R"(<vertices id="v"><input semantic="NORMAL" source="#p"/>)"}, "POSITION"},
      {{vertices, R"(<vertices id="v"><input semantic="POSITION" source="#q"/>)"}, "'q'"},
      {{array, "<float_array id=\"pa\" count=\"13\">"}, "as many numbers"},
      {{array, "<float_array id=\"pb\" count=\"12\">"}, "array beside"},
      {{array, array + "0 </float_array>" + array}, "second time"},
      {{"0 0 0 1", "0 0 nan 1"}, "'nan"},
      {{"0 0 0 1", "0 0 0x1 1"}, "'0x1"},
      {{"stride=\"3\"", "stride=\"4\""}, "beyond its array"},
      {{"stride=\"3\"", ""}, "stride"},
      {{"<node id=\"n\">", "<node id=\"n&#10;\">"}, "control character"},
      {{"name=\"Y\"", "name=\"Z\""}, "X, Y and Z"},
      {{"meter=\"1\"", "meter=\"0\""}, "metres"},
      {{"meter=\"1\"", "meter=\"one\""}, "metres"},
      {{"Z_UP", "Z"}, "neither"},
      {{instance, R"(<instance_geometry url="#h"/>)"}, "'h'"},
      {{instance, R"(<instance_geometry url="other.dae#g"/>)"}, "other.dae"},
      {{instance, R"(<instance_node url="#h"/>)"}, "'#h'"},
      {{instance, R"(<instance_controller url="#c"/>)"}, "skin"},
      {{instance, "<translate>0 1</translate>" + instance}, "3 numbers"},
      {{instance, "<skew>30 1 0 0 0 1 0</skew>" + instance}, "<matrix>"},
      {{"</geometry>", "</geometry><geometry id='g'/>"}, "second time"},
      {{"</mesh>", "</mesh><mesh/>"}, "second time"},
      {{"<mesh>", "<convex_mesh/><mesh>"}, "only <mesh>"},
  };
  for (const auto& [change, message] : cases) {
    SCOPED_TRACE(change.second);
    expect_refused(folder.write("m.dae", replaced(dae("Z_UP", "1"), change.first, change.second)),
                   message);
  }
}

// Elements that do not belong to the solid are not passed to assimp, whatever they contain.
TEST(Mesh, ColladaLibrariesThatAreNotReadMayHoldAnything) {
  test::TempFolder folder;
  const std::string text =
      replaced(dae("Z_UP", "1"), "<library_geometries>",
               "<library_controllers><controller id='c'><skin source=''><joints><input/></joints>"
               "<vertex_weights "
               "count='9'><vcount/></vertex_weights></skin></controller></library_controllers>"
               "<library_animations><animation><channel source='' "
               "target='/'/></animation></library_animations>"
               "<library_effects><effect><profile_COMMON><image/></profile_COMMON></effect></"
               "library_effects>"
               "<library_geometries>");
  expect_tetrahedron(load_mesh(folder.write("m.dae", text)), Vector3(kLegs[0], kLegs[1], kLegs[2]));
}

// Two nodes in one; the second is scaled by 2 along x, mirrored along y and moved by 5 along x.
TEST(Mesh, SubmeshesAreOneAndStandWhereTheirNodesSay) {
  test::TempFolder folder;
  const std::string node = R"(<node id="n"><instance_geometry url="#g"/></node>)";
  const std::string text =
      replaced(dae("Z_UP", "1"), node, R"(<node id="top"><translate>0 0 1</translate>
<node id="n"><instance_geometry url="#g"/></node>
<node id="m"><matrix>2 0 0 5 0 -1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url="#g"/></node>
</node>)");
  const TriangleMesh mesh = load_mesh(folder.write("two.dae", text));
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_TRUE(is_closed(mesh));
  // Mirroring must keep the orientation of the faces: the volumes add up.
  EXPECT_NEAR(enclosed_volume(mesh), 1.0 + 2.0, 10.0 * kSinglePrecision);
  EXPECT_LT((highest(mesh) - Vector3(7, 2, 4)).norm(), 10.0 * kSinglePrecision);
  double lowest_y = 0.0;
  for (const Vector3& p : mesh.vertices) lowest_y = std::min(lowest_y, p.y());
  EXPECT_NEAR(lowest_y, -2.0, kSinglePrecision);
}

// Triangles that are degenerate, duplicate, inverted or a third at an edge do not change the hull.
TEST(Mesh, FlawsDoNotChangeTheHull) {
  test::TempFolder folder;
  const std::string flaws[] = {"f 1 1 2\n", "f 1 3 2\nf 1 3 2\n", "f 1 2 3\n",
                               "v 0.5 0 0\nf 1 5 2\n", "v 0.1 0.1 0.1\nf 1 2 5\n"};
  for (const std::string& flaw : flaws) {
    const auto hull = load_convex_mesh(folder.write("t.obj", kObj + flaw));
    EXPECT_EQ(hull->vertices.size(), 4u) << flaw;
    EXPECT_NEAR(hull->volume, 1.0, kSinglePrecision) << flaw;
    EXPECT_LT(hull->standoff, 1e-6) << flaw;
    expect_valid(*hull, kMerged * 4.0);
  }
}

// Truncated and corrupted files are read or rejected; every file that is read gives a valid hull.
TEST(Mesh, DamagedFilesAreReadOrRefused) {
  test::TempFolder folder;
  test::Random random(17);
  const std::pair<const char*, std::string> files[] = {{"d.obj", kObj},
                                                       {"d.stl", ascii_stl()},
                                                       {"e.stl", binary_stl()},
                                                       {"d.dae", dae("Y_UP", "0.5")}};
  int read = 0, refused = 0;
  for (const auto& [name, text] : files) {
    for (int i = 0; i < 200; ++i) {
      std::string damaged = text;
      const int last = static_cast<int>(text.size()) - 1;
      const bool cut = i % 4 == 0;
      if (cut) damaged.resize(random.integer(0, last));
      for (int k = 0; !cut && k < 1 + i % 3; ++k) {
        const int at = std::min(random.integer(0, last), static_cast<int>(damaged.size()) - 1);
        damaged[at] = static_cast<char>(random.integer(0, 255));
      }
      try {
        const auto hull = load_convex_mesh(folder.write(name, damaged));
        ++read;
        EXPECT_TRUE(std::isfinite(hull->volume) && hull->volume > 0.0) << name << " " << i;
        EXPECT_TRUE(std::isfinite(hull->standoff)) << name << " " << i;
      } catch (const InputError& error) {
        ++refused;
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      }
    }
  }
  EXPECT_GT(read, 50);
  EXPECT_GT(refused, 50);
}

TEST(Mesh, ScalesAndMirrors) {
  test::TempFolder folder;
  const auto file = folder.write("t.obj", kObj);
  expect_tetrahedron(load_mesh(file, {2, 1, 0.5}), {2, 2, 1.5});
  const TriangleMesh mirrored = load_mesh(file, {-1, 1, 1});
  EXPECT_NEAR(enclosed_volume(mirrored), 1.0, kSinglePrecision) << "outside stays outside";
  EXPECT_EQ(highest(mirrored).x(), 0.0);
  const auto hull = load_convex_mesh(file);
  EXPECT_NEAR(hull->volume, 1.0, kSinglePrecision);
  EXPECT_NEAR(hull->source_volume, 1.0, kSinglePrecision);
  EXPECT_EQ(hull->source, file.string());
}

TEST(Mesh, RefusesWhatItCannotRead) {
  test::TempFolder folder;
  expect_refused(folder.path() / "missing.stl", "no such");
  expect_refused(folder.path(), "no such");
  expect_refused(folder.write("t.ply", "ply"), "not known");
  expect_refused(folder.write("empty.stl", ""), "");
  expect_refused(folder.write("text.obj", "hello"), "");
  expect_refused(folder.write("cut.stl", binary_stl().substr(0, 150)), "");
  expect_refused(folder.write("nan.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n"), "");
  expect_refused(folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "volume");
  expect_refused(folder.write("t.obj", kObj), "scale", {1, 0, 1});
}

TEST(Mesh, OpenMeshHasNoSourceVolume) {
  test::TempFolder folder;
  const auto file =
      folder.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\n");
  EXPECT_EQ(load_convex_mesh(file)->source_volume, 0.0);
}

}  // namespace
}  // namespace counterpoint::mesh_test
