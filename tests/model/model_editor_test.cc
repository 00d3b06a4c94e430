// Models with edited parameters: only the edited values change.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/scene.h"
#include "support/paths.h"

namespace counterpoint::model_editor_test {
namespace {

const std::string kData = test::source_dir() + "/data/scenes/";

TEST(ModelEditor, MassKeepsTheRadiusOfGyration) {
  ModelEditor editor(load_scene(kData + "cube_toss.yaml").model);
  editor.set_mass(1, 0.74);
  const Model model = editor.take();
  EXPECT_EQ(model.body(1).inertia.mass, 0.74);
  EXPECT_NEAR(model.body(1).inertia.rotational(2, 2), 2 * 0.00081, 1e-18);  // one round-off
}

TEST(ModelEditor, SizeScalesShapesAndRadiiOfGyration) {
  ModelEditor editor(load_scene(kData + "cube_toss.yaml").model);
  editor.scale_size(1, 0.5);
  const Model model = editor.take();
  EXPECT_EQ(model.body(1).inertia.mass, 0.37);
  EXPECT_NEAR(model.body(1).inertia.rotational(0, 0), 0.25 * 0.00081, 1e-18);
  int boxes = 0;
  for (const Geometry& g : model.geometries()) {
    if (g.body != 1) continue;
    ++boxes;
    EXPECT_DOUBLE_EQ(g.shape.size[0], 0.5 * 0.0524);
  }
  EXPECT_EQ(boxes, 1);
}

TEST(ModelEditor, SizeMovesTheCentreOfALastLink) {
  const Model before = load_scene(kData + "pendulum.yaml").model;
  ModelEditor editor(before);
  editor.scale_size(1, 2.0);
  const Model after = editor.take();
  EXPECT_GT(before.body(1).inertia.center.norm(), 0.1);
  EXPECT_EQ(after.body(1).inertia.center, 2.0 * before.body(1).inertia.center);
}

TEST(ModelEditor, JointsAndGravity) {
  ModelEditor editor(load_scene(kData + "double_pendulum.yaml").model);
  editor.set_damping(0, 0.3);
  editor.set_dry_friction(1, 0.2);
  editor.set_breakaway_friction(1, 0.3);
  editor.set_stribeck_speed(1, 0.04);
  editor.set_armature(0, 0.1);
  editor.set_gravity({0, 0, -3});
  const Model model = editor.take();
  EXPECT_EQ(model.damping()[0], 0.3);
  EXPECT_EQ(model.dry_friction()[1], 0.2);
  EXPECT_EQ(model.breakaway_friction()[1], 0.3);
  EXPECT_EQ(model.friction_at_rest(1), 0.3);
  EXPECT_EQ(model.stribeck_speed()[1], 0.04);
  EXPECT_EQ(model.armature()[0], 0.1);
  EXPECT_EQ(model.gravity().z(), -3);
}

TEST(ModelEditor, RefusesWhatNoModelMayHave) {
  const Model model = load_scene(kData + "double_pendulum.yaml").model;
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(ModelEditor(model).set_mass(1, 0.0), InputError);
  EXPECT_THROW(ModelEditor(model).set_mass(1, kNaN), InputError);
  EXPECT_THROW(ModelEditor(model).scale_size(1, 1.1),
               InputError);  // the second link is attached to it
  EXPECT_THROW(ModelEditor(model).set_damping(0, -1.0), InputError);
  EXPECT_THROW(ModelEditor(model).set_breakaway_friction(0, -1.0), InputError);
  EXPECT_THROW(ModelEditor(model).set_stribeck_speed(0, 0.0), InputError);
  EXPECT_THROW(ModelEditor(model).set_gravity({0, kNaN, 0}), InputError);
  const Model cube = load_scene(kData + "cube_toss.yaml").model;
  EXPECT_THROW(ModelEditor(cube).set_material(0, {.friction = -0.1}), InputError);
  EXPECT_THROW(ModelEditor(cube).set_material(0, {.restitution = 1.1}), InputError);
}

}  // namespace
}  // namespace counterpoint::model_editor_test
