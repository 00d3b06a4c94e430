// The replay of `control`: the motion, its plans as ghosts, and curves of the planner.
#include <gtest/gtest.h>

#include <map>
#include <regex>

#include "apps/command.h"
#include "view/replay.h"

namespace counterpoint::test::control_replay_test {
namespace {

/// Data of a replay page.
nlohmann::json page_data(const std::string& page) {
  const std::string begin = "id=\"replay-data\">";
  const std::size_t at = page.find(begin) + begin.size();
  return nlohmann::json::parse(page.substr(at, page.find("</script>", at) - at));
}

/// The bundled walk at 0.375 m/s along x and no other speed, with plans of 0.5 s, made every 20 ms.
std::string walk() {
  const std::string root = source_dir() + "/data/scenes/";
  std::ifstream file(root + "control/quadruped_walk.yaml");
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::pair<std::string, std::string> changes[] = {
      {"\\.\\./optimize/", root + "optimize/"},
      {"\ntime_step: .*", "\ntime_step: 0.05"},
      {"\nsteps: .*", "\nsteps: 10"},
      {"target: \\{trunk.vx: [0-9.]+\\}", "target: {trunk.vx: 0.375}"},
      {"\ncontrol:", "\ncontrol:\n  replan_interval: 0.02"}};
  for (const auto& [from, to] : changes) text = std::regex_replace(text, std::regex(from), to);
  return text;
}

// There are 11 replans in 0.21 s. A curve's offset is its smallest value.
TEST(ControlReplay, ShowsThePlansBesideTheMotion) {
  if (!view::can_make_pages()) GTEST_SKIP() << view::why_no_pages();
  const CommandFolder folder("control_view");
  folder.write("walk.yaml", walk());
  folder.run("control {}/walk.yaml --duration 0.21 --view {}/walk.html");
  const nlohmann::json data = page_data(folder.read("walk.html"));
  ASSERT_EQ(data["motions"].size(), 3u);
  EXPECT_EQ(data["motions"][1]["name"], "plan, 0.5 s ahead");
  EXPECT_EQ(data["motions"][1]["frames"], 11);
  EXPECT_EQ(data["motions"][2]["name"], "plan, 0.25 s ahead");
  std::map<std::string, double> lowest;
  for (const nlohmann::json& curve : data["curves"]["list"])
    lowest[curve["group"].get<std::string>() + "/" + curve["label"].get<std::string>()] =
        curve["offset"].get<double>();
  EXPECT_EQ(lowest.at("commanded speed: trunk.vx/commanded"), 0.375);
  EXPECT_EQ(lowest.count("commanded speed: trunk.vy/commanded"), 0u);
  EXPECT_EQ(lowest.at("replan time/interval"), 20.0);
  EXPECT_GT(lowest.at("replan time/replan"), 0.0);
  EXPECT_GT(lowest.at("cost of the plan/"), 0.0);
  const nlohmann::json shown = {"commanded speed: trunk.vx", "replan time", "cost of the plan"};
  for (const nlohmann::json& group : shown)
    EXPECT_EQ(std::count(data["shown_curves"].begin(), data["shown_curves"].end(), group), 1);
}

}  // namespace
}  // namespace counterpoint::test::control_replay_test
