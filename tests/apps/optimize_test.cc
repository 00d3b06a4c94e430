// `counterpoint optimize` as a user runs it.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "apps/command.h"
#include "support/paths.h"

namespace counterpoint::optimize_test {
namespace {

constexpr const char* kAcrobot = "optimize data/scenes/optimize/acrobot.yaml --quiet ";

TEST(OptimizeCommand, WritesMotionReportAndFigures) {
  const test::CommandFolder folder("optimize");
  const test::CommandResult result =
      folder.run(std::string(kAcrobot) +
                 "--output {}/m.csv --report {}/page --feedback {}/gains.csv --json {}/r.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json report = folder.json("r.json");
  EXPECT_EQ(report["status"], "ok");
  EXPECT_LT(report["unactuated_force_relative_max"], 1e-3);
  EXPECT_LT(report["forward_check_max"], 1e-8);
  EXPECT_NE(folder.read("page/index.html").find("<svg"), std::string::npos);
  EXPECT_NE(folder.read("page/iterations.csv").find("smoothing_m"), std::string::npos);
  std::ifstream stream(test::source_dir() + "/docs/reference/json-reports.md");
  const std::string document{std::istreambuf_iterator<char>(stream), {}};
  for (const auto& [key, value] : report.items())
    EXPECT_NE(document.find('`' + key + '`'), std::string::npos) << key;

  // The plan is a motion of the engine: simulating its forces from its start reaches its end.
  const test::CommandResult followed = folder.run(
      "simulate data/scenes/optimize/scenes/acrobot.yaml --follow {}/m.csv --json {}/s.json");
  ASSERT_EQ(followed.exit_code, 0) << followed.errors;
  // The upright pose is unstable: round-off of 1e-16 and forces of 1e-11 N m grow by e^(4/s 2 s).
  EXPECT_LT(folder.json("s.json")["follow_error_max"], 1e-6);
}

TEST(OptimizeCommand, GoesOnWhereItWasStopped) {
  const test::CommandFolder folder("optimize_resume");
  const std::string output = "--output {}/m.csv --json {}/r.json ";
  EXPECT_EQ(folder.run(std::string(kAcrobot) + output + "--iterations 90").exit_code, 1);
  const double cost = folder.json("r.json")["cost"];
  folder.succeed(std::string(kAcrobot) + output + "--resume");
  EXPECT_LT(folder.json("r.json")["iterations"], 90);
  EXPECT_GT(cost, 0.0);
}

TEST(OptimizeCommand, RefusesNonsense) {
  const test::CommandFolder folder("optimize_bad");
  folder.write("p.yaml", "scene: none.yaml\nsteps: 10\nterms: []\n");
  EXPECT_EQ(folder.run("optimize {}/p.yaml").exit_code, 2);
  EXPECT_EQ(folder.run(std::string(kAcrobot) + "--resume").exit_code, 2);
  EXPECT_EQ(folder.run(std::string(kAcrobot) + "--frames 2").exit_code, 2);
}

}  // namespace
}  // namespace counterpoint::optimize_test
