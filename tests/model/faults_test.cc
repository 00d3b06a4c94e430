// Files with several faults: all are reported together, with their places, in plain words.
#include <gtest/gtest.h>

#include <algorithm>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"
#include "counterpoint/model/text_files.h"
#include "support/temp_folder.h"

namespace counterpoint::faults_test {
namespace {

class FaultsTest : public testing::Test {
 protected:
  std::string refusal(const std::string& name, const std::string& contents) const {
    try {
      load_scene(folder_.write(name, contents));
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  void expect(const std::string& name, const std::string& contents,
              std::initializer_list<std::string> words) const {
    const std::string why = refusal(name, contents);
    for (const std::string& word : words)
      EXPECT_NE(why.find(word), std::string::npos) << why << "\n  does not name: " << word;
    EXPECT_EQ(std::count(why.begin(), why.end(), '\n') + 1, static_cast<long>(words.size())) << why;
  }
  test::TempFolder folder_;
};

TEST_F(FaultsTest, OfAUrdf) {
  expect("p/r/r.urdf", R"(<robot name='r'>
<link name='a'><collision><geometry><mesh filename='none.obj'/></geometry></collision></link>
<link name='b'><inertial><mass value='-1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>
<link name='c'/>
<joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 0 0'/>
<limit lower='0' upper='1' effort='1' velocity='1'/></joint>
<joint name='k' type='revolute'><parent link='b'/><child link='c'/><limit lower='2' upper='1' effort='1' velocity='1'/>
<mimic joint='z'/></joint></robot>)",
         {"r.urdf:2: link 'a', collision 0: mesh 'none.obj'", "r.urdf:3: link 'b': mass is -1 kg",
          "r.urdf:5: joint 'j': the axis is zero", "r.urdf:7: joint 'k': lower limit 2",
          "mimics joint 'z'"});
}

TEST_F(FaultsTest, OfUrdfElements) {
  expect("r.urdf", R"(<robot name='r'>
<link name='a'/>
<link name='a'/>
<link/>
<joint name='j' type='revolute'><parent link='a'/><child link='b'/></joint></robot>)",
         {"r.urdf:3: link 'a' is there twice", "r.urdf:4: a <link> needs a name",
          "r.urdf:5: joint 'j'"});
}

TEST_F(FaultsTest, OfAnMjcfFile) {
  expect("p/m/m.xml", R"(<mujoco>
<worldbody><body name='a'><joint name='j' type='ball' stiffness='2'/><geom size='0.1'/>
<body name='b'><joint name='k'/><geom size='0.1'/></body></body></worldbody>
<tendon><spatial name='t' stiffness='3'/></tendon>
<actuator><general joint='k' dyntype='user' biastype='affine'/>
<position joint='none'/></actuator>
<contact><exclude body1='a' body2='z'/></contact></mujoco>)",
         {"m.xml:2: <joint> 'j': stiffness", "m.xml:4: <spatial> 't'", "m.xml:5: <general>",
          "m.xml:6: <position>: there is no joint 'none'",
          "m.xml:7: <exclude>: there is no body 'z'"});
}

TEST_F(FaultsTest, OfMjcfBodies) {
  expect("p/m/m.xml", R"(<mujoco><worldbody><body name='a'>
<joint axis='0 0 0'/><geom size='0.1' unheard='1'/>
<composite type='rope'/></body>
<joint/></worldbody></mujoco>)",
         {"m.xml:2: <joint>: axis", "unheard", "m.xml:3: <composite>",
          "m.xml:4: <joint>: the world cannot move"});
}

TEST_F(FaultsTest, OfAScene) {
  expect("s.yaml", R"(time_step: -1
integrator: euler
models:
  - {name: a, box: [1, 1], mass: 1}
  - {name: b, box: [1, 1, 1], mass: 0}
ground: {friction: slippery}
)",
         {"s.yaml:1: time_step", "s.yaml:2: integrator", "s.yaml:4:", "s.yaml:5:", "s.yaml:6:"});
  expect("s.yaml", "gravitation: 1\ntimestep: 2\n", {"s.yaml:1", "s.yaml:2"});
}

TEST(Faults, AreBounded) {
  Faults faults;
  for (int i = 0; i < 25; ++i) faults.add("fault " + std::to_string(i));
  faults.add("fault 3");
  try {
    faults.throw_if_any();
    FAIL();
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("fault 19\nand 5 more faults"), std::string::npos) << what;
  }
  EXPECT_NO_THROW(Faults().throw_if_any());
}

TEST_F(FaultsTest, XmlThatIsNotWellFormed) {
  for (const auto& [contents, words] :
       {std::pair("<mujoco>\n<a>text", "m.xml:2: not well-formed XML: text outside"),
        std::pair("<mujoco/>junk", "m.xml:1: not well-formed XML: text outside"),
        std::pair("<mujoco>\n<a>\n</mujoco>", "m.xml:2: not well-formed XML: <a>: the element"),
        std::pair("<mujoco>\n<a b=1/></mujoco>", "m.xml:2: not well-formed XML: <a>: an attribute"),
        std::pair("<mujoco>\n<!-- x", "m.xml:2: not well-formed XML: a comment")}) {
    const std::string why = refusal("m.xml", contents);
    EXPECT_NE(why.find(words), std::string::npos) << why;
    EXPECT_EQ(why.find("XML_ERROR"), std::string::npos) << why;
    EXPECT_EQ(why.find("ErrorID"), std::string::npos) << why;
  }
}

}  // namespace
}  // namespace counterpoint::faults_test
