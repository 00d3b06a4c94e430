// Parameters by name: ties, mirrored ties, stated priors, and parameter files.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/engine/estimate/parameters/step_parameters.h"
#include "support/paths.h"
#include "support/small_scenes.h"

namespace counterpoint::estimation::parameters_test {
namespace {

Scene arm() { return load_scene(test::source_dir() + "/data/scenes/double_pendulum.yaml"); }

/// A file of the test that runs, removed at the end.
class TestFile {
 public:
  explicit TestFile(const std::string& content)
      : path_(std::filesystem::temp_directory_path() /
              ("counterpoint_parameters_" + std::to_string(getpid()) + ".yaml")) {
    std::ofstream(path_) << content;
  }
  ~TestFile() { std::filesystem::remove(path_); }
  TestFile(const TestFile&) = delete;
  TestFile& operator=(const TestFile&) = delete;
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

void expect_refused(const std::string& text, const Scene& scene, const std::string& words) {
  try {
    parse_parameters(text, scene);
    ADD_FAILURE() << text << ": expected '" << words << "'";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

double mass_of(const Scene& scene, int body) { return scene.model.body(body).inertia.mass; }

TEST(Parameters, TiedElementsShareTheValue) {
  const Scene scene = with_settings(arm(), "mass:upper=1,mass:lower=3");
  const std::vector<Parameter> tied = parse_parameters("mass:upper+lower=0.5..4", scene);
  ASSERT_EQ(tied.size(), 1U);
  EXPECT_EQ(tied[0].name, "mass:upper+lower");
  EXPECT_EQ(tied[0].targets, (std::vector<int>{1, 2}));
  EXPECT_EQ(parameter_values(tied, scene)[0], 2.0);  // the mean
  const Scene set = with_parameters(scene, tied, VectorX::Constant(1, 1.5));
  EXPECT_EQ(mass_of(set, 1), 1.5);
  EXPECT_EQ(mass_of(set, 2), 1.5);
  EXPECT_EQ(mass_of(with_settings(scene, "mass:upper+lower=1.5"), 2), 1.5);
  EXPECT_EQ(parse_parameters("inertial:upper+lower", scene).size(), 10U);
}

TEST(Parameters, MirroredElementsTakeTheNegativeValue) {
  Scene scene = with_settings(arm(), "com_y:upper=0.02,com_y:lower=-0.04");
  const std::vector<Parameter> tied = parse_parameters("com_y:upper+~lower", scene);
  EXPECT_EQ(tied[0].name, "com_y:upper+~lower");
  EXPECT_DOUBLE_EQ(parameter_values(tied, scene)[0], 0.03);
  scene = with_parameters(scene, tied, VectorX::Constant(1, 0.01));
  const std::vector<Parameter> each = parse_parameters("com_y:upper,com_y:lower", scene);
  EXPECT_DOUBLE_EQ(parameter_values(each, scene)[0], 0.01);
  EXPECT_DOUBLE_EQ(parameter_values(each, scene)[1], -0.01);
  EXPECT_EQ(parse_parameters(tied[0].name, scene)[0].signs, tied[0].signs);  // --set writes this
  expect_refused("mass:upper+~lower", scene, "mass has no sign");
  expect_refused("damping:shoulder+~elbow", scene, "damping has no sign");
}

// The shift of a place as steps differentiate it is that of the parameter: along the same axis of
// the geometry, to rounding.
TEST(Parameters, PlacesAreShiftsOfSteps) {
  const Scene scene = load_scene(test::source_dir() + "/data/scenes/cube_toss.yaml");
  const Scene turned = with_settings(scene, "tilt_x:cube=0.3,tilt_z:cube=-0.2");
  const std::vector<Parameter> places =
      parse_parameters("place_x:cube,place_y:cube,place_z:cube", turned);
  for (std::size_t k = 0; k < places.size(); ++k) {
    Model stepped = turned.model;
    SimulationOptions options = turned.options;
    change_parameter(step_parameter(places, k, VectorX::Zero(3), turned.model), 0.01, stepped,
                     options);
    const Scene set = with_parameters(turned, {places[k]}, VectorX::Constant(1, 0.01));
    const auto i = static_cast<std::size_t>(places[k].targets[0]);
    EXPECT_LT(
        (stepped.geometries()[i].X_BG.translation - set.model.geometries()[i].X_BG.translation)
            .norm(),
        1e-15);
    EXPECT_NEAR(
        (set.model.geometries()[i].X_BG.translation - turned.model.geometries()[i].X_BG.translation)
            .norm(),
        0.01, 1e-15);
  }
}

TEST(Parameters, RefuseTiesThatContradict) {
  const Scene scene = arm();
  expect_refused("mass:upper+upper", scene, "'upper' shares the value already");
  expect_refused("mass:upper+foot", scene, "there is 'foot'");
  expect_refused("mass:upper+", scene, "expected KIND:ELEMENT+ELEMENT");
  expect_refused("mass:upper+lower,mass:lower", scene,
                 "'mass:upper+lower' and 'mass:lower' set the same element");
  expect_refused("mass:*,mass:upper+lower", scene, "set the same element");
}

TEST(Parameters, NamesWithPlusAndTildeComeFirst) {
  const TestFile file(
      "models:\n  - {name: a+b, sphere: 0.1, mass: 1}\n  - {name: ~c~2, sphere: 0.1, mass: 2}\n");
  const Scene scene = load_scene(file.path());
  const std::string first = scene.model.joint(0).link, second = scene.model.joint(1).link;
  EXPECT_EQ(parse_parameters("com_y:" + first, scene)[0].targets, std::vector<int>{1});
  const Parameter other = parse_parameters("com_y:" + second, scene)[0];
  EXPECT_EQ(other.sign(0), 1.0);
  EXPECT_FALSE(other.deviation);
}

TEST(Parameters, PriorsHaveADeviationInUnitsOrPercent) {
  const Scene scene = with_settings(arm(), "mass:upper=2,mass:lower=4,damping:elbow=0.5");
  const auto deviation = [&](const std::string& text) {
    return parse_parameters(text, scene)[0].deviation;
  };
  EXPECT_FALSE(deviation("mass:upper=1..3"));
  EXPECT_EQ(deviation("mass:upper=1..3~0.25"), 0.25);
  EXPECT_EQ(deviation("mass:upper~0.25"), 0.25);
  EXPECT_EQ(deviation("gravity~0.01"), 0.01);
  EXPECT_DOUBLE_EQ(*deviation("mass:upper+lower~10%"), 0.3);
  const std::vector<Parameter> each = parse_parameters("mass:*~10%", scene);
  ASSERT_EQ(each.size(), 2U);
  EXPECT_DOUBLE_EQ(*each[0].deviation, 0.2);
  EXPECT_DOUBLE_EQ(*each[1].deviation, 0.4);
  const Parameter mirrored = parse_parameters("com_y:upper+~lower~0.01", scene)[0];
  EXPECT_EQ(*mirrored.deviation, 0.01);
  EXPECT_EQ(mirrored.sign(1), -1.0);
  expect_refused("mass:upper~x", scene, "'x' is no standard deviation");
  expect_refused("mass:upper=1..3~-0.1", scene, "no standard deviation");
  expect_refused("damping:shoulder~10%", with_settings(scene, "damping:shoulder=0"),
                 "which has no percent");
  expect_refused("mass:upper=3..4~0.1", scene, "the prior is about the scene's value 2");
  expect_refused("inertial:upper~0.1", scene, "no prior");
}

TEST(Parameters, AFileSaysTheSameAsAText) {
  const Scene scene = arm();
  const TestFile file(
      "parameters:\n"
      "  - {kind: mass, elements: [upper, lower], between: [0.5, 2], prior: 10 %}\n"
      "  - {kind: com_y, element: upper, mirrored: [lower], prior: 0.01}\n"
      "  - {kind: damping, each: all}\n"
      "  - {kind: armature, each: [elbow], between: [0, 1]}\n"
      "  - kind: gravity\n");
  const std::vector<Parameter> read = parse_parameters("@" + file.path(), scene);
  const std::vector<Parameter> text = parse_parameters(
      "mass:upper+lower=0.5..2~10%,com_y:upper+~lower~0.01,damping:*,armature:elbow=0..1,gravity",
      scene);
  ASSERT_EQ(read.size(), text.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    const Parameter &a = read[i], &b = text[i];
    EXPECT_EQ(std::tie(a.kind, a.name, a.unit, a.lower, a.upper, a.logarithmic),
              std::tie(b.kind, b.name, b.unit, b.lower, b.upper, b.logarithmic));
    EXPECT_EQ(std::tie(a.targets, a.signs, a.deviation), std::tie(b.targets, b.signs, b.deviation));
  }
}

TEST(Parameters, AFileNamesTheLineThatIsWrong) {
  const Scene scene = arm();
  const auto refused = [&](const std::string& entry, const std::string& words) {
    const TestFile file("parameters:\n  - kind: gravity\n  - " + entry + "\n");
    // The entry begins on the third line.
    expect_refused("@" + file.path(), scene, file.path() + ":3: parameters[1]");
    expect_refused("@" + file.path(), scene, words);
  };
  refused("{kind: stickiness}", "expected one of friction");
  refused("{element: upper}", "'kind' is missing");
  refused("{kind: mass, link: upper}", "'link' is not known here");
  refused("{kind: mass, element: foot}", "there is 'foot'");
  refused("{kind: mass, element: upper, each: all}", "expected one of element, elements and each");
  refused("{kind: com_y, each: all, mirrored: [upper]}", "it ties elements");
  refused("{kind: mass, element: upper, mirrored: [lower]}", "mass has no sign");
  refused("{kind: mass, element: upper, between: [1]}", "expected [LOW, HIGH]");
  refused("{kind: mass, element: upper, between: [2, 1]}", "lower bound 2 is not below 1");
  refused("{kind: mass, element: upper, between: [1, x]}", "x");
  refused("{kind: mass, element: upper, prior: -1}", "expected a positive standard deviation");
  refused("{kind: friction, each: all}", "there are none for this kind");
  refused("{kind: damping, each: [elbow, knee]}", "'knee' is no joint");
  refused("{kind: gravity}", "'gravity' is given twice");
  refused("{kind: inertial, each: all, between: [0, 1]}", "'inertial' has no bounds of its own");
  expect_refused("@/nowhere.yaml", scene, "there is no such file");
  const TestFile empty("parameters: []\n");
  expect_refused("@" + empty.path(), scene, "expected at least one parameter");
}

TEST(Parameters, PriorsNeedAnObjectiveThatKnowsTheNoise) {
  const Experiment e{test::box_on_plane({}), {}, {}, 0, {}};
  const std::vector<int> none;
  const std::vector<Parameter> parameters = parse_parameters("friction~0.1", e.scene);
  try {
    fit_problem(e, parameters, none, false);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("use the objective torque or explain"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace counterpoint::estimation::parameters_test
