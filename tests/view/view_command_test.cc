// `counterpoint view` and the option --view: their output, and messages about wrong files.
#include <gtest/gtest.h>

#include <string>

#include "apps/command.h"
#include "support/paths.h"
#include "view/replay.h"

namespace counterpoint::view_command_test {
namespace {

using test::CommandFolder;
using test::CommandResult;

const std::string kCube = "data/scenes/cube_drop.yaml";

class View : public testing::Test {
 protected:
  void SetUp() override {
    if (!view::can_make_pages()) GTEST_SKIP() << view::why_no_pages();
    ASSERT_EQ(folder_.run("simulate " + kCube + " --duration 0.3 --output {}/cube.csv").exit_code,
              0);
  }

  /// Expects exit code 2, a message, and neither a page nor a part of one.
  void expect_refused(const std::string& arguments, const std::string& message) const {
    const CommandResult result = folder_.run("view " + arguments + " --output {}/page.html");
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_NE(result.errors.find(message), std::string::npos) << result.errors;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path("")))
      EXPECT_FALSE(entry.path().filename().string().starts_with("page.html")) << entry.path();
  }

  CommandFolder folder_{"view_" + test::test_name()};
};

TEST_F(View, WritesAPageThatHoldsItsInputs) {
  const CommandResult result = folder_.run("view " + kCube +
                                           " {}/cube.csv --forces --output {}/page.html "
                                           "--json {}/r.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const std::string page = folder_.read("page.html");
  EXPECT_TRUE(page.starts_with("<!DOCTYPE html>"));
  const auto report = folder_.json("r.json");
  EXPECT_EQ(report["page_bytes"], page.size());
  EXPECT_EQ(report["frames"], 31);
  EXPECT_EQ(report["rows"], 151);
  EXPECT_EQ(report["bodies"], 1);
  EXPECT_GT(report["contact_forces"], 0);
  std::ifstream stream(test::source_dir() + "/docs/reference/json-reports.md");
  const std::string document{std::istreambuf_iterator<char>(stream), {}};
  for (const auto& [key, value] : report.items())
    EXPECT_NE(document.find('`' + key + '`'), std::string::npos) << key;
  for (const char* input : {"cube_drop.yaml", "cube.urdf", "cube.csv", "counterpoint view"})
    EXPECT_NE(page.find(input), std::string::npos) << input;
}

TEST_F(View, ForcesAreThoseOfTheInverse) {
  ASSERT_EQ(folder_.run("inverse " + kCube + " {}/cube.csv --contacts {}/contacts.csv").exit_code,
            0);
  for (const std::string how : {"--forces", "--contacts {}/contacts.csv"}) {
    const CommandResult result = folder_.run("view " + kCube + " {}/cube.csv " + how +
                                             " --rate 0 --output {}/page.html --json {}/r.json");
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_EQ(folder_.json("r.json")["frames"], 151);
  }
  const auto packed = [&](const std::string& how) {
    EXPECT_EQ(
        folder_.run("view " + kCube + " {}/cube.csv " + how + " --output {}/page.html").exit_code,
        0);
    const std::string page = folder_.read("page.html");
    const size_t begin = page.find("\"contacts\":{"), end = page.find("\"curves\"");
    EXPECT_NE(begin, std::string::npos);
    return page.substr(begin, end - begin);
  };
  EXPECT_EQ(packed("--forces"), packed("--contacts {}/contacts.csv"));
}

TEST_F(View, TheSameRunGivesTheSamePage) {
  const std::string line = "view " + kCube + " {}/cube.csv --output {}/page.html";
  ASSERT_EQ(folder_.run(line).exit_code, 0);
  const std::string first = folder_.read("page.html");
  ASSERT_EQ(folder_.run(line).exit_code, 0);
  EXPECT_EQ(folder_.read("page.html"), first);
}

TEST_F(View, RefusesWhatIsNoMotionOfTheScene) {
  expect_refused("data/scenes/pendulum.yaml {}/cube.csv", "cube.csv");
  expect_refused(kCube + " {}/missing.csv", "there is no such file");
  folder_.write("empty.csv", "");
  expect_refused(kCube + " {}/empty.csv", "empty");
  const std::string table = folder_.read("cube.csv");
  folder_.write("header.csv", table.substr(0, table.find('\n') + 1));
  expect_refused(kCube + " {}/header.csv", "no rows");
  std::string broken = table;
  const size_t row = broken.find('\n') + 1, cell = broken.find(',', broken.find(',', row) + 1) + 1;
  broken.replace(cell, broken.find(',', cell) - cell, "nan");
  folder_.write("nan.csv", broken);
  expect_refused(kCube + " {}/nan.csv", "nan.csv:2");
}

TEST_F(View, RefusesContactsOfAnotherMotion) {
  const std::string header = "time,geometry_a,geometry_b,x,y,z,nx,ny,nz,gap,fx,fy,fz\n";
  const auto expect = [&](const std::string& text, const std::string& message) {
    folder_.write("contacts.csv", text);
    expect_refused(kCube + " {}/cube.csv --contacts {}/contacts.csv", message);
  };
  expect("time,x\n", "geometry_a");
  expect(header + "0,ground,\"no, such\",0,0,0,0,0,1,0,0,0,1\n", "has no shape 'no, such'");
  expect(header + "0,ground,cube/0,0,0,0,0,0,1,0,0,0,nan\n", "contacts.csv:2");
  expect(header + "0,ground,cube/0,0,0\n", "5 cells");
}

TEST_F(View, RefusesAMeshThatIsGone) {
  folder_.write("gone.urdf",
                "<robot name='gone'><link name='a'><inertial><mass value='1'/><inertia ixx='1' "
                "iyy='1' izz='1' ixy='0' "
                "ixz='0' iyz='0'/></inertial><collision><geometry><mesh "
                "filename='gone.stl'/></geometry></collision>"
                "</link></robot>");
  expect_refused("{}/gone.urdf {}/cube.csv", "gone.stl");
}

TEST_F(View, AVisualMeshThatIsGoneIsANote) {
  folder_.write("looks.urdf",
                "<robot name='looks'><link name='a'><inertial><mass value='1'/><inertia ixx='1' "
                "iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"
                "<visual><geometry><mesh filename='gone.stl'/></geometry></visual>"
                "<visual><geometry><mesh filename='/etc/passwd'/></geometry></visual>"
                "<visual><geometry><box size='1 2 3'/></geometry></visual>"
                "<visual><geometry><sphere radius='nan'/></geometry></visual>"
                "<collision><geometry><sphere radius='0.1'/></geometry></collision>"
                "</link></robot>");
  ASSERT_EQ(folder_.run("simulate {}/looks.urdf --duration 0.1 --output {}/looks.csv").exit_code,
            0);
  const CommandResult result =
      folder_.run("view {}/looks.urdf {}/looks.csv --output {}/looks.html --json {}/looks.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto report = folder_.json("looks.json");
  EXPECT_EQ(report["visuals"], 1);
  ASSERT_EQ(report["notes"].size(), 3u);
  // The visuals of a robot's file may not access files outside its folder either.
  EXPECT_NE(result.errors.find("gone.stl"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("outside the robot's own folder"), std::string::npos);
}

TEST_F(View, RefusesWrongOptions) {
  expect_refused(kCube + " {}/cube.csv --webm 1,0,10", "--webm");
  expect_refused(kCube + " {}/cube.csv --webm 0,1,10 --size 101x100", "even");
  expect_refused(kCube + " {}/cube.csv --ghost-name a", "more names than ghosts");
  expect_refused(kCube + " {}/cube.csv --ghost {}/missing.csv", "there is no such file");
  expect_refused(kCube + " {}/cube.csv --forces --contacts {}/c.csv", "give one of them");
  expect_refused(kCube + " {}/cube.csv --size 10", "--size 10");
  expect_refused(kCube + " {}/cube.csv --gif 1,0,10", "--gif");
  expect_refused(kCube + " {}/cube.csv --rate -1", "--rate");
  const CommandResult result =
      folder_.run("view " + kCube + " {}/cube.csv --output {}/no/such/page.html");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.errors.find("cannot be written"), std::string::npos);
}

TEST_F(View, AFailureLeavesThePageThatWasThere) {
  folder_.write("old.html", "old");
  EXPECT_EQ(folder_.run("view " + kCube + " {}/missing.csv --output {}/old.html").exit_code, 2);
  EXPECT_EQ(folder_.read("old.html"), "old");
}

TEST_F(View, IsAnOptionOfOtherCommands) {
  const CommandResult plain =
      folder_.run("simulate " + kCube + " --duration 0.3 --json {}/plain.json");
  ASSERT_EQ(plain.exit_code, 0);
  ASSERT_EQ(
      folder_.run("simulate " + kCube + " --duration 0.3 --view {}/s.html --json {}/viewed.json")
          .exit_code,
      0);
  // The option does not change the simulation.
  EXPECT_EQ(folder_.json("plain.json")["state_hash"], folder_.json("viewed.json")["state_hash"]);
  ASSERT_EQ(folder_.run("inverse " + kCube + " {}/cube.csv --view {}/i.html").exit_code, 0);
  folder_.write("toss.csv",
                "t,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n0,0,0,1,1,0,0,0,0,0,0,0,0,0\n"
                "1,0,0,1,1,0,0,0,0,0,0,0,0,0\n2,0,0,1,1,0,0,0,0,0,0,0,0,0\n");
  const std::string compare =
      "compare data/scenes/cube_toss.yaml {}/toss.csv --columns data/maps/cube_toss.yaml ";
  ASSERT_EQ(folder_.run(compare + "--view {}/c.html").exit_code, 0);
  for (const char* page : {"s.html", "i.html", "c.html"})
    EXPECT_TRUE(folder_.read(page).starts_with("<!DOCTYPE html>")) << page;
  EXPECT_NE(folder_.read("c.html").find("\"recorded\""), std::string::npos);
  const CommandResult inverse = folder_.run(compare + "--mode inverse --view {}/none.html");
  EXPECT_EQ(inverse.exit_code, 2);
  EXPECT_NE(inverse.errors.find("--mode inverse"), std::string::npos) << inverse.errors;
}

TEST_F(View, ReportsOfCompareLinkTheWorst) {
  std::string recordings;
  for (int i = 0; i < 7; ++i) {
    const std::string end = std::to_string(2.0 + 0.1 * ((3 * i) % 7));  // hangs in the air
    folder_.write("toss" + std::to_string(i) + ".csv",
                  "t,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n0,0,0,1,1,0,0,0,0,0,0,0,0,0\n"
                  "1,0,0," +
                      end + ",1,0,0,0,0,0,0,0,0,0\n");
    recordings += "{}/toss" + std::to_string(i) + ".csv ";
  }
  const CommandResult result =
      folder_.run("compare data/scenes/cube_toss.yaml " + recordings +
                  "--columns data/maps/cube_toss.yaml --shown 5 --report {}/report");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const std::string index = folder_.read("report/index.html");
  // 3 i mod 7 is largest for i = 2 (6), then 4 (5), 6 (4), 1 (3), 3 (2).
  size_t last = 0;
  for (const int i : {2, 4, 6, 1, 3}) {
    const size_t at = index.find("toss" + std::to_string(i) + ".csv: to play</a>");
    ASSERT_NE(at, std::string::npos) << i;
    EXPECT_GT(at, last);
    last = at;
  }
  EXPECT_NE(folder_.read("report/replay4.html").find("toss3.csv"), std::string::npos);
  EXPECT_EQ(folder_.read("report/replay5.html"), "");
  // Recorded and simulated curves share a chart per coordinate: three of the position, four of the
  // quaternion.
  const std::string curves = folder_.read("report/recording4.html");
  EXPECT_NE(curves.find("href='replay4.html'"), std::string::npos);
  const auto count = [&](const std::string& words) {
    size_t found = 0;
    for (size_t at = 0; (at = curves.find(words, at)) != std::string::npos; ++at) ++found;
    return found;
  };
  EXPECT_EQ(count("<svg class='chart'"), 7u);
  EXPECT_EQ(count("data-name='recorded'"), 7u);
  EXPECT_EQ(count("data-name='simulated'"), 7u);
}

}  // namespace
}  // namespace counterpoint::view_command_test
