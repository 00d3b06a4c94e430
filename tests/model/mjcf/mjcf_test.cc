// MJCF files: the same model from URDF and MJCF, classes, orientations, joints, inertia of known
// solids.
#include <gtest/gtest.h>

#include <cmath>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/model.h"
#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"
#include "counterpoint/model/spatial.h"
#include "support/mass_matrix.h"
#include "support/shapes/find_geometry.h"
#include "support/temp_folder.h"

namespace counterpoint::mjcf_test {
namespace {

using test::mass_matrix;

constexpr double kRoundOff = 1e-14;  // round-off of a few operations on numbers near one
constexpr double kPi = 3.14159265358979323846;

class MjcfTest : public testing::Test {
 protected:
  MjcfModel read(const std::string& contents) {
    return load_mjcf(folder_.write("m.xml", "<mujoco>" + contents + "</mujoco>"));
  }
  Scene scene(const std::string& contents) {
    return load_scene(folder_.write("m.xml", "<mujoco>" + contents + "</mujoco>"));
  }
  static Pose frame(const Scene& s, const std::string& name) {
    const Frame& f = s.model.frames()[s.model.find_frame(name)];
    return body_poses(s.model, s.q)[f.body] * f.X_BF;
  }
  static const LinkSpec& link(const MjcfModel& m, const std::string& name) {
    for (const LinkSpec& l : m.robot.links)
      if (l.name == name) return l;
    throw std::out_of_range(name);
  }
  test::TempFolder folder_;
};

TEST_F(MjcfTest, IsTheModelOfTheSameUrdf) {
  const Scene urdf = load_scene(folder_.write("r.urdf", R"(<robot name='r'>
    <link name='base'/>
    <link name='upper'><inertial><origin xyz='0 0.1 0.3' rpy='0.2 0.3 0.4'/><mass value='2'/>
      <inertia ixx='0.2' ixy='0' ixz='0' iyy='0.3' iyz='0' izz='0.25'/></inertial></link>
    <link name='lower'><inertial><origin xyz='0.1 0 0.2'/><mass value='1'/>
      <inertia ixx='0.1' ixy='0.01' ixz='0.02' iyy='0.12' iyz='0.03' izz='0.11'/></inertial></link>
    <joint name='shoulder' type='revolute'><parent link='base'/><child link='upper'/>
      <origin xyz='0 0 1' rpy='0.1 -0.2 0.3'/><axis xyz='0 1 1'/>
      <limit lower='-1' upper='2' effort='1' velocity='1'/><dynamics damping='0.5'/></joint>
    <joint name='slide' type='prismatic'><parent link='upper'/><child link='lower'/>
      <origin xyz='0 0 0.5'/><axis xyz='1 0 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>
    </robot>)"));
  // Roll, pitch, yaw about fixed axes correspond to eulerseq XYZ in MJCF.
  const Scene mjcf = scene(R"(<compiler angle='radian' eulerseq='XYZ'/><worldbody>
    <body name='base'>
      <body name='upper' pos='0 0 1' euler='0.1 -0.2 0.3'>
        <joint name='shoulder' axis='0 1 1' range='-1 2' damping='0.5'/>
        <inertial pos='0 0.1 0.3' euler='0.2 0.3 0.4' mass='2' diaginertia='0.2 0.3 0.25'/>
        <body name='lower' pos='0 0 0.5'>
          <joint name='slide' type='slide' axis='1 0 0' range='-1 1'/>
          <inertial pos='0.1 0 0.2' mass='1' fullinertia='0.1 0.12 0.11 0.01 0.02 0.03'/>
        </body>
      </body>
    </body></worldbody>)");
  ASSERT_EQ(mjcf.model.nv(), 2);
  for (const double angle : {-0.9, 0.0, 0.4, 1.9}) {
    const VectorX q = (VectorX(2) << angle, 0.5 - angle / 4.0).finished();
    EXPECT_LT((mass_matrix(urdf.model, q) - mass_matrix(mjcf.model, q)).cwiseAbs().maxCoeff(),
              kRoundOff);
    const auto X = body_poses(urdf.model, q), Y = body_poses(mjcf.model, q);
    for (size_t i = 0; i < X.size(); ++i) {
      EXPECT_LT((X[i].translation - Y[i].translation).norm(), kRoundOff);
      EXPECT_LT((X[i].rotation - Y[i].rotation).norm(), kRoundOff);
    }
  }
  EXPECT_EQ(mjcf.model.damping(), urdf.model.damping());
  EXPECT_EQ(mjcf.model.joint(0).lower, -1.0);
  EXPECT_EQ(mjcf.model.joint(0).upper, 2.0);
}

TEST_F(MjcfTest, ClassesNestAndTheNearestChildclassCounts) {
  const MjcfModel m = read(R"(<default><joint damping='1' armature='2'/>
      <default class='a'><joint damping='3'/><default class='b'><joint frictionloss='4'/></default></default>
    </default><worldbody><body name='l1'><joint name='none'/><geom size='1'/>
      <body name='l2' childclass='b'><joint name='by_child'/><geom size='1'/>
        <body name='l3'><joint name='own' class='a'/><geom size='1'/>
          <body name='l4'><joint name='given' damping='7'/><geom size='1'/></body></body></body></body></worldbody>)");
  const auto expect = [&](const char* name, double damping, double armature, double friction) {
    for (const JointSpec& joint : m.robot.joints) {
      if (joint.name != name) continue;
      EXPECT_EQ(joint.damping, damping) << name;
      EXPECT_EQ(joint.armature, armature) << name;
      EXPECT_EQ(joint.dry_friction, friction) << name;
      return;
    }
    ADD_FAILURE() << name;
  };
  expect("none", 1, 2, 0);
  expect("by_child", 3, 2, 4);
  expect("own", 3, 2, 0);
  expect("given", 7, 2, 4);
}

TEST_F(MjcfTest, OrientationsAreOneInEveryNotation) {
  // A quarter turn about z maps x to y.
  const Matrix3 expected = Eigen::AngleAxisd(kPi / 2, Vector3::UnitZ()).toRotationMatrix();
  for (const char* notation :
       {"quat='2 0 0 2'", "axisangle='0 0 3 90'", "euler='0 0 90'", "xyaxes='0 5 0 -1 4 0'"}) {
    const Scene s = scene(std::string("<worldbody><body name='b' ") + notation + "/></worldbody>");
    EXPECT_LT((frame(s, "b").rotation - expected).norm(), kRoundOff) << notation;
  }
  const Scene z = scene("<worldbody><body name='b' zaxis='3 0 0'/></worldbody>");
  EXPECT_LT((frame(z, "b").rotation.col(2) - Vector3::UnitX()).norm(), kRoundOff);
  EXPECT_LT((frame(z, "b").rotation.col(1) - Vector3::UnitY()).norm(),
            kRoundOff);  // shortest rotation
}

TEST_F(MjcfTest, EulerAnglesTurnWithTheBodyOrWithItsParent) {
  const auto about = [](int axis, double angle) {
    return Eigen::AngleAxisd(angle, Vector3(Vector3::Unit(axis))).toRotationMatrix();
  };
  const auto rotation = [&](const char* sequence) {
    return frame(scene(std::string("<compiler angle='radian' eulerseq='") + sequence +
                       "'/><worldbody><body name='b' euler='0.1 0.2 0.3'/></worldbody>"),
                 "b")
        .rotation;
  };
  EXPECT_LT((rotation("xyz") - about(0, 0.1) * about(1, 0.2) * about(2, 0.3)).norm(), kRoundOff);
  EXPECT_LT((rotation("ZYX") - about(0, 0.3) * about(1, 0.2) * about(2, 0.1)).norm(), kRoundOff);
}

TEST_F(MjcfTest, JointsOfOneBodyTurnItOneAfterTheOther) {
  Scene s = scene(R"(<worldbody><body name='b' pos='1 0 0'>
    <joint name='turn' axis='0 0 1' pos='0 1 0'/><joint name='slide' type='slide' axis='1 0 0'/>
    <geom name='g' size='0.1'/></body></worldbody>)");
  ASSERT_EQ(s.model.nv(), 2);
  s.q << kPi / 2, 0.5;
  // The body's origin rotates about (1, 1) from (1, 0) to (2, 1), then slides along its x axis,
  // which points along y.
  const Pose X = frame(s, "b");
  EXPECT_LT((X.translation - Vector3(2, 1.5, 0)).norm(), kRoundOff);
  EXPECT_LT((X.rotation.col(0) - Vector3::UnitY()).norm(), kRoundOff);
}

TEST_F(MjcfTest, ReferenceIsTheCoordinateOfThePoseInTheFile) {
  Scene s =
      scene(R"(<worldbody><body name='b' pos='1 2 3'><joint type='slide' ref='0.25' axis='0 0 2'/>
    <joint axis='0 0 1' ref='30'/><geom size='0.1'/></body></worldbody>)");
  EXPECT_NEAR(s.q[0], 0.25, kRoundOff);
  EXPECT_NEAR(s.q[1], kPi / 6, kRoundOff);
  EXPECT_LT((frame(s, "b").translation - Vector3(1, 2, 3)).norm(), kRoundOff);
  EXPECT_LT((frame(s, "b").rotation - Matrix3::Identity()).norm(), kRoundOff);
  s.q << 1.25, 0.0;
  EXPECT_LT((frame(s, "b").translation - Vector3(1, 2, 4)).norm(), kRoundOff);
  EXPECT_LT(
      (frame(s, "b").rotation - Eigen::AngleAxisd(-kPi / 6, Vector3::UnitZ()).toRotationMatrix())
          .norm(),
      kRoundOff);
}

TEST_F(MjcfTest, InertiaFromGeomsIsThatOfTheSolids) {
  const MjcfModel m = read(R"(<worldbody><body name='b'><joint/>
    <geom type='box' size='0.1 0.2 0.3' pos='1 0 0' density='100'/>
    <geom type='sphere' size='0.1' pos='-1 0 0' mass='4.8'/></body>
    <body name='e'><joint/><geom type='ellipsoid' size='1 2 3' mass='5'/></body>
    <body name='c'><joint/><geom type='cylinder' fromto='0 0 0 2 0 0' size='0.5' density='10'/></body></worldbody>)");
  const SpatialInertia& b = link(m, "b").inertia;  // 4.8 kg on either side
  EXPECT_NEAR(b.mass, 9.6, kRoundOff);
  EXPECT_LT(b.center.norm(), kRoundOff);
  const double ball = 0.4 * 4.8 * 0.01;
  const Vector3 moments(4.8 / 3 * (0.04 + 0.09) + ball, 4.8 / 3 * (0.01 + 0.09) + ball + 9.6,
                        4.8 / 3 * (0.01 + 0.04) + ball + 9.6);
  EXPECT_LT((b.rotational - Matrix3(moments.asDiagonal())).norm(), 1e-13);
  EXPECT_LT((link(m, "e").inertia.rotational - Matrix3(Vector3(13, 10, 5).asDiagonal())).norm(),
            1e-13);
  const SpatialInertia& c = link(m, "c").inertia;
  EXPECT_NEAR(c.mass, 10 * kPi * 0.25 * 2, 1e-13);
  EXPECT_LT((c.center - Vector3(1, 0, 0)).norm(), kRoundOff);
  EXPECT_NEAR(c.rotational(0, 0), c.mass * 0.125, 1e-13);
}

TEST_F(MjcfTest, MeshesWeighWhatTheyEnclose) {
  // A box of 2 x 4 x 6 as a mesh, displaced and scaled, has the inertia of the primitive.
  const char* const box =
      "vertex='-1 -2 -3 1 -2 -3 -1 2 -3 1 2 -3 -1 -2 3 1 -2 3 -1 2 3 1 2 3' "
      "face='0 2 3 0 3 1 4 5 7 4 7 6 0 1 5 0 5 4 2 6 7 2 7 3 0 4 6 0 6 2 1 3 7 1 7 5'";
  for (const char* kind : {"legacy", "exact", "convex"}) {
    const MjcfModel m =
        read(std::string("<asset><mesh name='m' scale='0.5 0.5 0.5' refpos='1 0 0' inertia='") +
             kind + "' " + box + R"(/></asset><worldbody>
      <body name='b'><joint/><geom type='mesh' mesh='m' density='100'/></body>
      <body name='p'><joint/><geom type='box' size='0.5 1 1.5' pos='-0.5 0 0' density='100'/></body></worldbody>)");
    const SpatialInertia &a = link(m, "b").inertia, &b = link(m, "p").inertia;
    EXPECT_NEAR(a.mass, b.mass, 1e-11) << kind;
    EXPECT_LT((a.center - b.center).norm(), kRoundOff) << kind;
    EXPECT_LT((a.rotational - b.rotational).norm(), 1e-11) << kind;
  }
}

TEST_F(MjcfTest, MshFilesHoldTheSameMesh) {
  std::string bytes;
  const auto put = [&](auto value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const std::int32_t count : {4, 1, 1, 4}) put(count);
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 2.f, 0.f, 0.f, 0.f, 3.f}) put(x);
  for (int i = 0; i < 5; ++i) put(7.f);  // a normal and a texture coordinate
  for (const std::int32_t i : {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}) put(i);
  const auto inertia = [&] {
    folder_.write("m.msh", bytes);
    return link(read(R"(<asset><mesh file='m.msh'/></asset><worldbody>
      <body name='b'><joint/><geom type='mesh' mesh='m'/></body></worldbody>)"),
                "b")
        .inertia;
  };
  EXPECT_NEAR(inertia().mass, 1000.0, 1e-11);
  EXPECT_LT((inertia().center - Vector3(0.25, 0.5, 0.75)).norm(), kRoundOff);
  bytes.back() = 1;  // vertex index of 2^24 or more
  EXPECT_THROW(inertia(), InputError);
  bytes.pop_back();
  EXPECT_THROW(inertia(), InputError);
}

TEST_F(MjcfTest, HeightFieldsHaveTheirLastRowInFront) {
  // Rows are ordered as in an image: the first has the largest y.
  const Scene s = scene(
      R"(<asset><hfield name='h' nrow='2' ncol='2' elevation='3 3 1 1' size='1 2 0.5 0.1'/></asset>
    <worldbody><geom type='hfield' hfield='h'/></worldbody>)");
  ASSERT_EQ(s.model.geometries()[0].shape.type, ShapeType::kTerrain);
  for (const Vector3& v : s.model.geometries()[0].shape.terrain->vertices)
    EXPECT_EQ(v.z(), v.y() > 0.0 ? 0.5 : 0.0);
}

TEST_F(MjcfTest, PrimitivesAreFittedToMeshes) {
  // The box fitted to a box mesh of 2 x 4 x 6 is the box itself; its longest axis is z.
  const MjcfModel m =
      read(R"(<asset><mesh name='m' inertia='exact' vertex='-1 -2 -3 1 -2 -3 -1 2 -3 1 2 -3 -1 -2 3
      1 -2 3 -1 2 3 1 2 3' face='0 2 3 0 3 1 4 5 7 4 7 6 0 1 5 0 5 4 2 6 7 2 7 3 0 4 6 0 6 2 1 3 7 1 7 5'/></asset>
    <worldbody><body name='b'><joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>
      <geom type='box' mesh='m'/><geom type='capsule' mesh='m'/></body></worldbody>)");
  const auto& shapes = link(m, "b").collisions;
  ASSERT_EQ(shapes.size(), 2u);
  EXPECT_LT((shapes[0].shape.size - Vector3(1, 2, 3)).norm(), 1e-13);
  EXPECT_NEAR(std::abs(shapes[0].X_LG.rotation(2, 2)), 1.0, kRoundOff);
  EXPECT_NEAR(shapes[1].shape.size[0], 1.5, 1e-13);
  EXPECT_NEAR(shapes[1].shape.size[1], 3 - 0.75, 1e-13);
}

TEST_F(MjcfTest, CompilerChangesInertias) {
  const char* const body = R"(<worldbody><body name='b'><joint/>
    <inertial pos='0 0 0' mass='1' diaginertia='1 1 4'/>
    <geom size='0.1' density='1000' group='%'/></body></worldbody>)";
  const auto inertia = [&](const std::string& compiler, const char* group = "0") {
    std::string text = body;
    text.replace(text.find('%'), 1, group);
    return link(read("<compiler " + compiler + "/>" + text), "b").inertia;
  };
  const double ball = 4.0 / 3 * kPi;
  EXPECT_NEAR(inertia("inertiafromgeom='true'").mass, ball, kRoundOff);
  EXPECT_EQ(inertia("inertiafromgeom='true' inertiagrouprange='1 3'").mass, 0.0);
  EXPECT_NEAR(inertia("inertiafromgeom='true' inertiagrouprange='1 3'", "2").mass, ball, kRoundOff);
  EXPECT_LT((inertia("balanceinertia='true'").rotational - 2 * Matrix3::Identity()).norm(),
            kRoundOff);
  EXPECT_EQ(inertia("boundmass='3'").mass, 3.0);
  EXPECT_LT(
      (inertia("boundinertia='2'").rotational - Matrix3(Vector3(2, 2, 4).asDiagonal())).norm(),
      kRoundOff);
  const SpatialInertia scaled = inertia("settotalmass='3'");
  EXPECT_NEAR(scaled.mass, 3.0, kRoundOff);
  EXPECT_NEAR(scaled.rotational(2, 2), 12.0, 1e-13);
}

