// Live sessions: what pages do is done, is recorded, and does no harm (docs/reference/live.md).
#include "live/session.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "apps/command.h"
#include "counterpoint/engine/trajectory.h"
#include "live/page.h"
#include "live/viewer.h"
#include "support/paths.h"
#include "view/replay.h"

namespace counterpoint::live::session_test {
namespace {

using counterpoint::test::CommandFolder;
using counterpoint::test::test_name;
using test::Json;
using test::Page;

/// A session that runs on a thread of its own until the end of the test.
class Running {
 public:
  explicit Running(const std::string& scene, SessionOptions options = {}) {
    options.scene_file = counterpoint::test::source_dir() + "/data/scenes/" + scene + ".yaml";
    options.scene_words = {options.scene_file};
    session_.emplace(load_scene(options.scene_file), options);
    thread_ = std::thread([&] { session_->run([&] { return stop_.load(); }); });
  }
  ~Running() { end(); }
  void end() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  const std::string& address() const { return session_->address(); }
  /// Not before end().
  const Session& session() const { return *session_; }

 private:
  std::optional<Session> session_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

class Live : public testing::Test {
 protected:
  void SetUp() override {
    if (!view::can_make_pages()) GTEST_SKIP() << view::why_no_pages();
    options_.paused = true;
  }
  /// Runs a recording's command again, and returns the last state hash of both motions.
  std::pair<std::string, std::string> repeated(const std::string& name) const {
    std::string command = folder_.read(name + ".txt");
    command = command.substr(std::string("counterpoint ").size());
    command.pop_back();  // the end of the line
    const auto result = folder_.run(command + " --output {}/again.csv");
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    const auto last = [&](const std::string& file) {
      const std::string text = folder_.read(file);
      return text.substr(text.rfind(',') + 1);  // the last cell of the last row
    };
    return {last(name + ".csv"), last("again.csv")};
  }
  static bool paused_at(const Json& status, double time) {
    return !status["playing"] && std::abs(status["time"].get<double>() - time) < 1e-9;
  }

