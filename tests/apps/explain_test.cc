// `counterpoint explain` on a recording with added noise: forces, tables, report and error
// messages.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "apps/command.h"
#include "support/paths.h"

namespace counterpoint::explain_test {
namespace {

using test::CommandFolder;
using test::CommandResult;

constexpr double kWeight = 9.80665;  // weight of the cube [N]
constexpr int kThinning = 5;         // rows 2 ms apart become a recording at 100 Hz
constexpr double kNoise = 1e-3;      // [m, rad]

/// A table of numbers and text, by column.
struct Cells {
  std::vector<std::string> columns;
  std::vector<std::map<std::string, std::string>> rows;

  explicit Cells(const std::string& csv) {
    std::istringstream lines(csv);
    for (std::string line; std::getline(lines, line);) {
      std::vector<std::string> cells;
      std::istringstream parts(line);
      for (std::string part; std::getline(parts, part, ',');) cells.push_back(part);
      if (columns.empty()) {
        columns = cells;
        continue;
      }
      cells.resize(columns.size());
      std::map<std::string, std::string>& row = rows.emplace_back();
      for (std::size_t i = 0; i < columns.size(); ++i) row[columns[i]] = cells[i];
    }
  }

  bool has(const std::string& column) const {
    return std::find(columns.begin(), columns.end(), column) != columns.end();
  }
  double number(std::size_t row, const std::string& column) const {
    return std::stod(rows.at(row).at(column));
  }
};

constexpr std::array kPose{"x", "y", "z", "qw", "qx", "qy", "qz"};

/// Records a cube that slides over the ground from 3 m/s, sampled at 100 Hz with white noise, and
/// the noise-free force of the ground.
void record(const CommandFolder& folder, double noise = kNoise) {
  folder.write(
      "box.yaml",
      "time_step: 0.002\nduration: 0.5\ngravity: [0, 0, -9.80665]\n"
      "ground: {friction: 0.5}\nmodels:\n"
      "  - {name: box, box: [0.1, 0.1, 0.1], mass: 1, friction: 0.5, position: [0, 0, 0.1],\n"
      "     velocity: {linear: [3, 0, 0]}}\n");
  folder.succeed("simulate {}/box.yaml --output {}/true.csv");
  const Cells motion(folder.read("true.csv"));
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  std::string csv = "t";
  for (const char* name : kPose) csv += fmt::format(",{}", name);
  csv += ",plate\n";
  for (std::size_t row = 0; row < motion.rows.size(); row += kThinning) {
    csv += motion.rows[row].at("time");
    for (const char* name : kPose) {
      // The cube keeps its orientation, so the vector part of q is half the rotation vector of the
      // noise.
      const bool real = name == std::string("qw");
      const double scale = real ? 0.0 : name[0] == 'q' ? 0.5 * noise : noise;
      csv += fmt::format(",{:.9g}", motion.number(row, std::string("box/body.") + name) +
                                        scale * normal(generator));
    }
    csv += fmt::format(",{}\n", kWeight);
  }
  folder.write("recording.csv", csv);
}

std::string column_map(const std::string& more) {
  std::string map = "time: t\ncolumns:\n";
  for (const char* name : kPose) map += fmt::format("  box/body.{0}: {0}\n", name);
  return map + more;
}

constexpr const char* kPlate = "contact_forces:\n  plate: {links: [box/body], z: plate}\n";

/// Explains the recording and writes every output file.
CommandResult explained(const CommandFolder& folder, const std::string& more = "") {
  return folder.run(
      "explain {}/box.yaml {}/recording.csv --columns {}/map.yaml --output {}/motion.csv "
      "--contacts {}/contacts.csv --forces {}/forces.csv --json {}/r.json " +
      more);
}

/// Expects every key of a report, at any depth, to be named in docs/reference/json-reports.md.
void expect_documented(const nlohmann::json& report) {
  static const std::string document = [] {
    std::ifstream stream(test::source_dir() + "/docs/reference/json-reports.md");
    return std::string(std::istreambuf_iterator<char>(stream), {});
  }();
  if (report.is_array())
    for (const nlohmann::json& one : report) expect_documented(one);
  if (!report.is_object()) return;
  for (const auto& [key, value] : report.items()) {
    EXPECT_NE(document.find('`' + key + '`'), std::string::npos) << key;
    expect_documented(value);
  }
}

TEST(Explain, TheGroundCarriesABoxThatSlides) {
  const CommandFolder folder("explain_box");
  record(folder);
  folder.write("map.yaml", column_map(kPlate));
  const CommandResult result = explained(folder, "--errors white --report {}/page");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  // The last lines summarize the result in a sentence.
  const std::size_t last = result.output.rfind('\n', result.output.size() - 2);
  EXPECT_NE(result.output.find("the ground carries ", last), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("not explained", last), std::string::npos) << result.output;

  const nlohmann::json report = folder.json("r.json");
  EXPECT_EQ(report["status"], "ok");
  ASSERT_EQ(report["recordings"].size(), 1u);
  const nlohmann::json& entry = report["recordings"][0];
  EXPECT_EQ(entry["errors"], "white");
  EXPECT_EQ(entry["rows"], 51);
  EXPECT_EQ(entry["support"], "ground");
  EXPECT_NEAR(entry["weight_N"], kWeight, 1e-9);
  // Expected result: the ground carries the box. The second difference of 1 mm of noise alone is
  // 2.5 weights.
  EXPECT_NEAR(entry["carried"], 1.0, 0.06);
  EXPECT_LT(entry["unexplained_mean"], 0.05);
  ASSERT_EQ(entry["contact_forces"].size(), 1u);
  EXPECT_EQ(entry["contact_forces"][0]["name"], "plate.contact.fz");
  EXPECT_EQ(entry["contact_forces"][0]["rows"], 49);
  EXPECT_LT(entry["contact_forces"][0]["rms_weights"], 0.4);

  expect_documented(report);

  const std::string page = folder.read("page/index.html");
  EXPECT_NE(page.find("plate: contact force, vertical"), std::string::npos);
  EXPECT_NE(page.find("class='band'"), std::string::npos);
}

TEST(Explain, TablesHoldMotionContactsAndForces) {
  const CommandFolder folder("explain_tables");
  record(folder);
  folder.write("map.yaml", column_map(kPlate));
  ASSERT_EQ(explained(folder, "--errors white --from 0.1 --to 0.3").exit_code, 0);

  const Cells motion(folder.read("motion.csv"));
  ASSERT_EQ(motion.rows.size(), 21u);
  EXPECT_NEAR(motion.number(0, "time"), 0.1, 1e-12);
  EXPECT_NEAR(motion.number(0, "time_step"), 0.01, 1e-12);
  EXPECT_EQ(motion.rows.back().at("time_step"), "");
  // A trajectory that the engine did not make has no hash, and inverse reports a doubt.
  EXPECT_FALSE(motion.has("state_hash"));
  EXPECT_NE(folder.report("inverse {}/box.yaml {}/motion.csv")["doubt"], "");

  const Cells contacts(folder.read("contacts.csv"));
  ASSERT_GT(contacts.rows.size(), 10u);
  for (std::size_t row = 0; row < contacts.rows.size(); ++row) {
    EXPECT_EQ(contacts.rows[row].at("geometry_b"), "ground");
    EXPECT_GT(contacts.number(row, "normal"), 0.0);
    // The box drags the ground along and decelerates at g / 2. Smoothed friction stays slightly
    // below its limit.
    const double normal = contacts.number(row, "normal");
    EXPECT_NEAR(contacts.number(row, "fx"), 0.5 * normal, 0.1 * normal);
    EXPECT_NEAR(contacts.number(row, "fz"), -normal, 0.02 * normal);
    EXPECT_NEAR(contacts.number(row, "slip"), 3.0 - 4.903 * contacts.number(row, "time"), 0.3);
    EXPECT_TRUE(contacts.has("sliding"));
    EXPECT_NEAR(contacts.number(row, "z"), 0.0, 0.01);
  }

  const Cells forces(folder.read("forces.csv"));
  ASSERT_EQ(forces.rows.size(), 21u);
  for (const char* column :
       {"box/body.fx", "box/body.tz.sd", "plate.contact.fz", "plate.contact.fz.sd",
        "plate.contact.x", "plate.contact.fz.measured", "box/body.contact.fx"})
    EXPECT_TRUE(forces.has(column)) << column;
  EXPECT_FALSE(forces.has("plate.contact.fx.measured"));
  EXPECT_EQ(forces.rows.front().at("plate.contact.fz"), "");
  EXPECT_DOUBLE_EQ(forces.number(0, "plate.contact.fz.measured"), kWeight);
  EXPECT_DOUBLE_EQ(forces.number(10, "plate.contact.fz"), forces.number(10, "box/body.contact.fz"));
}

TEST(Explain, SeveralRecordingsShareTablesAndHaveMotionsOfTheirOwn) {
  const CommandFolder folder("explain_several");
  record(folder);
  folder.write("map.yaml", column_map(""));
  const CommandResult result = explained(folder, "{}/recording.csv --to 0.2");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(folder.json("r.json")["recordings"].size(), 2u);
  EXPECT_EQ(Cells(folder.read("motion_1.csv")).rows.size(), 21u);
  EXPECT_EQ(folder.read("motion_1.csv"), folder.read("motion_2.csv"));
  const Cells forces(folder.read("forces.csv"));
  EXPECT_EQ(forces.columns[0], "recording");
  EXPECT_EQ(forces.rows.size(), 42u);
  EXPECT_EQ(Cells(folder.read("contacts.csv")).columns[0], "recording");
}

TEST(Explain, SaysWhereNothingExplainsTheMotion) {
  const CommandFolder folder("explain_air");
  record(folder);
  folder.write("map.yaml", column_map(""));
  // Without ground the box is unsupported.
  const CommandResult result = explained(folder, "--set height=-1 --errors white");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.errors.find("recording.csv"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("box/body."), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find(" s in "), std::string::npos) << result.errors;
  EXPECT_EQ(folder.json("r.json")["status"], "doubtful");
  EXPECT_EQ(Cells(folder.read("motion.csv")).rows.size(), 51u);
}

TEST(Explain, SaysWhatIsWrongWithMapsAndRecordings) {
  const CommandFolder folder("explain_refusals");
  record(folder);
  const auto expect = [&](const std::string& map, const std::string& more,
                          const std::string& part) {
    folder.write("map.yaml", map);
    const CommandResult result = explained(folder, more);
    EXPECT_EQ(result.exit_code, 2) << map << more;
    EXPECT_NE(result.errors.find(part), std::string::npos) << result.errors;
  };
  expect(column_map("deviations: {box/body.height: 1}\n"), "",
         "'box/body.height' is no coordinate");
  expect(column_map("deviations: {box/body.x: -1}\n"), "", "-1 is not positive");
  expect(column_map("deviations: {box/body.vx: 1}\n"), "", "'box/body.vx' is a velocity");
  expect(column_map("contact_forces: {plate: {z: plate}}\n"), "", "expected 'links'");
  expect(column_map("contact_forces: {plate: {links: [foot], z: plate}}\n"), "",
         "'foot' is no link of this scene");
  expect("time: t\ncolumns: {box/body.vx: x}\n", "", "names no position");
  expect(column_map(""), "--to 0.05", "6 rows; 12 or more");
  expect(column_map(""), "--from 2", "no row of");
  expect("columns: {box/body.x: x}\nafter: {box/body.vx: x}\n", "", "an impact takes no time");
}

TEST(Explain, RowsThatAreNotEvenlySpacedAreInterpolated) {
  const CommandFolder folder("explain_uneven");
  record(folder);
  std::string csv = folder.read("recording.csv");
  // Removes the twentieth row.
  std::size_t line = 0;
  for (int k = 0; k < 20; ++k) line = csv.find('\n', line) + 1;
  csv.erase(line, csv.find('\n', line) + 1 - line);
  folder.write("recording.csv", csv);
  folder.write("map.yaml", column_map(kPlate));
  const CommandResult result = explained(folder);
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(folder.json("r.json")["recordings"][0]["rows"], 51);
  EXPECT_EQ(Cells(folder.read("forces.csv")).rows.size(), 51u);
}

}  // namespace
}  // namespace counterpoint::explain_test
