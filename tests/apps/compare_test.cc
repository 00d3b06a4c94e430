// `counterpoint compare`: scores of a rollout against a recording.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/command.h"
#include "support/paths.h"

namespace counterpoint::compare_test {
namespace {

using test::CommandFolder;

constexpr double kGravity = 9.81;  // gravity of the scene [m/s^2]
constexpr double kRate = 148.0;    // rows per second [1/s]

/// A recording of a ballistic flight without rotation; velocities are backward differences.
std::string ballistic_recording(int rows) {
  std::string csv = "t,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n";
  for (int k = 0; k < rows; ++k) {
    const double t = k / kRate;
    const double z = 5.0 + 1.0 * t - 0.5 * kGravity * t * t;
    const double vz = 1.0 - kGravity * (t - 0.5 / kRate);
    csv += fmt::format("{},{:.17g},0,{:.17g},1,0,0,0,0.5,0,{:.17g},0,0,0\n", t, 0.5 * t, z, vz);
  }
  return csv;
}

/// A column map of the cube that starts with these lines.
std::string cube_map(const std::string& lines) { return test::free_body_map(lines, "cube", true); }

TEST(Compare, StartsAFlightWithTheVelocityAtTheRow) {
  const CommandFolder folder("compare_flight");
  folder.write("flight.csv", ballistic_recording(60));
  const nlohmann::json report = folder.report(
      "compare data/scenes/cube_toss.yaml {}/flight.csv --columns data/maps/cube_toss.yaml "
      "--substeps 8 --output {}/rows.csv");
  ASSERT_EQ(report["recordings"].size(), 1u);
  for (const auto* entry : {&report["recordings"][0], &report["median"]}) {
    EXPECT_TRUE(entry->contains("position_error_mean_m"));
    EXPECT_TRUE(entry->contains("rotation_error_mean_deg"));
    // Semi-implicit Euler falls g h t / 2 too far; expects this discrete error to round-off.
    const double t = 59 / kRate;
    EXPECT_NEAR((*entry)["position_error_end_m"], 0.5 * kGravity * t / (8 * kRate), 1e-12);
    EXPECT_NEAR((*entry)["rotation_error_end_deg"], 0.0, 1e-12);
  }
  EXPECT_EQ(folder.lines("rows.csv"), 61);
}

TEST(Compare, SaysWhatIsWrongInAColumnMap) {
  const CommandFolder folder("compare_map");
  folder.write("flight.csv", ballistic_recording(3));
  const auto expect = [&](const std::string& map, const std::string& part) {
    folder.write("map.yaml", map);
    folder.refuse("compare data/scenes/cube_toss.yaml {}/flight.csv --columns {}/map.yaml", part);
  };
  expect("rate: 148\n", "expected 'columns'");
  expect("rate: 148\ntime: t\ncolumns: {cube.x: x}\n", "either 'rate'");
  expect("rate: -1\ncolumns: {cube.x: x}\n", "map.yaml:1: rate");
  expect("rate: 148\nspeed: 3\ncolumns: {cube.x: x}\n", "map.yaml:2: unknown key 'speed'");
  expect("rate: 148\ncolumns:\n  sphere.x: x\n", "map.yaml:3: 'sphere.x' is no coordinate");
  expect("rate: 148\ncolumns:\n  cube.x: height\n", "no column 'height'");
  expect("rate: 148\nfree: cube\ncolumns: {cube.x: x}\n", "says nothing about cube.y");
  expect("rate: 148\nfree: ball\ncolumns: {cube.x: x}\n", "'ball' is no floating link");
  expect("rate: [1\n", "map.yaml:2");
}

/// Writes a trajectory of the toss scene made by the engine, and the column map that reads it.
void record_own_toss(const CommandFolder& folder) {
  folder.succeed("simulate data/scenes/cube_toss.yaml --output {}/own.csv");
  folder.write("map.yaml", test::free_body_map("time: time\nsubsteps: 1\n", "cube"));
}

TEST(Compare, OneStepOfAnOwnTrajectoryIsExact) {
  const CommandFolder folder("compare_own");
  record_own_toss(folder);
  const auto run = [&](const std::string& arguments) {
    return folder.report("compare data/scenes/cube_toss.yaml {}/own.csv --columns {}/map.yaml " +
                         arguments)["median"];
  };
  // Differences of times equal the time step, and recorded quaternions have unit length, to 1e-16
  // only. Angles come from a cosine: sqrt(1e-16) = 1e-8 rad.
  const nlohmann::json one_step = run("--mode one-step");
  EXPECT_LT(one_step["position_error_mean_m"], 1e-13);
  EXPECT_LT(one_step["rotation_error_mean_deg"], 1e-9);
  // Another friction changes the score, so the recording is not merely compared with itself.
  const nlohmann::json other = run("--mode one-step --set friction=0.3");
  EXPECT_GT(other["position_error_mean_m"], 1e-7);
  // A whole rollout starts from the first row only.
  const nlohmann::json rollout = run("");
  EXPECT_LT(rollout["position_error_mean_m"], 1e-9);
  EXPECT_GT(run("--set friction=0.3")["position_error_mean_m"],
            10 * other["position_error_mean_m"].get<double>());
}

TEST(Compare, NothingIsUnexplainedInAnOwnTrajectory) {
  const CommandFolder folder("compare_inverse");
  record_own_toss(folder);
  const auto run = [&](const std::string& arguments) {
    return folder.report(
        "compare data/scenes/cube_toss.yaml {}/own.csv --columns {}/map.yaml --mode inverse "
        "--report {}/page --output {}/f.csv " +
        arguments)["median"];
  };
  const nlohmann::json own = run("");
  // Contacts yield by 1e-8 of their force; impacts reach a hundred times the weight. The friction
  // of a bounce acts at the corners; the analysis may place it elsewhere on the edge.
  EXPECT_LT(own["unexplained_force_max"], 1e-5);
  EXPECT_LT(own["unexplained_torque_max"], 1e-5);
  EXPECT_GT(own["contact_force_max"], 5.0);  // the recording has impacts
  EXPECT_NE(folder.read("page/index.html").find("<svg"), std::string::npos);
  // Without friction, or with the ground out of reach, the recorded loss of speed is unexplained.
  EXPECT_GT(run("--set friction=0")["unexplained_force_mean"], 0.05);
  EXPECT_GT(run("--set height=-1")["unexplained_force_mean"], 0.5);
}

TEST(Compare, TheMeanOfAFlightIsAFlight) {
  const CommandFolder folder("compare_average");
  folder.write("flight.csv", ballistic_recording(60));
  folder.write("map.yaml", cube_map("rate: 148\nsubsteps: 8\nvelocities: backward_difference\n"
                                    "average: 5\npieces: 4\n"));
  const nlohmann::json report =
      folder.report("compare data/scenes/cube_toss.yaml {}/flight.csv --columns {}/map.yaml");
  // Means over five rows shorten the recording by two rows at either end: 56 rows in four pieces.
  ASSERT_EQ(report["recordings"].size(), 4u);
  for (const nlohmann::json& one : report["recordings"]) {
    EXPECT_EQ(one["rows"], 14);
    // The error of a flight without averaging, see StartsAFlightWithTheVelocityAtTheRow.
    EXPECT_NEAR(one["position_error_end_m"], 0.5 * kGravity * 13 / kRate / (8 * kRate), 1e-12);
  }
}

TEST(Compare, TurnsAngularVelocitiesOfTheWorld) {
  const CommandFolder folder("compare_world");
  // The body is rotated by 90 degrees about z and rotates about the world's x axis.
  std::string csv = "t,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n";
  const double s = std::sqrt(0.5);
  for (int k = 0; k < 3; ++k) {
    const double half = 0.5 * k / kRate, c = std::cos(half) * s, d = std::sin(half) * s;
    csv += fmt::format("{},0,0,{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},0,0,{:.17g},1,0,0\n",
                       k / kRate, 5.0 - 0.5 * kGravity * k * k / kRate / kRate, c, d, -d, c,
                       -kGravity * k / kRate);
  }
  folder.write("spin.csv", csv);
  const auto error = [&](const std::string& axes) {
    folder.write("map.yaml", cube_map("rate: 148\nsubsteps: 1\nangular_velocity: " + axes + "\n"));
    return folder
        .report("compare data/scenes/cube_toss.yaml {}/spin.csv --columns {}/map.yaml")
            ["median"]["rotation_error_end_deg"]
        .get<double>();
  };
  // The inertia of a cube is isotropic, so its angular velocity is constant. The angle comes from a
  // cosine: error sqrt(1e-16).
  EXPECT_LT(error("world"), 1e-5);
  EXPECT_GT(error("body"), 0.5);
}

/// Writes closed-form impacts of a sliding ball: impulse m (1 + e) v_n along the normal, mu times
/// that along the ground. The ball starts above or within the ground; the last row is to be
/// skipped.
void record_impacts(const CommandFolder& folder, double mu, double e) {
  constexpr double kRadius = 0.1;
  std::string csv = "z,vx,vz,ux,uz,uw,bad\n";
  for (int k = 0; k < 6; ++k) {
    const double vx = 1.0 + 0.2 * k, vz = -1.0 - 0.1 * k, kick = mu * (1.0 + e) * -vz;
    csv += fmt::format("{},{},{},{:.17g},{:.17g},{:.17g},0\n", kRadius + 0.004 - 0.001 * k, vx, vz,
                       vx - kick, -e * vz, 2.5 * kick / kRadius);
  }
  folder.write("impacts.csv", csv + "0.1,1,-1,9,9,9,1\n");
  folder.write("ball.yaml",
               "gravity: [0, 0, -9.81]\nground: {friction: 0.08, restitution: 0.5}\nmodels:\n"
               "  - {name: ball, sphere: 0.1, mass: 2, friction: 0.08, restitution: 0.5}\n");
  folder.write("map.yaml",
               "columns: {ball/body.z: z, ball/body.vx: vx, ball/body.vz: vz}\n"
               "after: {ball/body.vx: ux, ball/body.vz: uz, ball/body.wy: uw}\nskip: [bad]\n");
}

TEST(Compare, ImpactsOfABallAreThoseOfTheClosedForm) {
  const CommandFolder folder("compare_impacts");
  record_impacts(folder, 0.08, 0.5);
  const std::string command =
      "compare {}/ball.yaml {}/impacts.csv --columns {}/map.yaml --output {}/rows.csv --report "
      "{}/page --json {}/r.json ";
  folder.succeed(command);
  const nlohmann::json report = folder.json("r.json");
  ASSERT_EQ(report["recordings"].size(), 6u);
  for (const nlohmann::json& one : report["recordings"]) {
    // Contacts yield by their compliance, 1e-6 of an impulse.
    EXPECT_LT(one["velocity_error_m_s"], 2e-5);
    EXPECT_NEAR(one["energy_ratio"], one["recorded_energy_ratio"], 2e-5);
  }
  ASSERT_EQ(report["coordinates"].size(), 3u);
  for (const nlohmann::json& one : report["coordinates"]) EXPECT_GT(one["r2"], 0.999);
  EXPECT_EQ(folder.lines("rows.csv"), 7);
  // A restitution lower by 0.3 changes the bounce by 0.3 times 1 ... 1.5 m/s, plus the friction
  // that follows.
  folder.succeed(command + "--set restitution=0.2");
  EXPECT_NEAR(folder.json("r.json")["median"]["velocity_error_m_s"], 0.3 * 1.25, 0.02);
  // No contact beyond the margin.
  folder.write("impacts.csv", "z,vx,vz,ux,uz,uw,bad\n0.2,1,-2,1,-2,0,0\n0.2,1,-2,1,-2,0,0\n");
  folder.succeed(command);
  EXPECT_EQ(folder.json("r.json")["median"]["velocity_error_m_s"], 0.0);
}

/// A ball of 2 kg slides along a cart of 1 kg whose rotor adds 3 kg of reflected inertia along the
/// rail, so the friction at the ground decelerates 6 kg.
TEST(Compare, ImpactsMoveRotorsToo) {
  const CommandFolder folder("compare_impact_rotor");
  constexpr double kFriction = 0.2, kRestitution = 0.5;
  const auto link = [](const std::string& name, double mass, const std::string& more) {
    return fmt::format(
        "<link name=\"{}\"><inertial><mass value=\"{}\"/><inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" "
        "iyy=\"0.01\" iyz=\"0\" izz=\"0.01\"/></inertial>{}</link>",
        name, mass, more);
  };
  const auto slide = [](const std::string& name, const std::string& parent,
                        const std::string& child, const std::string& axis) {
    return fmt::format(
        "<joint name=\"{}\" type=\"prismatic\"><parent link=\"{}\"/><child link=\"{}\"/>"
        "<axis xyz=\"{}\"/><limit lower=\"-9\" upper=\"9\" effort=\"9\" velocity=\"9\"/></joint>",
        name, parent, child, axis);
  };
  folder.write("cart.urdf",
               "<robot name=\"cart\"><link name=\"rail\"/>" + link("cart", 1.0, "") +
                   link("ball", 2.0,
                        "<collision><geometry><sphere radius=\"0.1\"/></geometry></collision>") +
                   slide("along", "rail", "cart", "1 0 0") + slide("up", "cart", "ball", "0 0 1") +
                   "</robot>");
  folder.write("cart.yaml", fmt::format("gravity: [0, 0, -9.81]\nground: {{friction: {0}, "
                                        "restitution: {1}}}\nmodels:\n  - {{urdf: cart.urdf, "
                                        "friction: {0}, restitution: {1}, dynamics: {{along: "
                                        "{{armature: 3}}}}}}\n",
                                        kFriction, kRestitution));
  folder.write("map.yaml",
               "columns: {up.q: z, along.v: vx, up.v: vz}\nafter: {along.v: ux, up.v: uz}\n");
  std::string csv = "z,vx,vz,ux,uz\n";
  for (int k = 0; k < 4; ++k) {
    const double vx = 1.0 + 0.2 * k, vz = -1.0 - 0.1 * k;
    const double impulse = 2.0 * (1.0 + kRestitution) * -vz;
    csv += fmt::format("0.1,{},{},{:.17g},{:.17g}\n", vx, vz, vx - kFriction * impulse / 6.0,
                       -kRestitution * vz);
  }
  folder.write("impacts.csv", csv);
  const nlohmann::json report =
      folder.report("compare {}/cart.yaml {}/impacts.csv --columns {}/map.yaml");
  ASSERT_EQ(report["recordings"].size(), 4u);
  // Contacts yield by their compliance, 1e-6 of an impulse.
  for (const nlohmann::json& one : report["recordings"]) EXPECT_LT(one["velocity_error_m_s"], 2e-5);
}

TEST(Compare, SaysWhatIsWrongInAMapOfImpacts) {
  const CommandFolder folder("compare_impact_map");
  record_impacts(folder, 0.08, 0.5);
  const auto expect = [&](const std::string& map, const std::string& more,
                          const std::string& part) {
    folder.write("map.yaml", map);
    folder.refuse("compare {}/ball.yaml {}/impacts.csv --columns {}/map.yaml " + more, part);
  };
  const std::string before = "columns: {ball/body.z: z}\n";
  expect(before + "after: {ball/body.z: z}\n", "", "map.yaml:2: 'ball/body.z'");
  expect(before + "after: {}\n", "", "expected 'after'");
  expect(before + "rate: 5\nafter: {ball/body.vz: uz}\n", "", "map.yaml:2: unknown key 'rate'");
  expect(before + "rate: 5\nskip: [bad]\n", "", "skip: is of impacts");
  expect(before + "after: {ball/body.vz: uz}\nskip: [z]\n", "", "no impact is left");
  expect(before + "after: {ball/body.vz: uz}\n", "--mode inverse", "takes no time");
  expect(before + "rate: 5\naverage: 4\n", "", "4 is even");
  expect(before + "rate: 5\npieces: 4\n", "", "two or more for each piece");
}

TEST(Compare, FindsRobotsInListedPackages) {
  const CommandFolder folder("compare_package");
  folder.write("scene.yaml", "models: [{urdf: package://ours/pendulum.urdf}]\n");
  folder.succeed("inspect {}/scene.yaml --package ours=data/robots");
  folder.refuse("inspect {}/scene.yaml", "--package ours=FOLDER");
}

/// Required bounds on the median over the recorded tosses.
constexpr double kTossPosition = 0.014;  // [m]
constexpr double kTossRotation = 14.0;   // [degrees]

TEST(Compare, PredictsRealCubeTosses) {
  const std::filesystem::path data = std::filesystem::path(test::shared_data()) / "cube_toss";
  if (!std::filesystem::exists(data)) {
    GTEST_SKIP() << "no " << data << "; set COUNTERPOINT_SHARED_DATA";
  }
  const CommandFolder folder("compare_tosses");
  const nlohmann::json report =
      folder.report("compare data/scenes/cube_toss.yaml " + data.string() +
                    "/toss_*.csv --columns data/maps/cube_toss.yaml");
  EXPECT_EQ(report["recordings"].size(), 52u);
  EXPECT_LT(report["median"]["position_error_mean_m"], kTossPosition);
  EXPECT_LT(report["median"]["rotation_error_mean_deg"], kTossRotation);
}

}  // namespace
}  // namespace counterpoint::compare_test
