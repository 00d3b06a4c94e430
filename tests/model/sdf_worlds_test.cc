// Typical Gazebo worlds: the sun and ground plane of its library, lights, friction in two
// directions, motors.
#include <gtest/gtest.h>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"
#include "support/temp_folder.h"

namespace counterpoint::sdf_worlds_test {
namespace {

class SdfWorlds : public testing::Test {
 protected:
  void SetUp() override {
    const std::string why = refusal("<world name='w'/>");
    if (why.find("built without SDF") != std::string::npos) GTEST_SKIP() << why;
  }
  Scene world(const std::string& contents) const {
    return load_scene(folder_.write("p/w/w.world", "<sdf version='1.6'>\n" + contents + "</sdf>"));
  }
  std::string refusal(const std::string& contents) const {
    try {
      world(contents);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  void expect_refused(const std::string& contents, std::initializer_list<std::string> words) const {
    const std::string why = refusal(contents);
    for (const std::string& word : words)
      EXPECT_NE(why.find(word), std::string::npos) << why << "\n  does not name: " << word;
  }
  static const Geometry& geometry(const Scene& s, const std::string& name) {
    for (const Geometry& g : s.model.geometries())
      if (g.name == name) return g;
    throw std::out_of_range(name);
  }
  static bool noted(const Scene& s, const std::string& text) {
    for (const Note& note : s.model.notes())
      if ((note.where + ": " + note.message).find(text) != std::string::npos) return true;
    return false;
  }
  /// A ball of 1 kg with these surface values.
  static std::string ball(const std::string& name, const std::string& friction = "",
                          const std::string& more = "") {
    return "<model name='" + name + "'><pose>0 0 1 0 0 0</pose><link name='l'>" + more +
           "<collision name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry>"
           "<surface><friction><ode>" +
           friction + "</ode></friction></surface></collision></link></model>";
  }
  static std::string mu(const std::string& along, const std::string& across) {
    return "<mu>" + along + "</mu><mu2>" + across + "</mu2>";
  }
  test::TempFolder folder_;
};

TEST_F(SdfWorlds, SunAndGroundPlaneAreKnownWithoutALibrary) {
  for (const std::string uri :
       {"model://", "https://fuel.gazebosim.org/1.0/OpenRobotics/models/"}) {
    const bool fuel = uri[0] == 'h';
    const Scene s = world(
        "<world name='w'><!-- <include> -->\n<include><uri>" + uri + (fuel ? "Sun" : "sun") +
        "</uri></include>\n<include>\n<uri> " + uri + (fuel ? "Ground Plane/2" : "ground_plane") +
        "</uri></include><include><uri>model://ground_plane</uri><name>ramp</name>"
        "<pose>0 0 -1 0.5 0 0</pose></include>" +
        ball("b") +
        "<light name='sun' type='directional'><direction>0 0 -1</direction></light></world>");
    EXPECT_EQ(geometry(s, "ground_plane/link/collision").shape.type, ShapeType::kPlane);
    EXPECT_EQ(geometry(s, "ground_plane/link/collision").body, 0);
    const Pose& ramp = geometry(s, "ramp/link/collision").X_BG;
    EXPECT_EQ(ramp.translation, Vector3(0, 0, -1));
    EXPECT_NEAR(ramp.rotation(2, 2), std::cos(0.5), 1e-15);
    ASSERT_FALSE(s.model.pair_materials().empty());
    EXPECT_EQ(s.model.pair_materials()[0].material.friction, 1.0);  // the ball's value, the smaller
    EXPECT_TRUE(noted(s, "w.world:3: <include>")) << uri;
  }
}

TEST_F(SdfWorlds, LinesStayWhereTheyAre) {
  expect_refused(
      "<world name='w'><include>\n<uri>model://sun</uri>\n</include>\n"
      "<model name='m'>\n<link name='l'><kinematic>1</kinematic></link></model></world>",
      {"w.world:6: <link> 'l'", "kinematic"});
}

TEST_F(SdfWorlds, FilesOfTheLibraryGoBefore) {
  folder_.write("p/w/ground_plane/model.config",
                "<model><name>g</name><sdf version='1.6'>model.sdf</sdf></model>");
  folder_.write("p/w/ground_plane/model.sdf",
                "<sdf version='1.6'><model name='g'><static>1</static><link name='l'><collision "
                "name='own'><geometry>"
                "<plane><normal>0 0 1</normal></plane></geometry><surface><friction><ode>" +
                    mu("100", "50") +
                    "</ode></friction></surface></collision></link></model></sdf>");
  folder_.write("p/w/sun/model.config",
                "<model><name>s</name><sdf version='1.6'>model.sdf</sdf></model>");
  folder_.write("p/w/sun/model.sdf",
                "<sdf version='1.6'><light name='sun' type='directional'/></sdf>");
  const Scene s = world(
      "<world name='w'><include><uri>model://ground_plane</uri></include><include>"
      "<uri>model://sun</uri></include>" +
      ball("b") + "</world>");
  EXPECT_EQ(geometry(s, "g/l/own").shape.type, ShapeType::kPlane);
  ASSERT_EQ(s.model.pair_materials().size(), 1u);
  EXPECT_EQ(s.model.pair_materials()[0].material.friction, 1.0);  // min(100, 1) and min(50, 1)
}

TEST_F(SdfWorlds, OtherModelsAreNotInvented) {
  expect_refused(
      "<world name='w'>\n<include><uri>model://table</uri></include>"
      "<include><uri>https://fuel.gazebosim.org/1.0/OpenRobotics/models/Table</uri></include></"
      "world>",
      {"w.world:3: <include>: model 'model://table'", "--package table=FOLDER", "is not fetched"});
}

TEST_F(SdfWorlds, FrictionInTwoDirectionsMattersWhereAPairFeelsIt) {
  const auto friction = [&](const std::string& a, const std::string& b) {
    const Scene s = world("<world name='w'>" + ball("a", a) + ball("b", b) + "</world>");
    return s.model.pair_material(0, 1).friction;
  };
  EXPECT_EQ(friction(mu("1", "0.5"), mu("0.4", "0.4")), 0.4);
  EXPECT_EQ(friction(mu("1", "0.5"), mu("0.5", "2")), 0.5);
  EXPECT_EQ(friction(mu("100", "50"), mu("1e5", "1e5")), 50.0);  // nothing slides with either
  const std::string wheel =
      "<world name='w'>" + ball("a", mu("1", "0.5")) + ball("b", mu("2", "2")) + "</world>";
  expect_refused(wheel, {"w.world:2: <collision> 'c'", "mu = 1 and mu2 = 0.5",
                         "models: [{sdf: w.world, leave_out: [friction_directions]}]"});
  // A scene may place a single model on any ground.
  expect_refused(ball("a", mu("1", "0.5")), {"leave_out: [friction_directions]"});
  folder_.write("p/w/w.world", "<sdf version='1.6'>" + wheel + "</sdf>");
  const Scene left = load_scene(
      folder_.write("p/w/s.yaml", "models: [{sdf: w.world, leave_out: [friction_directions]}]"));
  EXPECT_EQ(left.model.pair_material(0, 1).friction, 0.5);
  EXPECT_TRUE(noted(left, "left out"));
}

// Each coefficient is the smaller one; the axis is that of the surface with the smaller mu.
TEST_F(SdfWorlds, Fdir1IsTheDirectionOfMu) {
  const std::string x = "<fdir1>2 0 0</fdir1>", y = "<fdir1>0 1 0</fdir1>";
  const auto pair = [&](const std::string& a, const std::string& b) {
    const Scene s = world("<world name='w'>" + ball("a", a) + ball("b", b) + "</world>");
    return s.model.pair_material(0, 1);
  };
  const Material one = pair(mu("1", "0.5") + x, mu("0.8", "0.8"));
  EXPECT_EQ(one.friction, 0.8);
  EXPECT_EQ(one.friction_across, 0.5);
  EXPECT_EQ(one.friction_axis, Vector3(2, 0, 0));
  EXPECT_FALSE(one.axis_of_second);
  const Material both = pair(mu("1", "0.5") + x, mu("0.3", "0.9") + y);
  EXPECT_EQ(both.friction, 0.3);
  EXPECT_EQ(both.friction_across, 0.5);
  EXPECT_EQ(both.friction_axis, Vector3(0, 1, 0));
  EXPECT_TRUE(both.axis_of_second);
}

TEST_F(SdfWorlds, EveryFaultIsNamedWithItsWayOn) {
  const std::string several =
      "<world name='w'><wind><linear_velocity>1 0 0</linear_velocity></wind>\n" +
      ball("a", "<slip1>0.1</slip1>", "<velocity_decay><linear>0.01</linear></velocity_decay>\n") +
      "\n<model name='r'><enable_wind>1</enable_wind><link name='p'/><link name='q'/>"
      "<joint name='j' type='revolute'><parent>p</parent><child>q</child><axis><xyz>0 0 "
      "1</xyz></axis>"
      "<physics><ode><velocity>1</velocity><max_force>5</max_force></ode></physics></joint>\n"
      "<joint name='k' type='screw'><parent>p</parent><child>q</child><axis><xyz>0 0 "
      "1</xyz></axis></joint></model></world>";
  expect_refused(several, {"leave_out: [slip]", "velocity_decay", "leave_out: [fluid]",
                           "enable_wind", "leave_out: [actuators]", "type 'screw'"});
}

}  // namespace
}  // namespace counterpoint::sdf_worlds_test
