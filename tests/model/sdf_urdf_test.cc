// Our robots, converted to SDF by libsdformat, against our URDF reader. Not built without
// libsdformat.
#include <gtest/gtest.h>

#include <sdf/Console.hh>
#include <sdf/Root.hh>

#include "counterpoint/model/scene.h"
#include "counterpoint/model/text_files.h"
#include "support/mass_matrix.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::sdf_urdf_test {
namespace {

using test::mass_matrix;

constexpr double kRoundOff =
    1e-12;  // round-off of chains of some ten joints and of 16 digits in a file

/// Copies q from another model of the same robot, joint by joint.
VectorX by_name(const Model& from, const VectorX& q, const Model& to) {
  VectorX out = to.default_q();
  for (int j = 0; j < to.num_joints(); ++j) {
    const Body &target = to.body(j + 1), &source = from.body(from.find_joint(to.joint(j).name) + 1);
    const int n = joint_nq(target.joint_type);
    out.segment(target.q_index, n) = q.segment(source.q_index, n);
  }
  return out;
}

class SdfOfUrdf : public testing::TestWithParam<const char*> {};

TEST_P(SdfOfUrdf, HasTheSameMassMatrixAndPoses) {
  const std::string urdf = test::source_dir() + "/data/robots/" + GetParam() + ".urdf";
  sdf::Console::Instance()->SetQuiet(true);
  sdf::Root root;
  // urdfdom does not know the shape `capsule`; it prints a warning and continues without it.
  ASSERT_TRUE(root.LoadSdfString(read_text_file(urdf, 1'000'000, "missing")).empty());
  const test::TempFolder folder;
  const Scene ours = load_scene(folder.write("r.sdf", root.Element()->ToString("")));
  SceneOverrides floating;
  floating.base = Base::kFloating;
  const Scene theirs = load_scene(urdf, floating);
  ASSERT_EQ(ours.model.nv(), theirs.model.nv());
  std::mt19937 random(1);
  for (int sample = 0; sample < 10; ++sample) {
    const VectorX q = test::random_configuration(theirs.model, random);
    const VectorX p = by_name(theirs.model, q, ours.model);
    const auto X = body_poses(theirs.model, q), Y = body_poses(ours.model, p);
    const MatrixX M = mass_matrix(theirs.model, q), N = mass_matrix(ours.model, p);
    for (int i = 0; i < ours.model.num_joints(); ++i) {
      const int k = theirs.model.find_joint(ours.model.joint(i).name);
      EXPECT_LT((Y[i + 1].translation - X[k + 1].translation).norm(), kRoundOff);
      EXPECT_LT((Y[i + 1].rotation - X[k + 1].rotation).norm(), kRoundOff);
      for (int j = 0; j < ours.model.num_joints(); ++j) {
        const int l = theirs.model.find_joint(ours.model.joint(j).name);
        const Body &a = ours.model.body(i + 1), &b = ours.model.body(j + 1);
        const Body &c = theirs.model.body(k + 1), &d = theirs.model.body(l + 1);
        const int n = joint_nv(a.joint_type), m = joint_nv(b.joint_type);
        EXPECT_LE(
            (N.block(a.v_index, b.v_index, n, m) - M.block(c.v_index, d.v_index, n, m)).norm(),
            kRoundOff * M.norm());
      }
    }
  }
  for (int i = 0; i < ours.model.num_joints(); ++i) {
    const JointInfo &a = ours.model.joint(i),
                    &b = theirs.model.joint(theirs.model.find_joint(ours.model.joint(i).name));
    EXPECT_EQ(a.lower, b.lower);
    EXPECT_EQ(a.upper, b.upper);
    EXPECT_EQ(a.effort_limit, b.effort_limit);
    EXPECT_EQ(a.velocity_limit, b.velocity_limit);
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, SdfOfUrdf,
                         testing::Values("quadruped", "humanoid", "arm7", "arm_hand", "cube"));

}  // namespace
}  // namespace counterpoint::sdf_urdf_test
