// Muscles of scene files: their keys, and errors that name the wrong one.
#include <gtest/gtest.h>

#include <string>

#include "counterpoint/model/scene.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::muscle_scene_test {
namespace {

class MuscleSceneTest : public testing::Test {
 protected:
  Scene scene(const std::string& muscle) {
    return load_scene(folder_.write("m.yaml", "name: m\nmodels:\n  - {urdf: " + test::source_dir() +
                                                  "/data/robots/pendulum.urdf}\n"
                                                  "actuators:\n  - name: biceps\n    joint: " +
                                                  joint_ + "\n    muscle: {" + muscle + "}\n"));
  }
  void expect_error(const std::string& muscle, std::initializer_list<std::string> words) {
    try {
      scene(muscle);
      ADD_FAILURE() << "accepted: " << muscle;
    } catch (const InputError& error) {
      for (const std::string& word : words)
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos)
            << error.what() << "\n  does not name: " << word;
    }
  }
  const std::string joint_ = [] {
    const Model model = load_scene(test::source_dir() + "/data/scenes/pendulum.yaml").model;
    return model.joint(0).name;
  }();
  test::TempFolder folder_;
};

TEST_F(MuscleSceneTest, EveryKeyIsRead) {
  const Scene s = scene(
      "curves: mujoco, max_force: 300, optimal_length: 0.2, slack_length: -0.3, pennation: 0.1, "
      "max_speed: 8, damping: 0.2, shortest: 0.4, longest: 1.7, passive_force: 0.9, "
      "eccentric_force: 1.5, activation_time: 0.02, deactivation_time: 0.06, "
      "activation_smoothing: 0.1");
  const Actuator& a = s.model.actuators().at(0);
  const Muscle& m = a.muscle;
  EXPECT_EQ(a.law, ActuatorLaw::kMuscle);
  EXPECT_EQ(a.least_command, 0.0);
  EXPECT_EQ(a.most_command, 1.0);
  EXPECT_EQ(m.curves, Muscle::Curves::kMujoco);
  EXPECT_EQ(m.max_force, 300.0);
  EXPECT_EQ(m.optimal_length, 0.2);
  EXPECT_EQ(m.slack_length, -0.3);
  EXPECT_EQ(m.pennation, 0.1);
  EXPECT_EQ(m.max_speed, 8.0);
  EXPECT_EQ(m.damping, 0.2);
  EXPECT_EQ(m.shortest, 0.4);
  EXPECT_EQ(m.longest, 1.7);
  EXPECT_EQ(m.passive_force, 0.9);
  EXPECT_EQ(m.eccentric_force, 1.5);
  EXPECT_EQ(m.activation_time, 0.02);
  EXPECT_EQ(m.deactivation_time, 0.06);
  EXPECT_EQ(m.activation_smoothing, 0.1);
}

TEST_F(MuscleSceneTest, WrongValuesAreNamed) {
  const std::string some = "max_force: 300, optimal_length: 0.2, ";
  expect_error("optimal_length: 0.2", {"m.yaml:", "max_force"});
  expect_error("max_force: 300", {"m.yaml:", "optimal_length"});
  expect_error("max_force: 0, optimal_length: 0.2", {"biceps", "max_force"});
  expect_error(some + "curves: thelen", {"m.yaml:", "millard or mujoco"});
  expect_error(some + "slack_length: -0.1", {"biceps", "slack_length"});
  expect_error(some + "pennation: 1.5", {"biceps", "pennation"});
  expect_error(some + "damping: -1", {"m.yaml:", "damping"});
  expect_error(some + "activation_time: 0", {"biceps", "activation_time"});
  expect_error(some + "longest: 0.9", {"biceps", "longest"});
  expect_error(some + "eccentric_force: 1", {"biceps", "eccentric_force"});
  expect_error(some + "max_sped: 3", {"max_sped", "max_speed"});
}

}  // namespace
}  // namespace counterpoint::muscle_scene_test
