// Problem files: rejected input, with its line and a remedy.
#include <gtest/gtest.h>

#include "counterpoint/engine/optimize/optimize.h"
#include "support/paths.h"
#include "support/temp_folder.h"

namespace counterpoint::optimization::problem_file_test {
namespace {

const char* const kScene =
    "ground: {}\nmodels: [{name: ball, sphere: 0.1, mass: 1, position: [0, 0, 0.1]}]\n";
const char* const kGood =
    "scene: scene.yaml\nsteps: 10\nterms:\n  - {quantity: velocity, weight: 1}\n";

/// Message of the rejection of a problem file; empty if it is accepted.
std::string refusal(const std::string& text) {
  const test::TempFolder folder;
  folder.write("scene.yaml", kScene);
  try {
    load_problem(folder.write("problem.yaml", text));
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(ProblemFile, TakesAPlainOne) { EXPECT_EQ(refusal(kGood), ""); }

TEST(ProblemFile, RefusesNonsenseWithLineAndRemedy) {
  const struct {
    std::string text, expected;
  } cases[] = {
      {"steps: 10\nterms: []\n", "'scene' is missing"},
      {"scene: none.yaml\nsteps: 10\nterms: []\n", "none.yaml"},
      {"scene: scene.yaml\nsteps: 2\nterms: []\n", ":2: steps: 2 is out of range"},
      {std::string(kGood) + "speed: 3\n", ":5: speed: 'speed' is not known here"},
      {"scene: scene.yaml\nsteps: 9\nterms:\n  - {quantity: speed}\n",
       ":4: terms[0].quantity: 'speed' is no quantity; known: configuration"},
      {"scene: scene.yaml\nsteps: 9\nterms:\n  - {quantity: position}\n",
       "'link' or 'links' is missing"},
      {"scene: scene.yaml\nsteps: 9\nterms:\n  - {quantity: position, link: hand}\n",
       ":4: terms[0]: the scene has no link 'hand'"},
      {"scene: scene.yaml\nsteps: 9\nterms:\n  - {quantity: velocity, weight: {arm: 1}}\n",
       "'arm' is no coordinate of the scene; known: ball/body.vx"},
      {"scene: scene.yaml\nsteps: 9\nterms:\n  - {quantity: velocity, link: ball/body}\n",
       "velocity is of coordinates, not of a link"},
      {"scene: scene.yaml\nsteps: 9\nterms:\n  - {quantity: configuration, target: goal}\n",
       "there is no goal in this file"},
      {std::string(kGood) + "periodic: {displacement: [1, 0, 0], mirror: [left]}\n",
       ":5: periodic.mirror: two words are expected"},
      {std::string(kGood) + "periodic: {displacement: [1, 0, 0]}\ngoal: {}\n",
       "a periodic motion has no goal: remove one of the two"},
      {std::string(kGood) + "duration: [2, 1]\n", ":5: duration: [least, most] in s is expected"},
      {std::string(kGood) + "  - {quantity: duration}\n",
       ":5: terms[1].quantity: the duration is fixed; give its range"},
      {std::string(kGood) + "  - {quantity: duration, link: ball/body}\nduration: [1, 2]\n",
       "a duration is of the whole motion"},
      {std::string(kGood) + "duration: [1, 2]\nretarget: {}\n",
       "a motion is followed at its own speed: remove 'duration'"},
      {std::string(kGood) + "continuation: {factor: 0.5}\n", "a number above 1 is expected"},
      {std::string(kGood) + "passive: [knee]\n", "the scene has no joint 'knee'"},
      {std::string(kGood) + "start: {pose: {ball/body.z: high}}\n", "a finite number is expected"},
  };
  for (const auto& c : cases) {
    const std::string found = refusal(c.text);
    EXPECT_NE(found.find(c.expected), std::string::npos) << c.text << "gave: " << found;
    EXPECT_NE(found.find("yaml"), std::string::npos) << "names no file: " << found;
  }
}

TEST(ProblemFile, PatternsMatchAsShellsDo) {
  EXPECT_TRUE(matches("*_knee", "left_knee"));
  EXPECT_TRUE(matches("pelvis.w*", "pelvis.wx"));
  EXPECT_TRUE(matches("*", ""));
  EXPECT_TRUE(matches("a*b*c", "axxbyyc"));
  EXPECT_FALSE(matches("*_knee", "left_knee_pad"));
  EXPECT_FALSE(matches("left", "left_knee"));
}

TEST(ProblemFile, TheSameSeedGivesTheSameBits) {
  const test::TempFolder folder;
  folder.write("scene.yaml",
               "models: [{urdf: " + test::source_dir() + "/data/robots/double_pendulum.urdf}]\n");
  const ProblemFile file =
      load_problem(folder.write("p.yaml", std::string(kGood) + "guess: {noise: 0.1}\n"));
  EXPECT_EQ(seeded_guess(file, 5)[3], seeded_guess(file, 5)[3]);
  EXPECT_NE(seeded_guess(file, 5)[3], seeded_guess(file, 6)[3]);
  EXPECT_EQ(seeded_guess(file, 0)[3], file.guess[3]);
}

}  // namespace
}  // namespace counterpoint::optimization::problem_file_test
