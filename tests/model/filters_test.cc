// Pairs excluded from collision: groups and exclusions of the scene file, SRDF files.
#include <gtest/gtest.h>

#include "counterpoint/model/scene.h"
#include "counterpoint/model/urdf/srdf.h"
#include "support/temp_folder.h"

namespace counterpoint::filters_test {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

Pairs excluded(const Model& model) {
  Pairs pairs;
  for (const auto& [a, b] : model.excluded_geometry_pairs()) {
    pairs.emplace_back(model.geometries()[a].name, model.geometries()[b].name);
  }
  return pairs;
}

// Links a, b, c in a row; b has two geometries.
const char* const kUrdf = R"(<robot name="r">
<link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><sphere radius="0.1"/></geometry></collision>
<collision><geometry><sphere radius="0.2"/></geometry></collision></link>
<link name="c"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<joint name="ab" type="continuous"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/></joint>
<joint name="bc" type="continuous"><parent link="b"/><child link="c"/><origin xyz="1 0 0"/></joint>
</robot>)";

class Filters : public ::testing::Test {
 protected:
  Filters() { folder.write("r.urdf", kUrdf); }
  Scene load(const std::string& text) { return load_scene(folder.write("s.yaml", text)); }
  void expect_refused(const std::string& text, const std::vector<std::string>& words) {
    try {
      load(text);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const InputError& error) {
      for (const std::string& word : words) {
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
      }
    }
  }
  test::TempFolder folder;
};

TEST_F(Filters, GroupsStandForTheirMembers) {
  const Scene scene = load(
      "models:\n- {urdf: r.urdf, name: x}\n- {name: ball, sphere: 0.1, mass: 1}\n"
      "groups: {ends: [x/a, x/c], balls: [ball/body]}\n"
      "exclude: [[ends, balls], [ends, ends], [x/b, balls]]\n");
  EXPECT_EQ(excluded(scene.model), (Pairs{{"x/a/0", "x/c/0"},
                                          {"x/a/0", "ball/body/shape"},
                                          {"x/b/0", "ball/body/shape"},
                                          {"x/b/1", "ball/body/shape"},
                                          {"x/c/0", "ball/body/shape"}}));
  EXPECT_EQ(scene.model.exclusion_reasons(),
            (std::vector<std::string>{
                "excluded by the scene: [ends, ends]", "excluded by the scene: [ends, balls]",
                "excluded by the scene: [x/b, balls]", "excluded by the scene: [x/b, balls]",
                "excluded by the scene: [ends, balls]"}));
}

TEST_F(Filters, APairHasOneReasonTheFirst) {
  folder.write("r.srdf",
               "<robot><disable_collisions link1=\"a\" link2=\"c\" reason=\"Never\"/></robot>");
  const Scene scene = load("models: [{urdf: r.urdf, srdf: r.srdf}]\nexclude: [[c, a], [a, b]]\n");
  EXPECT_EQ(excluded(scene.model), (Pairs{{"a/0", "b/0"}, {"a/0", "b/1"}, {"a/0", "c/0"}}));
  EXPECT_EQ(
      scene.model.exclusion_reasons(),
      (std::vector<std::string>{"excluded by the scene", "excluded by the scene", "SRDF: Never"}));
}

TEST_F(Filters, ALoneRobotTakesItsSrdfFromTheOptions) {
  SceneOverrides overrides;
  overrides.srdf =
      folder.write("r.srdf", "<robot><disable_collisions link1=\"a\" link2=\"c\"/></robot>");
  EXPECT_EQ(excluded(load_scene(folder.path() / "r.urdf", overrides).model),
            (Pairs{{"a/0", "c/0"}}));
  // These options conflict with a scene file, which has its own.
  const auto scene = folder.write("s.yaml", "models: [{urdf: r.urdf}]\n");
  EXPECT_THROW(load_scene(scene, overrides), InputError);
  overrides.srdf.clear();
  overrides.hull_vertices = 8;
  EXPECT_THROW(load_scene(scene, overrides), InputError);
}

TEST_F(Filters, GroupsAreChecked) {
  const std::string model = "models: [{urdf: r.urdf}]\n";
  expect_refused(model + "groups: {g: [a, nobody]}\n", {"s.yaml:2", "nobody"});
  expect_refused(model + "groups: {g: []}\n", {"s.yaml:2", "at least one"});
  expect_refused(model + "exclude: [[g, a]]\n", {"s.yaml:2", "'g'"});
}

TEST_F(Filters, SrdfDisablesPairsOfItsRobot) {
  folder.write("r.srdf",
               "<robot name=\"r\"><group name=\"g\"><link name=\"a\"/></group>\n"
               "<disable_collisions link1=\"a\" link2=\"c\" reason=\"Never\"/>\n"
               "<disable_default_collisions link=\"b\"/></robot>");
  const Scene scene =
      load("models:\n- {urdf: r.urdf, name: x, srdf: r.srdf, count: 2, spacing: [0, 5, 0]}\n");
  EXPECT_EQ(excluded(scene.model), (Pairs{{"x0/a/0", "x0/c/0"}, {"x1/a/0", "x1/c/0"}}));
  ASSERT_EQ(scene.model.notes().size(), 1u);
  EXPECT_NE(scene.model.notes()[0].where.find("r.srdf:3"), std::string::npos);
}

TEST_F(Filters, SrdfIsChecked) {
  const auto with = [&](const std::string& srdf) {
    folder.write("r.srdf", srdf);
    return std::string("models: [{urdf: r.urdf, srdf: r.srdf}]\n");
  };
  expect_refused(with("<robot><disable_collisions link1=\"a\" link2=\"z\"/></robot>"),
                 {"r.srdf:1", "'z'"});
  expect_refused(with("<robot>\n<disable_collisions link1=\"a\"/></robot>"), {"r.srdf:2", "link2"});
  expect_refused(with("<sdf/>"), {"r.srdf", "<robot>"});
  expect_refused(with("<robot>"), {"r.srdf", "well-formed"});
  expect_refused(with(""), {"r.srdf"});
  expect_refused("models: [{urdf: r.urdf, srdf: missing.srdf}]\n", {"missing.srdf", "no such"});
  expect_refused("models: [{sphere: 1, mass: 1, srdf: r.srdf}]\n", {"s.yaml:1", "urdf"});
}

}  // namespace
}  // namespace counterpoint::filters_test
