// An exported model, when read back, has the same names, mass matrices, poses and start.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "counterpoint/model/robot_files.h"
#include "support/mass_matrix.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::export_test {
namespace {

using test::mass_matrix;
using test::random_configuration;

/// Frames are rotated and inertias converted to principal axes and back: some round-offs of numbers
/// near one.
constexpr double kRoundOff = 1e-12;

struct Exportable {
  const char* file;
  Base base = Base::kFixed;  ///< base of a single URDF
};

class ExportTest : public testing::TestWithParam<Exportable> {
 protected:
  static Scene bundled(const std::string& name, const SceneOverrides& overrides = {}) {
    return load_scene(test::source_dir() + "/data/" + name, overrides);
  }
  static void expect_same_motion(const Model& a, const Model& b) {
    ASSERT_EQ(a.nq(), b.nq());
    ASSERT_EQ(a.nv(), b.nv());
    std::mt19937 random(1);
    for (int sample = 0; sample < 10; ++sample) {
      const VectorX q = random_configuration(a, random);
      const MatrixX M = mass_matrix(a, q);
      EXPECT_LE((M - mass_matrix(b, q)).norm(), kRoundOff * M.norm());
      const std::vector<Pose> X_a = body_poses(a, q), X_b = body_poses(b, q);
      for (const Frame& frame : a.frames()) {
        const int other = b.find_frame(frame.name);
        if (other < 0) continue;  // sites of MJCF are skipped
        const Frame& same = b.frames()[other];
        const Pose A = X_a[frame.body] * frame.X_BF, B = X_b[same.body] * same.X_BF;
        EXPECT_LE((A.translation - B.translation).norm(), kRoundOff * (1.0 + A.translation.norm()))
            << frame.name;
      }
    }
    EXPECT_LE((a.armature() - b.armature()).norm(), kRoundOff);
    EXPECT_LE((a.damping() - b.damping()).norm(), kRoundOff);
    EXPECT_LE((a.dry_friction() - b.dry_friction()).norm(), kRoundOff);
    for (int i = 0; i < a.num_joints(); ++i) {
      EXPECT_EQ(a.joint(i).name, b.joint(i).name);
      EXPECT_EQ(a.joint(i).link, b.joint(i).link);
    }
    ASSERT_EQ(a.mimics().size(), b.mimics().size());
  }
  test::TempFolder folder_;
};

using ExportedMjcf = ExportTest;
using ExportedUrdf = ExportTest;

TEST_P(ExportedMjcf, ReadBackIsTheSameModel) {
  const Scene scene = bundled(GetParam().file);
  const Scene back = load_scene(folder_.write("m.xml", export_mjcf(scene).text));
  expect_same_motion(scene.model, back.model);
  EXPECT_EQ(scene.options.time_step, back.options.time_step);
  EXPECT_EQ(scene.model.gravity(), back.model.gravity());
  EXPECT_LE((scene.q - back.q).norm(), kRoundOff * (1.0 + scene.q.norm()));
  EXPECT_LE((scene.v - back.v).norm(), kRoundOff * (1.0 + scene.v.norm()));
  EXPECT_EQ(scene.model.geometries().size(), back.model.geometries().size());
}

INSTANTIATE_TEST_SUITE_P(Scenes, ExportedMjcf,
                         testing::Values(Exportable{"scenes/humanoid_drop.yaml"},
                                         Exportable{"scenes/quadruped_drop.yaml"},
                                         Exportable{"scenes/box_stack.yaml"},
                                         Exportable{"scenes/arm7_servo.yaml"},
                                         Exportable{"scenes/coin_spin.yaml"},
                                         Exportable{"scenes/double_pendulum.yaml"}));

TEST_P(ExportedUrdf, ReadBackIsTheSameModel) {
  SceneOverrides overrides;
  overrides.base = GetParam().base;
  const Scene scene = bundled(GetParam().file, overrides);
  const Exported out = export_urdf(scene);
  for (const ExportedFile& file : out.files) folder_.write(file.name, file.text);
  const Scene back = load_scene(folder_.write("m.urdf", out.text), overrides);
  expect_same_motion(scene.model, back.model);
  for (const Frame& frame : scene.model.frames())
    EXPECT_GE(back.model.find_frame(frame.name), 0) << frame.name;
  std::size_t moving = 0;  // geometries of the world are not in the file
  for (const Geometry& g : scene.model.geometries()) moving += g.body > 0;
  EXPECT_EQ(back.model.geometries().size(), moving);
}

INSTANTIATE_TEST_SUITE_P(Robots, ExportedUrdf,
                         testing::Values(Exportable{"robots/humanoid.urdf", Base::kFloating},
                                         Exportable{"robots/humanoid.urdf"},
                                         Exportable{"robots/quadruped.urdf", Base::kFloating},
                                         Exportable{"robots/arm7.urdf"},
                                         Exportable{"robots/ur10.urdf"},
                                         Exportable{"robots/arm_hand.urdf", Base::kFloating},
                                         Exportable{"robots/planar_ellipse.urdf"}));

/// Converts URDF to model, MJCF, model, and back to URDF.
TEST_F(ExportTest, FormatsFollowOneAnother) {
  SceneOverrides overrides;
  overrides.base = Base::kFloating;
  const Scene first = bundled("robots/humanoid.urdf", overrides);
  const Scene second = load_scene(folder_.write("m.xml", export_mjcf(first).text));
  const Scene third = load_scene(folder_.write("m.urdf", export_urdf(second).text), overrides);
  expect_same_motion(first.model, third.model);
}

TEST_F(ExportTest, PairsThatTouchInAnyCaseAreWritten) {
  const Scene scene =
      load_scene(folder_.write("a.xml", R"(<mujoco><worldbody><body name="a"><joint/>
    <geom name="a" size="0.1"/><body name="b" pos="0.3 0 0"><joint/><geom name="b" size="0.05"/></body></body></worldbody>
    <contact><pair geom1="a" geom2="b"/></contact></mujoco>)"));
  const std::vector<std::pair<int, int>> pair = {{0, 1}};
  EXPECT_EQ(scene.model.included_geometry_pairs(), pair);
  const Scene back = load_scene(folder_.write("b.xml", export_mjcf(scene).text));
  EXPECT_EQ(back.model.included_geometry_pairs(), pair);
  EXPECT_TRUE(back.model.excluded_geometry_pairs().empty());
}

/// Two spheres with unlike friction on one body, near the ball of another.
Scene spheres_of_two_bodies(const test::TempFolder& folder) {
  return load_scene(folder.write("c.xml", R"(<mujoco><worldbody>
    <body name="a"><freejoint/><geom name="a0" size="0.1" friction="0.9 0 0"/>
      <geom name="a1" size="0.1" pos="1 0 0" friction="0.4 0 0"/></body>
    <body name="b" pos="0 0 3"><freejoint/><geom name="b" size="0.1" friction="0.4 0 0"/></body>
    </worldbody></mujoco>)"));
}

TEST_F(ExportTest, PairsBesideOneThatIsApartAreWritten) {
  const Scene scene = spheres_of_two_bodies(folder_);
  const Scene back = load_scene(folder_.write("d.xml", export_mjcf(scene, {{{0, 2}}}).text));
  const std::vector<std::pair<int, int>> apart = {{0, 2}}, together = {{1, 2}};
  EXPECT_EQ(back.model.excluded_geometry_pairs(), apart);
  EXPECT_EQ(back.model.included_geometry_pairs(), together);
}

TEST_F(ExportTest, ChosenEffectsAndSurfacesOfPairsAreWritten) {
  const Scene scene = spheres_of_two_bodies(folder_);
  MjcfExport how;
  how.effects = EffectSet::all().without({Effect::kGravity});
  how.pair_surfaces = true;
  const Exported out = export_mjcf(scene, how);
  EXPECT_TRUE(out.lost.empty());
  const Scene back = load_scene(folder_.write("e.xml", out.text));
  EXPECT_EQ(back.model.gravity(), Vector3(0, 0, 0));
  for (const int a : {0, 1})
    EXPECT_EQ(back.model.pair_material(a, 2).friction, scene.model.pair_material(a, 2).friction);
}

// Each geometry is named whose surface neither format can hold.
TEST_F(ExportTest, SoftSurfacesAndStaticFrictionAreNamedAsLost) {
  const Scene scene = load_scene(folder_.write("s.yaml", R"(
models:
  - {name: soft, sphere: 0.1, mass: 1, stiffness: 1.0e+4}
  - {name: mat, sphere: 0.1, mass: 1, position: [1, 0, 0], stiffness_per_area: 1.0e+6}
  - {name: grip, sphere: 0.1, mass: 1, position: [2, 0, 0], friction: 0.4, static_friction: 0.6}
  - {name: skate, sphere: 0.1, mass: 1, position: [3, 0, 0], friction: [0.1, 0.9],
     friction_axis: [1, 0, 0]}
)"));
  const std::vector<Note> lost = export_mjcf(scene).lost;
  const auto names = [&](const std::string& where, const std::string& what) {
    return std::any_of(lost.begin(), lost.end(), [&](const Note& note) {
      return note.where.find(where) != std::string::npos &&
             note.message.find(what) != std::string::npos;
    });
  };
  EXPECT_TRUE(names("soft", "stiffness"));
  EXPECT_TRUE(names("mat", "stiffness"));
  EXPECT_TRUE(names("grip", "static friction"));
  EXPECT_TRUE(names("skate", "direction of its friction"));
  EXPECT_FALSE(names("grip", "stiffness"));
}

TEST_F(ExportTest, BreakawayFrictionIsNamedAsLost) {
  Scene scene = bundled("scenes/pendulum.yaml");
  ModelEditor editor(scene.model);
  editor.set_breakaway_friction(0, scene.model.dry_friction()[0] + 0.5);
  scene.model = editor.take();
  const auto lost = [](const Exported& out) {
    return std::any_of(out.lost.begin(), out.lost.end(), [](const Note& note) {
      return note.where.rfind("joint '", 0) == 0 && note.message == "breakaway_friction";
    });
  };
  EXPECT_TRUE(lost(export_mjcf(scene)));
  EXPECT_TRUE(lost(export_urdf(scene)));
  MjcfExport without;
  without.effects = EffectSet::all().without({Effect::kBreakawayFriction});
  EXPECT_FALSE(lost(export_mjcf(scene, without)));
}

TEST_F(ExportTest, HingesAreTwoPointsOfTheirAxisAndOtherClosuresAreNamedAsLost) {
  const Scene scene = bundled("scenes/workshop.yaml");
  const Exported out = export_mjcf(scene);
  for (const char* name : {"wire", "screw", "mount", "rope"}) {
    const std::string where = std::string("closure '") + name + "'";
    EXPECT_TRUE(std::any_of(out.lost.begin(), out.lost.end(), [&](const Note& note) {
      return note.where == where;
    })) << name;
  }
  const Scene back = load_scene(folder_.write("m.xml", out.text));
  ASSERT_EQ(back.model.closures().size(), 2u);
  const Closure& hinge = scene.model.closures()[0];
  const auto X = body_poses(scene.model, scene.q), X_back = body_poses(back.model, back.q);
  const Pose at = X[hinge.body_a] * hinge.X_AC;
  double side = -0.05;  // half the distance of the points [m]
  for (const Closure& ball : back.model.closures()) {
    EXPECT_EQ(ball.type, ClosureType::kBall);
    EXPECT_LT(closure_gap(ball, X_back).largest(), kRoundOff);
    const Vector3 p = (X_back[ball.body_a] * ball.X_AC).translation;
    EXPECT_LT((p - at * Vector3(0, 0, side)).norm(), kRoundOff);
    side = -side;
  }
}

TEST_F(ExportTest, SwitchedClosuresAreWrittenWhileTheyAreAttached) {
  const Scene scene = load_scene(folder_.write("c.yaml", R"(
models:
  - {name: a, box: [0.1, 0.1, 0.1], mass: 1, position: [0, 0, 1]}
  - {name: b, box: [0.1, 0.1, 0.1], mass: 1, position: [0.3, 0.1, 1.2], rpy: [0.3, 0.2, 0.1]}
closures:
  - {type: weld, name: held, between: [a/body, b/body], switched: true, in_place: true,
     anchor_a: [0.1, 0, 0], breaking_force: 25, breaking_torque: 3}
  - {type: weld, name: open, between: [a/body, b/body], switched: true, attached: false}
)"));
  const Exported out = export_mjcf(scene);
  std::vector<std::string> lost;
  for (const Note& note : out.lost) lost.push_back(note.where + ": " + note.message);
  const std::vector<std::string> expected = {
      "closure 'held': its breaking_force", "closure 'held': its breaking_torque",
      "closure 'open': a switched closure that is not attached"};
  EXPECT_EQ(lost, expected);
  const Scene back = load_scene(folder_.write("m.xml", out.text));
  ASSERT_EQ(back.model.closures().size(), 1u);
  const Closure& weld = back.model.closures()[0];
  EXPECT_EQ(weld.type, ClosureType::kWeld);
  EXPECT_LT(closure_gap(weld, body_poses(back.model, back.q)).largest(), kRoundOff);
}

TEST_F(ExportTest, TendonsAndSensorsAreNoUrdf) {
  for (const char* name : {"tendon_finger", "sensors"}) {
    const Scene scene = load_scene(test::source_dir() + "/data/scenes/" + name + ".yaml");
    const std::size_t parts = scene.model.tendons().size() + scene.model.sensors().size();
    EXPECT_GT(parts, 0u);
    const std::vector<Note> lost = export_urdf(scene).lost;
    const auto named = std::count_if(lost.begin(), lost.end(), [](const Note& note) {
      return note.message == "a tendon" || note.message == "a sensor";
    });
    EXPECT_EQ(static_cast<std::size_t>(named), parts) << name;
  }
}

TEST_F(ExportTest, SeveralFloatingRobotsAreNoUrdf) {
  EXPECT_THROW(export_urdf(bundled("scenes/box_stack.yaml")), InputError);
}

}  // namespace
}  // namespace counterpoint::export_test
