// `counterpoint derivatives`: agreement with finite differences, and the table of matrices.
#include <gtest/gtest.h>

#include "apps/command.h"
#include "support/paths.h"

namespace counterpoint::derivatives_test {
namespace {

using test::CommandFolder;

TEST(DerivativesCommand, HoldsThemAgainstDifferences) {
  const CommandFolder folder("derivatives");
  const std::string scene = test::source_dir() + "/data/scenes/quadruped_drop.yaml";
  folder.succeed("simulate " + scene + " --duration 0.3 --output {}/t.csv");
  const nlohmann::json report = folder.report(
      "derivatives " + scene + " {}/t.csv --check --smoothing 1e-3 --compliance 1e-2");
  EXPECT_EQ(report["steps"], 150);
  EXPECT_EQ(report["steps_by_differences"], 0);
  // A finite difference across a kink of the contact law is wrong; 1e-5 was measured.
  EXPECT_LT(report["relative_difference_max"], 1e-3);
}

TEST(DerivativesCommand, WritesEveryMatrixOfTheFirstStep) {
  const CommandFolder folder("derivatives_table");
  const std::string scene = test::source_dir() + "/data/scenes/arm7.yaml";
  const nlohmann::json report =
      folder.report("derivatives " + scene + " --check --forward --output {}/d.csv");
  EXPECT_LT(report["relative_difference_max"], 1e-7);
  EXPECT_EQ(report["singular_steps"], 0);
  // Nine matrices of seven rows, and the line of names.
  EXPECT_EQ(folder.lines("d.csv"), 1 + 9 * 7);
}

}  // namespace
}  // namespace counterpoint::derivatives_test
