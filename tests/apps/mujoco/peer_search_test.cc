// hard-cases --peers search finds settings of MuJoCo that suit a case.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "apps/command.h"
#include "peers/mujoco.h"

namespace counterpoint::peers::peer_search_test {
namespace {

class PeerSearchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (mujoco_version().empty()) GTEST_SKIP() << "MuJoCo was not found when this was built";
  }

  /// The entries of MuJoCo default and MuJoCo best of a case.
  nlohmann::json peers(const std::string& arguments) const {
    const std::string line = "hard-cases " + arguments + " --json {}/r.json --report {}/page";
    folder_.succeed(line);
    return folder_.json("r.json")["cases"][0]["peers"];
  }
  static long passed(const nlohmann::json& peer) {
    return std::count_if(peer["checks"].begin(), peer["checks"].end(),
                         [](const nlohmann::json& check) { return check["passed"].get<bool>(); });
  }

  test::CommandFolder folder_{"peer_search"};
};

TEST_F(PeerSearchTest, IsAtLeastAsGoodAsTheFixedSettings) {
  const nlohmann::json fixed = peers("--only sliding_stop");
  const nlohmann::json found = peers("--only sliding_stop --peers search");
  EXPECT_FALSE(fixed[1].contains("settings_tried"));
  EXPECT_EQ(fixed[0]["settings"], "defaults");
  EXPECT_EQ(found[0]["settings"], "defaults");
  EXPECT_GE(passed(found[1]), std::max(passed(fixed[0]), passed(fixed[1])));
  if (passed(found[1]) < static_cast<long>(found[1]["checks"].size())) {
    EXPECT_GE(found[1]["settings_tried"], 20);
  }
  const std::string page = folder_.read("page/hard-cases.md");
  EXPECT_NE(page.find("| sliding_stop | " + found[1]["settings"].get<std::string>() + " |"),
            std::string::npos);
}

TEST_F(PeerSearchTest, EndsAtTheFirstSettingsThatPass) {
  const nlohmann::json found = peers("--only coin --peers search");
  ASSERT_EQ(found[1]["status"], "passed");
  EXPECT_GT(found[1]["settings_tried"], 1);
  EXPECT_LT(found[1]["settings_tried"], 20);
}

TEST_F(PeerSearchTest, DoesNotSearchWhereMujocoLacksAFeature) {
  const nlohmann::json found = peers("--only bouncing --peers search");
  EXPECT_EQ(found[1]["status"], "not run");
  EXPECT_EQ(found[1]["settings_tried"], 1);
}

}  // namespace
}  // namespace counterpoint::peers::peer_search_test