  SessionOptions options_;
  CommandFolder folder_{"live_" + test_name()};
};

TEST_F(Live, ADragIsRepeatedToTheBitAndFoundByTheInverse) {
  options_.record = folder_.path("motion.csv");
  Running running("cube_drop", options_);
  Page page(running.address());
  page.send({{"do", "drag"}, {"body", 1}, {"point", {0.05, 0, 0.02}}, {"target", {0.3, 0.1, 2}}});
  page.send({{"do", "step"}, {"count", 200}});
  const Json held = page.status([](const Json& s) { return s["recording"]["steps"] == 200; });
  EXPECT_EQ(held["hand"]["body"], "cube");
  EXPECT_GT(held["hand"]["force_N"], 0.1);
  page.send({{"do", "release"}});
  page.send({{"do", "step"}, {"count", 100}});
  page.status([](const Json& s) { return s["recording"]["steps"] == 300; });
  running.end();
  const auto [first, again] = repeated("motion");
  EXPECT_EQ(first, again);
  const Json report =
      folder_.report("inverse data/scenes/cube_drop.yaml {}/motion.csv --unknown-wrenches");
  EXPECT_GT(report["applied_force_max"], 1.0);
  EXPECT_LT(report["applied_force_relative_error_max"], 1e-8);

  // Without knowing the wrench the inverse finds it as the force on the free body.
  const Scene& scene = running.session().simulator().scene();
  const Trajectory motion = read_trajectory(folder_.path("motion.csv"), scene.model);
  Workspace workspace(scene.model);
  Inverse inverse;
  double most = 0.0;
  for (int k = 0; k < motion.num_steps(); ++k) {
    Input known;
    step_inverse(scene.model, scene.options, motion.q.col(k), motion.v.col(k), motion.q.col(k + 1),
                 motion.v.col(k + 1), known, workspace, inverse);
    ASSERT_FALSE(inverse.fault.any());
    motion.set_known(scene.model, k, known);
    Force poke;
    if (!known.wrenches.empty()) poke = known.wrenches[0].wrench;
    const Quaternion turn(motion.q.col(k)[3], motion.q.col(k)[4], motion.q.col(k)[5],
                          motion.q.col(k)[6]);
    VectorX expected(6);
    expected << poke.force, turn.conjugate() * poke.torque;
    most = std::max(most, expected.norm());
    // 1e-8 of the forces that act: the weight, and the hand's.
    EXPECT_LT((inverse.applied_force - expected).norm(), 1e-8 * (inverse.force_scale + most))
        << "step " << k;
  }
  EXPECT_GT(most, 1.0);
}

TEST_F(Live, RestoresASavedStateToTheSameBits) {
  Running running("stack_5", options_);
  Page page(running.address());
  page.send({{"do", "step"}, {"count", 50}});
  page.send({{"do", "save"}});
  page.send({{"do", "step"}, {"count", 100}});
  page.status([](const Json& s) { return paused_at(s, 0.3); });
  const test::SeenFrame first = page.frame();
  page.send({{"do", "restore"}, {"slot", 0}});
  page.status([](const Json& s) { return paused_at(s, 0.1); });
  page.send({{"do", "step"}, {"count", 100}});
  page.status([](const Json& s) { return paused_at(s, 0.3); });
  running.end();
  Simulator simulator(load_scene(counterpoint::test::source_dir() + "/data/scenes/stack_5.yaml"));
  for (int k = 0; k < 150; ++k) simulator.step();
  EXPECT_EQ(state_hash(simulator.state()), state_hash(running.session().simulator().state()));
  EXPECT_EQ(first.counts[0], 6u);
  EXPECT_EQ(first.bytes, first.expected_bytes);
}

TEST_F(Live, ARewindAndAChangedStepBeginARecordingThatRepeats) {
  options_.record = folder_.path("motion.csv");
  Running running("pyramid_5", options_);
  Page page(running.address());
  page.send({{"do", "play"}});
  page.status([](const Json& s) { return s["time"] > 0.5; });
  page.send({{"do", "rewind"}, {"time", 0.25}});
  const Json there = page.status([](const Json& s) { return !s["playing"]; });
  EXPECT_LE(there["time"], 0.25);
  EXPECT_GT(there["time"], 0.2);
  page.send({{"do", "set"}, {"key", "time_step"}, {"value", 0.001}});
  page.send({{"do", "set"}, {"key", "contact.friction_model"}, {"value", "lagged"}});
  page.send({{"do", "drag"}, {"body", 2}, {"point", {0, 0, 0}}, {"target", {1, 0, 2}}});
  page.send({{"do", "step"}, {"count", 150}});
  const Json end = page.status([](const Json& s) { return s["recording"]["steps"] == 150; });
  EXPECT_EQ(end["settings"]["contact.friction_model"], "lagged");
  running.end();
  EXPECT_EQ(running.session().takes().file().filename(), "motion_4.csv");
  for (const char* name : {"motion", "motion_4"}) {
    const auto [first, again] = repeated(name);
    EXPECT_EQ(first, again) << name;
  }
}

TEST_F(Live, ManyStepsDoNotKeepTheRunFromEnding) {
  Running running("piles/pile_200", options_);
  Page page(running.address());
  page.send({{"do", "step"}, {"count", 1000}});
  page.send({{"do", "step"}, {"count", 1001}});
  page.status([](const Json& s) { return s["time"] > 0.0; });
  running.end();
  EXPECT_LT(running.session().steps(), 1000);
}

TEST_F(Live, SlidersMoveServosAndMotors) {
  Running running("arm7_servo", options_);
  Page page(running.address());
  const Json start = page.status([](const Json&) { return true; });
  page.send({{"do", "input"}, {"input", 2}, {"value", 0.5}});  // target and velocity of each servo
  page.send({{"do", "force"}, {"coordinate", 0}, {"value", 3.0}});
  page.send({{"do", "step"}, {"count", 10}});
  const Json moved = page.status([](const Json& s) { return s["time"] > 0.0; });
  EXPECT_EQ(moved["sliders"][1], 0.5);
  EXPECT_EQ(moved["sliders"][start["sliders"].size() / 2], 3.0);  // after the targets
  page.send({{"do", "input"}, {"input", 99}, {"value", 0.5}});
  EXPECT_NE(page.words().find("no such input"), std::string::npos);
  running.end();
  Simulator& simulator = const_cast<Simulator&>(running.session().simulator());
  EXPECT_EQ(simulator.input().servo_position[1], 0.5);
  EXPECT_EQ(simulator.input().applied_force[0], 3.0);
}

TEST_F(Live, ASwitchedClosureIsAttachedAndTheRecordingRepeats) {
  options_.record = folder_.path("grip.csv");
  Running running("suction_gripper", options_);
  Page page(running.address());
  const Json start = page.status([](const Json&) { return true; });
  ASSERT_EQ(start["sliders"], Json({-0.4, -0.45, 0.0, 0.0, 0.0, 0.0}));  // servos, motors, closures
  page.send({{"do", "input"}, {"input", 4}, {"value", 1}});  // after target and velocity of servos
  page.send({{"do", "step"}, {"count", 50}});
  EXPECT_EQ(page.status([](const Json& s) { return s["time"] > 0.0; })["sliders"],
            Json({-0.4, -0.45, 0.0, 0.0, 1.0, 0.0}));
  page.send({{"do", "input"}, {"input", 4}, {"value", 0}});
  page.send({{"do", "step"}, {"count", 50}});
  EXPECT_EQ(page.status([](const Json& s) { return s["time"] > 0.15; })["sliders"][4], 0.0);
  running.end();
  const auto [first, second] = repeated("grip");
  EXPECT_EQ(first, second);
}

TEST_F(Live, OnePageDrivesAndOthersMayTakeOver) {
  Running running("pendulum", options_);
  Page first(running.address());
  first.status([](const Json& s) { return s["driver"] == true; });
  Page second(running.address());
  second.status([](const Json& s) { return s["driver"] == false && s["clients"] == 2; });
  second.send({{"do", "step"}, {"count", 1}});
  EXPECT_NE(second.words().find("another page drives"), std::string::npos);
  second.send({{"do", "drive"}});
  second.status([](const Json& s) { return s["driver"] == true; });
  second.send({{"do", "step"}, {"count", 1}});
  second.status([](const Json& s) { return s["time"] > 0.0; });
  second.vanish();
  first.status([](const Json& s) { return s["driver"] == true && s["clients"] == 1; });
}

TEST_F(Live, WrongMessagesChangeNothing) {
  Running running("cube_drop", options_);
  Page page(running.address());
  for (const char* message :
       {"",
        "{",
        "[1, 2]",
        "7",
        "null",
        "{}",
        R"({"do": 3})",
        R"({"do": "format"})",
        R"({"do": "step"})",
        R"({"do": "step", "count": -1})",
        R"({"do": "step", "count": 1.5})",
        R"({"do": "step", "count": "1"})",
        R"({"do": "speed", "value": 0})",
        R"({"do": "speed", "value": 1e999})",
        R"({"do": "restore", "slot": 0})",
        R"({"do": "drag", "body": 0, "point": [0, 0, 0], "target": [0, 0, 0]})",
        R"({"do": "drag", "body": 2, "point": [0, 0, 0], "target": [0, 0, 0]})",
        R"({"do": "drag", "body": 1, "point": [0, 0], "target": [0, 0, 0]})",
        R"({"do": "drag", "body": 1, "point": [0, 0, "x"], "target": [0, 0, 0]})",
        R"({"do": "force", "coordinate": 6, "value": 1})",
        R"({"do": "set", "key": "time_step", "value": 0})",
        R"({"do": "set", "key": "time_step", "value": "[[[["})",
        R"({"do": "set", "key": "time_step.x", "value": 1})",
        R"({"do": "set", "key": "..", "value": 1})",
        R"({"do": "set", "key": "", "value": 1})",
        R"({"do": "set", "key": "duration", "value": 1})",
        R"({"do": "set", "key": "step_control", "value": "{tolerance: 1}"})",
        R"({"do": "set", "key": "models", "value": "[]"})",
        R"({"do": "record", "on": true})"}) {
    page.send(std::string(message));
    EXPECT_FALSE(page.words().empty()) << message;
  }
  page.send(std::string(kMaxMessage / 2, '['));
  EXPECT_FALSE(page.words().empty());
  running.end();
  const Simulator& simulator = running.session().simulator();
  EXPECT_EQ(simulator.options(), simulator.scene().options);
  EXPECT_EQ(simulator.state().time, 0.0);
}

TEST_F(Live, TheGhostIsTheSceneAtAQuarterOfTheStep) {
  Running running("double_pendulum", options_);
  Page page(running.address());
  page.send({{"do", "step"}, {"count", 10}});
  page.send({{"do", "ghost"}, {"on", true}});
  page.send({{"do", "force"}, {"coordinate", 0}, {"value", 0.5}});
  page.send({{"do", "step"}, {"count", 100}});
  const Json seen = page.status([](const Json& s) {
    return s["ghost"]["on"] && s["ghost"]["distance_m"] > 0.0 &&
           std::abs(s["ghost"]["behind"].get<double>()) < 1e-9;
  });
  running.end();
  // The same by hand.
  const Scene scene =
      load_scene(counterpoint::test::source_dir() + "/data/scenes/double_pendulum.yaml");
  Simulator coarse(scene), fine(scene);
  for (int k = 0; k < 10; ++k) coarse.step();
  fine.set_state(coarse.state());
  fine.options().time_step = coarse.options().time_step / 4;
  for (Simulator* one : {&coarse, &fine}) {
    one->input().applied_force = VectorX::Zero(scene.model.nv());
    one->input().applied_force[0] = 0.5;
  }
  for (int k = 0; k < 100; ++k) coarse.step();
  for (int k = 0; k < 400; ++k) fine.step();
  const auto a = body_poses(scene.model, coarse.state().q),
             b = body_poses(scene.model, fine.state().q);
  double distance = 0.0;
  for (size_t i = 1; i < a.size(); ++i)
    distance = std::max(distance, (a[i].translation - b[i].translation).norm());
  EXPECT_EQ(seen["ghost"]["distance_m"], distance);
}

TEST_F(Live, FramesHaveTheSensorsOfTheScene) {
  Running running("sensors", options_);
  Page page(running.address());
  page.send({{"do", "step"}, {"count", 20}});
  page.status([](const Json& s) { return s["time"] > 0.0; });
  const test::SeenFrame seen = page.frame();
  running.end();
  Simulator simulator(load_scene(counterpoint::test::source_dir() + "/data/scenes/sensors.yaml"));
  State before;
  for (int k = 0; k < 20; ++k) {
    before = simulator.state();
    simulator.step();
  }
  SensorTable table(simulator.model(), simulator.options());
  VectorX values(table.size());
  const State& after = simulator.state();
  table.evaluate({before.q, before.v, after.q, after.v, Input{}, simulator.options().time_step},
                 values);
  ASSERT_GE(static_cast<int>(seen.curves.size()), table.size());
  for (int i = 0; i < table.size(); ++i) {
    const float at = seen.curves[seen.curves.size() - static_cast<size_t>(table.size() - i)];
    if (std::isnan(values[i]))
      EXPECT_TRUE(std::isnan(at));
    else
      EXPECT_EQ(at, static_cast<float>(values[i])) << table.columns()[static_cast<size_t>(i)].name;
  }
}

TEST_F(Live, AViewerShowsStatesAndWaitsForNobody) {
  Viewer viewer(load_scene(counterpoint::test::source_dir() + "/data/scenes/stack_5.yaml"));
  Simulator simulator(load_scene(counterpoint::test::source_dir() + "/data/scenes/stack_5.yaml"));
  EXPECT_FALSE(viewer.due());
  viewer.show(simulator.state());  // nobody looks
  Page page(viewer.address());
  while (!viewer.due()) std::this_thread::yield();
  for (int k = 0; k < 10; ++k) simulator.step();
  viewer.show(simulator.state());
  const test::SeenFrame seen = page.frame();
  EXPECT_EQ(seen.time, simulator.state().time);
  const auto& contacts = simulator.last_forces().contacts;
  EXPECT_EQ(seen.counts[2], std::count_if(contacts.begin(), contacts.end(),
                                          [](const auto& c) { return c.force.norm() > 0.0; }));
  EXPECT_FALSE(viewer.due()) << "the next frame is due after a 60th of a second";
  page.vanish();
  while (viewer.pages() > 0) std::this_thread::yield();
  viewer.show(simulator.state(), true);
}

TEST_F(Live, SimulateShowsItsRunAndEndsAsWithout) {
  const auto shown =
      folder_.run("simulate data/scenes/cube_drop.yaml --duration 0.2 --live --json {}/a");
  EXPECT_EQ(shown.exit_code, 0);
  EXPECT_TRUE(shown.errors.starts_with("http://127.0.0.1:")) << shown.errors;
  folder_.succeed("simulate data/scenes/cube_drop.yaml --duration 0.2 --json {}/b");
  EXPECT_EQ(folder_.json("a")["state_hash"], folder_.json("b")["state_hash"]);
}

TEST_F(Live, AScenesOptionIsSetByItsKey) {
  folder_.succeed(
      "simulate data/scenes/cube_drop.yaml --duration 0.2 --option time_step=0.001 "
      "--option contact=fast --option contact.compliance=0.01 --json {}/a");
  EXPECT_EQ(folder_.json("a")["steps"], 200);
  folder_.refuse("simulate data/scenes/cube_drop.yaml --option time_step", "KEY=VALUE");
  folder_.refuse("simulate data/scenes/cube_drop.yaml --option time_step=fast", "time_step");
  folder_.refuse("simulate data/scenes/cube_drop.yaml --option effects.magic=on", "magic");
}

TEST_F(Live, AStepThatFailsIsReportedAndTheStateKept) {
  Running running("cube_drop", options_);
  Page page(running.address());
  page.send({{"do", "set"}, {"key", "max_speed"}, {"value", 1e-3}});
  page.send({{"do", "step"}, {"count", 5}});
  const Json failed = page.status([](const Json& s) { return s["fault"] != ""; });
  EXPECT_EQ(failed["time"], 0.0);
  page.send({{"do", "set"}, {"key", "max_speed"}, {"value", "none"}});
  page.send({{"do", "step"}, {"count", 5}});
  page.status([](const Json& s) { return s["fault"] == "" && paused_at(s, 0.01); });
}

}  // namespace
}  // namespace counterpoint::live::session_test
