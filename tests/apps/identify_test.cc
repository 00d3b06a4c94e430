// `counterpoint identify`: parameters found from recordings, and messages about bad input.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <random>
#include <sstream>
#include <string>

#include "apps/command.h"
#include "support/paths.h"

namespace counterpoint::identify_test {
namespace {

using test::CommandFolder;

/// Records cube tosses with other parameters than the scene's, one file per toss, rows 1/148 s
/// apart.
void toss(const CommandFolder& folder, int count, const std::string& metrics) {
  for (int i = 0; i < count; ++i) {
    folder.write(fmt::format("toss{}.yaml", i),
                 fmt::format("gravity: [0, 0, -9.81]\ntime_step: {:.17g}\nduration: 0.6\n"
                             "ground: {{{}}}\nmodels:\n"
                             "  - {{name: cube, box: [0.0524, 0.0524, 0.0524], mass: 0.37, {},\n"
                             "     position: [0, 0, {}], rpy: [{}, 0.3, 0.1],\n"
                             "     velocity: {{linear: [{}, 0.4, -0.5], angular: [2, {}, 1]}}}}\n",
                             1.0 / 148, metrics, metrics, 0.12 + 0.01 * i, 0.1 * i, 0.8 + 0.1 * i,
                             1.0 - 0.7 * i));
    folder.succeed(fmt::format("simulate {{}}/toss{0}.yaml --output {{}}/toss{0}.csv", i));
  }
  folder.write("map.yaml", test::free_body_map("time: time\nsubsteps: 1\n", "cube/body"));
  folder.write("scene.yaml",
               fmt::format("gravity: [0, 0, -9.81]\ntime_step: {:.17g}\n"
                           "ground: {{friction: 0.4, restitution: 0.1}}\nmodels:\n"
                           "  - {{name: cube, box: [0.0524, 0.0524, 0.0524], mass: 0.37,\n"
                           "     friction: 0.4, restitution: 0.1, position: [0, 0, 1]}}\n",
                           1.0 / 148));
}

TEST(Identify, FindsTheFiguresOfItsOwnTosses) {
  const CommandFolder folder("identify_own");
  toss(folder, 6, "friction: 0.25, restitution: 0.3");
  const nlohmann::json report = folder.report(
      "identify {}/scene.yaml {}/toss*.csv --columns {}/map.yaml --parameters "
      "friction=0.05..0.8,restitution=0..0.8,mass --objective one-step --samples 20");
  const auto& found = report["parameters"];
  ASSERT_EQ(found.size(), 3u);
  // The recordings are exact; the remaining error is where Levenberg-Marquardt stops, since the
  // derivatives leave out the displacement by an impact within a step.
  constexpr double kTolerance = 2e-6;
  EXPECT_NEAR(found[0]["value"], 0.25, kTolerance);
  EXPECT_NEAR(found[1]["value"], 0.3, kTolerance);
  for (int i = 0; i < 2; ++i) {
    EXPECT_LE(found[i]["lower_95"], i == 0 ? 0.25 + kTolerance : 0.3 + kTolerance);
    EXPECT_GE(found[i]["upper_95"], i == 0 ? 0.25 - kTolerance : 0.3 - kTolerance);
  }
  // The motion of a free body does not depend on its mass.
  EXPECT_FALSE(found[2]["identifiable"]);
  EXPECT_TRUE(found[2]["lower_95"].is_null());
  EXPECT_NEAR(found[2]["value"], 0.37, 1e-12);  // keeps the scene's value
  EXPECT_LT(report["test"]["found"]["position_error_mean_m"], 1e-6);
  EXPECT_GT(report["test"]["scene"]["position_error_mean_m"], 1e-3);
}

TEST(Identify, ExplainRefusesWhatItCannotFind) {
  const CommandFolder folder("identify_explain");
  toss(folder, 2, "friction: 0.25, restitution: 0.3");
  for (const auto& [more, expected] :
       {std::pair{"restitution", "restitution"},
        std::pair{"friction=0.5..0.9", "the scene has 0.4"},
        std::pair{"friction --tasks 1/2 --parts {}/parts", "--tasks"},
        std::pair{"friction --samples 8", "--samples"}}) {
    folder.refuse(
        std::string("identify {}/scene.yaml {}/toss0.csv {}/toss1.csv --columns {}/map.yaml "
                    "--objective explain --parameters ") +
            more,
        expected);
  }
}

TEST(Identify, FindsJointFiguresFromForces) {
  const CommandFolder folder("identify_forces");
  folder.write("truth.yaml",
               fmt::format("time_step: 0.002\nduration: 0.4\nmodels:\n"
                           "  - {{urdf: {}/data/robots/double_pendulum.urdf,\n"
                           "     joints: {{shoulder: 1.2, elbow: 0.7}}, dynamics: "
                           "{{shoulder: {{armature: 0.4}}, elbow: {{damping: 0.3}}}}}}\n",
                           test::source_dir()));
  folder.succeed("simulate {}/truth.yaml --output {}/own.csv");
  folder.write("map.yaml",
               "time: time\ncolumns: {shoulder.q: shoulder.q, elbow.q: elbow.q, shoulder.v: "
               "shoulder.v, elbow.v: elbow.v, shoulder.u: 0, elbow.u: 0}\n");
  folder.succeed(
      "identify data/scenes/double_pendulum.yaml {}/own.csv --columns {}/map.yaml --parameters "
      "armature:shoulder=0..2,damping:elbow=0..2 --objective force --samples 8 --json {}/r.json");
  const auto found = folder.json("r.json")["parameters"];
  // Forces are linear in both parameters; the round-off of time differences remains, 1e-16 / 0.002.
  EXPECT_NEAR(found[0]["value"], 0.4, 1e-7);
  EXPECT_NEAR(found[1]["value"], 0.3, 1e-7);
  // Per joint: the found parameters reproduce the recording, the scene's do not.
  const auto coordinates = folder.json("r.json")["train"]["coordinates"];
  for (int i = 0; i < 2; ++i) {
    EXPECT_LT(coordinates["found"][i]["rms"], 1e-6);
    EXPECT_GT(coordinates["scene"][i]["rms"], 1e-2);
    EXPECT_TRUE(coordinates["found"][i]["r2"].is_null());  // the recorded force is constant at 0
  }
}

TEST(Identify, WritesSettingsThatOtherCommandsTake) {
  const CommandFolder folder("identify_settings");
  const std::string scene = test::source_dir() + "/data/scenes/double_pendulum.yaml";
  folder.write("true.txt", "damping:elbow=0.4  # N m s/rad\n\n# no more\n");
  folder.succeed("export " + scene + " --set @{}/true.txt --to urdf --output {}/true.urdf");
  folder.succeed("simulate {}/true.urdf --duration 4 --random-inputs 0.5 --output {}/motion.csv");
  folder.write("map.yaml",
               "time: time\ncolumns: {shoulder.q: shoulder.q, shoulder.v: shoulder.v, elbow.q: "
               "elbow.q, elbow.v: elbow.v, elbow.u: elbow.u}\n");
  folder.succeed("identify " + scene +
                 " {}/motion.csv --columns {}/map.yaml --objective torque --cutoff 100 "
                 "--parameters damping:elbow --output {}/found.txt --report {}/page");
  EXPECT_NE(folder.read("page/index.html").find("Combinations"), std::string::npos);
  const std::string found = folder.read("found.txt");
  const auto at = found.find("damping:elbow=");
  ASSERT_NE(at, std::string::npos) << found;
  EXPECT_NEAR(std::stod(found.substr(at + 14)), 0.4, 1e-3);  // steps against filtered steps
  folder.succeed("export " + scene + " --set @{}/found.txt --to urdf --output {}/found.urdf");
  const std::string robot = folder.read("found.urdf");
  const auto damping = robot.find("damping=\"", robot.find("name=\"elbow\""));
  ASSERT_NE(damping, std::string::npos) << robot;
  EXPECT_NEAR(std::stod(robot.substr(damping + 9)), 0.4, 1e-3);
  folder.refuse(
      "identify " + scene + " {}/motion.csv --columns {}/map.yaml --parameters force_offset:elbow",
      "belongs to a recorded force");
  folder.refuse("export " + scene + " --set @{}/none.txt --to urdf --output {}/x.urdf",
                "cannot be read");
}

TEST(Identify, FindsFrictionAndRestitutionOfImpacts) {
  const CommandFolder folder("identify_impacts");
  // A sliding ball by closed form (compare_test.cc).
  constexpr double kFriction = 0.12, kRestitution = 0.35, kRadius = 0.1;
  std::string csv = "vx,vz,ux,uz,uw\n";
  for (int k = 0; k < 8; ++k) {
    const double vx = 2.0 + 0.2 * k, vz = -1.0 - 0.1 * k;
    const double kick = kFriction * (1.0 + kRestitution) * -vz;
    csv += fmt::format("{},{},{:.17g},{:.17g},{:.17g}\n", vx, vz, vx - kick, -kRestitution * vz,
                       2.5 * kick / kRadius);
  }
  folder.write("impacts.csv", csv);
  folder.write("ball.yaml",
               "ground: {friction: 0.3, restitution: 0.1}\nmodels:\n"
               "  - {name: ball, sphere: 0.1, mass: 2, friction: 0.3, restitution: 0.1, position: "
               "[0, 0, 0.1]}\n");
  folder.write("map.yaml",
               "columns: {ball/body.vx: vx, ball/body.vz: vz}\n"
               "after: {ball/body.vx: ux, ball/body.vz: uz, ball/body.wy: uw}\n");
  const nlohmann::json report = folder.report(
      "identify {}/ball.yaml {}/impacts.csv --columns {}/map.yaml --parameters "
      "friction=0.05..0.5,restitution=0..0.8 --objective rows --samples 10");
  // Contacts yield by their compliance, 1e-6 of an impulse.
  EXPECT_NEAR(report["parameters"][0]["value"], kFriction, 1e-5);
  EXPECT_NEAR(report["parameters"][1]["value"], kRestitution, 1e-5);
  EXPECT_EQ(report["test"]["recordings"], 4);
  EXPECT_LT(report["test"]["found"]["velocity_error_m_s"], 1e-4);
  EXPECT_GT(report["test"]["scene"]["velocity_error_m_s"], 0.1);
}

/// Adds uniform noise of up to +-`size` to one column, in all rows but the first.
void disturb(const CommandFolder& folder, const std::string& file, const std::string& column,
             double size, std::uint64_t seed) {
  std::istringstream in(folder.read(file));
  std::string line, cell, out;
  std::mt19937_64 generator(seed);
  int wanted = -1;
  for (int row = -1; std::getline(in, line); ++row) {
    std::istringstream cells(line);
    for (int i = 0; std::getline(cells, cell, ','); ++i) {
      if (row < 0 && cell == column) wanted = i;
      if (row > 0 && i == wanted)
        cell = fmt::format(
            "{:.17g}",
            std::stod(cell) + size * (static_cast<double>(generator() >> 11) * 0x1p-52 - 1.0));
      out += (i == 0 ? "" : ",") + cell;
    }
    out += line.back() == ',' ? ",\n" : "\n";
  }
  folder.write(file, out);
}

TEST(Identify, IntervalsCoverTheTruthUnderNoise) {
  const CommandFolder folder("identify_noise");
  folder.write("map.yaml", test::free_body_map("time: time\nsubsteps: 1\n", "box/body"));
  // The box slides to a stop after v^2 / (2 mu g), at least 0.08 m.
  constexpr int kRecordings = 8;
  for (int i = 0; i < kRecordings; ++i) {
    folder.write("slide.yaml",
                 fmt::format("time_step: 0.01\nduration: 0.4\nground: {{friction: 0.25}}\nmodels:\n"
                             "  - {{name: box, box: [0.1, 0.1, 0.05], mass: 1, friction: 0.25,\n"
                             "     position: [0, 0, 0.05], velocity: {{linear: [{}, 0, 0]}}}}\n",
                             0.6 + 0.1 * i));
    folder.succeed(fmt::format("simulate {{}}/slide.yaml --output {{}}/s{}.csv", i));
    disturb(folder, fmt::format("s{}.csv", i), "box/body.x", 0.005, 100 + i);
  }
  const nlohmann::json found = folder.report(
      "identify {}/slide.yaml {}/s*.csv --columns {}/map.yaml --parameters friction=0.1..0.5 --set "
      "friction=0.4 --objective rows --train 1 --bootstrap 20 --samples 10 --report {}/page")
                                   ["parameters"][0];
  // Noise of 2.9 mm (5 mm / sqrt 3) in 100 rows of 8 recordings, whose ends depend on mu by mu g
  // t^2 / 2 = 0.3 m, leaves mu uncertain by about 0.001. Intervals must be wider than round-off and
  // at most ten times that.
  for (const std::string kind : {"", "bootstrap_"}) {
    const double lower = found[kind + "lower_95"], upper = found[kind + "upper_95"];
    EXPECT_LE(lower, 0.25) << kind;
    EXPECT_GE(upper, 0.25) << kind;
    EXPECT_GT(upper - lower, 1e-5) << kind;
    EXPECT_LT(upper - lower, 0.01) << kind;
  }
  EXPECT_NE(folder.read("page/index.html").find("friction"), std::string::npos);
}

/// Records a box that slides, 0.5 s at 100 Hz, into toss0.csv ..., and writes scene and map.
void slide(const CommandFolder& folder, int count) {
  const auto write = [&](double friction, double speed) {
    folder.write("scene.yaml",
                 fmt::format("time_step: 0.01\nduration: 0.5\nground: {{friction: {0}}}\nmodels:\n"
                             "  - {{name: box, box: [0.1, 0.1, 0.05], mass: 1, friction: {0},\n"
                             "     position: [0, 0, 0.05], velocity: {{linear: [{1}, 0, 0]}}}}\n",
                             friction, speed));
  };
  for (int i = 0; i < count; ++i) {
    write(0.3, 0.9 + 0.1 * i);
    folder.succeed(fmt::format("simulate {{}}/scene.yaml --output {{}}/toss{}.csv", i));
  }
  write(0.5, 1.0);
  folder.write("map.yaml", test::free_body_map("time: time\n", "box/body"));
}

/// Checks that every fold has the values and scores of a fit with --test of the same recordings.
void expect_folds_of_fits(const CommandFolder& folder, int recordings, const std::string& options) {
  constexpr int kFolds = 2;
  std::string all;
  std::array<std::string, kFolds> kept, fitted;
  for (int i = 0; i < recordings; ++i) {
    const std::string file = fmt::format(" {{}}/toss{}.csv", i);
    all += file;
    for (int k = 0; k < kFolds; ++k) (i % kFolds == k ? kept[k] : fitted[k]) += file;
  }
  const std::string scene = "identify {}/scene.yaml", map = " --columns {}/map.yaml " + options;
  const nlohmann::json folds = folder.report(scene + all + map + " --folds 2");
  ASSERT_EQ(folds["folds"].size(), std::size_t{kFolds});
  double sum = 0.0, squares = 0.0;
  const std::string name = folds["parameters"][0]["name"];
  for (int k = 0; k < kFolds; ++k) {
    const nlohmann::json& fold = folds["folds"][k];
    const nlohmann::json one = folder.report(scene + fitted[k] + map + " --test" + kept[k]);
    for (const auto& p : one["parameters"])
      EXPECT_EQ(fold["values"][p["name"].get<std::string>()], p["value"]);
    EXPECT_EQ(fold["train"], one["train"]);
    EXPECT_EQ(fold["test"], one["test"]);
    EXPECT_EQ(fold["kept_back"].size(), static_cast<std::size_t>((recordings + 1 - k) / 2));
    sum += fold["values"][name].get<double>();
    squares += std::pow(fold["values"][name].get<double>(), 2);
  }
  const nlohmann::json whole = folder.report(scene + all + map + " --train 1");
  EXPECT_EQ(folds["parameters"], whole["parameters"]);
  EXPECT_EQ(folds["train"], whole["train"]);
  const nlohmann::json& over = folds["fold_parameters"][0];
  EXPECT_DOUBLE_EQ(over["mean"], sum / kFolds);
  // Round-off of a difference of squares.
  EXPECT_NEAR(std::pow(over["deviation"].get<double>(), 2),
              (squares - sum * sum / kFolds) / (kFolds - 1), 1e-14);
}

TEST(Identify, AFoldIsAFitWithoutIt) {
  const CommandFolder folder("identify_folds");
  toss(folder, 5, "friction: 0.25, restitution: 0.3");
  expect_folds_of_fits(folder, 5,
                       "--parameters friction=0.05..0.8,restitution=0..0.8 --samples 6 --refined 1 "
                       "--horizon 20");
  const auto refuse = [&](const std::string& more, const std::string& part) {
    folder.refuse(
        "identify {}/scene.yaml {}/toss0.csv {}/toss1.csv --columns {}/map.yaml "
        "--parameters friction " +
            more,
        part);
  };
  refuse("--folds 1", "expected 2 or more");
  refuse("--folds 3", "at most the number of recordings, 2");
  refuse("--folds 2 --train 0.5", "leave out --train");
  refuse("--folds 2 --test {}/toss1.csv", "leave out --train");
  refuse("--folds 2 --swap", "leave out --train");
}

TEST(Identify, FoldsOfMotions) {
  const CommandFolder folder("identify_fold_motions");
  slide(folder, 2);
  expect_folds_of_fits(folder, 2, "--objective explain --parameters friction:ground+box/body~20%");
}

TEST(Identify, FoldsOfJointForces) {
  const CommandFolder folder("identify_fold_forces");
  folder.write("scene.yaml", fmt::format("time_step: 0.002\nduration: 2\nmodels:\n"
                                         "  - {{urdf: {}/data/robots/double_pendulum.urdf,\n"
                                         "     joints: {{shoulder: 1.2, elbow: 0.7}}}}\n",
                                         test::source_dir()));
  for (int i = 0; i < 5; ++i)
    folder.succeed(fmt::format(
        "simulate {{}}/scene.yaml --random-inputs {} --output {{}}/toss{}.csv", 0.3 + 0.1 * i, i));
  folder.write("map.yaml",
               "time: time\ncolumns: {shoulder.q: shoulder.q, shoulder.v: shoulder.v, elbow.q: "
               "elbow.q, elbow.v: elbow.v, shoulder.u: shoulder.u, elbow.u: elbow.u}\n");
  expect_folds_of_fits(folder, 5, "--objective torque --parameters mass:upper+lower~10%,damping:*");
}

TEST(Identify, SaysWhatIsWrongInItsArguments) {
  const CommandFolder folder("identify_bad");
  toss(folder, 1, "friction: 0.25");
  const auto expect = [&](const std::string& arguments, const std::string& part) {
    folder.refuse("identify {}/scene.yaml {}/toss0.csv --columns {}/map.yaml " + arguments, part);
  };
  expect("", "--parameters");
  expect("--parameters stickiness", "'stickiness': expected one of friction");
  expect("--parameters friction:ball", "'ball' is no geometry");
  expect("--parameters mass:ball", "one of the links cube/body");
  expect("--parameters damping", "joints are none");
  expect("--parameters gravity:cube", "of the whole scene");
  expect("--parameters friction=1", "expected NAME=LOW..HIGH");
  expect("--parameters friction=1..0.5", "lower bound 1 is not below 0.5");
  expect("--parameters friction=a..0.5", "'a' is no finite number");
  expect("--parameters restitution=0..1.5", "restitution 1.5; expected 0 to 1");
  expect("--parameters friction,friction", "given twice");
  expect("--parameters mass=0..1", "must be positive");
  expect("--parameters friction --train 0", "no recording is left");
  expect("--parameters friction --set friction", "expected NAME=VALUE");
  expect("--parameters inertial=0..1", "'inertial' has no bounds of its own");
  expect("--parameters friction:*", "there are none for this kind");
  expect("--parameters mass --cutoff 5", "for --objective torque");
  expect("--parameters mass --objective torque --horizon 3", "--horizon");
  expect("--parameters mass --objective torque", "use --objective explain");
  expect("--parameters friction~0.1", "use the objective torque or explain");
  expect("--parameters @{}/none.yaml", "there is no such file");
}

}  // namespace
}  // namespace counterpoint::identify_test
