// `counterpoint derivatives`: agreement with finite differences, and the table of matrices.
#include <gtest/gtest.h>

#include "apps/command.h"
#include "support/paths.h"

namespace counterpoint::derivatives_test {
namespace {

using test::CommandFolder;
using test::CommandResult;

TEST(DerivativesCommand, HoldsThemAgainstDifferences) {
  const CommandFolder folder("derivatives");
  const std::string scene = test::source_dir() + "/data/scenes/quadruped_drop.yaml";
  ASSERT_EQ(folder.run("simulate " + scene + " --duration 0.3 --output {}/t.csv").exit_code, 0);
  const CommandResult result =
      folder.run("derivatives " + scene +
                 " {}/t.csv --check --smoothing 1e-3 --compliance 1e-2 --json {}/d.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json report = folder.json("d.json");
  EXPECT_EQ(report["steps"], 150);
  EXPECT_EQ(report["steps_by_differences"], 0);
  // A finite difference across a kink of the contact law is wrong; 1e-5 was measured.
  EXPECT_LT(report["relative_difference_max"], 1e-3);
}

TEST(DerivativesCommand, WritesEveryMatrixOfTheFirstStep) {
  const CommandFolder folder("derivatives_table");
  const std::string scene = test::source_dir() + "/data/scenes/arm7.yaml";
  const CommandResult result =
      folder.run("derivatives " + scene + " --check --forward --output {}/d.csv --json {}/d.json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json report = folder.json("d.json");
  EXPECT_LT(report["relative_difference_max"], 1e-7);
  EXPECT_EQ(report["singular_steps"], 0);
  // Nine matrices of seven rows, and the line of names.
  const std::string table = folder.read("d.csv");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 1 + 9 * 7);
}

}  // namespace
}  // namespace counterpoint::derivatives_test