TEST_F(MjcfTest, FreeBodiesStartWhereTheyStandOrWhereTheKeyframeSays) {
  const std::string body =
      R"(<worldbody><body name='b' pos='1 2 3' quat='0 1 0 0'><freejoint/><geom size='1'/></body>
    <body name='s'><joint name='j'/><geom size='1'/></body></worldbody>)";
  const Scene at_rest = scene(body);
  EXPECT_EQ(at_rest.q, (VectorX(8) << 1, 2, 3, 0, 1, 0, 0, 0).finished());
  const Scene key = scene(
      body +
      R"(<keyframe><key name='k' qpos='4 5 6 0 0 2 0 0.5' qvel='1 2 3 4 5 6 7'/></keyframe>)");
  EXPECT_EQ(key.q, (VectorX(8) << 4, 5, 6, 0, 0, 1, 0, 0.5).finished());
  EXPECT_EQ(key.v, (VectorX(7) << 1, 2, 3, 4, 5, 6, 7).finished());
}

TEST_F(MjcfTest, IncludedFilesStandInTheirPlaces) {
  folder_.write(
      "inner.xml",
      "<mujocoinclude><body name='b'><joint name='j'/><geom size='1'/></body></mujocoinclude>");
  const MjcfModel m = read("<worldbody><include file='inner.xml'/></worldbody>");
  ASSERT_EQ(m.coordinates.size(), 1u);
  EXPECT_EQ(m.coordinates[0].joint, "j");
}

TEST_F(MjcfTest, ScenesPlaceThem) {
  folder_.write("m.mjcf",
                R"(<mujoco model='arm'><worldbody><geom name='floor' type='plane' size='0 0 1'/>
    <body name='b' pos='1 0 0'><joint name='j'/><geom size='0.1'/></body></worldbody>
    <keyframe><key name='first' qpos='0.1'/><key name='second' qpos='0.2'/></keyframe></mujoco>)");
  const Scene s = load_scene(folder_.write("s.yaml", R"(models:
  - {mjcf: m.mjcf, position: [0, 0, 2]}
  - {mjcf: m.mjcf, name: other, keyframe: second}
  - {mjcf: m.mjcf, name: third, keyframe: none}
)"));
  EXPECT_EQ(s.q, (VectorX(3) << 0.1, 0.2, 0.0).finished());
  EXPECT_LT((frame(s, "arm/b").translation - Vector3(1, 0, 2)).norm(), kRoundOff);
  EXPECT_GE(test::find_geometry(s.model, "arm/world/floor"), 0);
}

}  // namespace
}  // namespace counterpoint::mjcf_test
