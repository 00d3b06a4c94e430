// Content of replays: poses and forces within their resolution, no markup, and no more bytes than
// promised (docs/reference/replay.md).
#include "view/replay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "counterpoint/engine/simulator.h"
#include "support/paths.h"
#include "support/temp_folder.h"
#include "view/stream_reader.h"

namespace counterpoint::view::replay_test {
namespace {

using Json = nlohmann::json;

const std::string kScenes = test::source_dir() + "/data/scenes/";

/// Replay of a simulated motion.
Replay simulated(const Scene& scene, double duration, double rate = kDefaultRate) {
  Simulator simulator(scene);
  ClipRecorder recorder(scene, rate, true);
  const double h = scene.options.time_step;
  for (int k = 0; k < std::lround(duration / h); ++k) {
    const State before = simulator.state();
    EXPECT_TRUE(simulator.step().succeeded());
    recorder.add_step(before, simulator.input(), h, simulator.state());
  }
  Replay replay;
  replay.title = scene.name;
  replay.scene = &scene;
  replay.clip = recorder.finish(simulator.state());
  return replay;
}

/// Poses by frame and body, decoded like in the page.
std::vector<std::vector<Pose>> unpack_poses(const Json& motion, int bodies) {
  const int frames = motion["frames"];
  std::vector<std::vector<Pose>> out(frames, std::vector<Pose>(bodies));
  test::StreamReader reader(motion["poses"]);
  for (int b = 1; b < bodies; ++b) {
    std::vector<std::vector<std::int64_t>> c;
    for (int i = 0; i < 7; ++i) c.push_back(reader.smooth(frames));
    for (int k = 0; k < frames; ++k) {
      const double p = motion["position_resolution_m"], q = motion["quaternion_resolution"];
      out[k][b].translation = p * Vector3(c[0][k], c[1][k], c[2][k]);
      out[k][b].rotation =
          Quaternion(q * c[3][k], q * c[4][k], q * c[5][k], q * c[6][k]).normalized().matrix();
    }
  }
  EXPECT_TRUE(reader.at_end());
  return out;
}

TEST(Replay, PosesAreWithinTheResolution) {
  for (const char* name : {"humanoid_drop.yaml", "everything.yaml", "closures.yaml"}) {
    const Scene scene = load_scene(kScenes + name);
    const Replay replay = simulated(scene, 0.4);
    const Json data = Json::parse(replay_data(replay));
    const auto poses = unpack_poses(data["motions"][0], scene.model.num_bodies());
    const Resolution resolution = resolution_of(replay);
    EXPECT_GT(resolution.position, 0.0);
    EXPECT_LT(resolution.position, 1e-3);
    double position = 0.0, angle = 0.0;
    ASSERT_EQ(static_cast<int>(poses.size()), replay.clip.num_frames());
    for (int k = 0; k < replay.clip.num_frames(); ++k) {
      const std::vector<Pose> exact = body_poses(scene.model, replay.clip.states[k].q);
      for (int b = 1; b < scene.model.num_bodies(); ++b) {
        const Vector3 off = poses[k][b].translation - exact[b].translation;
        position = std::max(position, off.cwiseAbs().maxCoeff() / resolution.position);
        angle = std::max(
            angle, Quaternion(poses[k][b].rotation).angularDistance(Quaternion(exact[b].rotation)));
      }
    }
    EXPECT_LE(position, 0.5 + 1e-9) << name;
    // Each of four components has an error of half a resolution; the angle is twice that of the
    // quaternion.
    EXPECT_LE(angle, 2.0 * resolution.quaternion) << name;
    EXPECT_GT(angle, 0.0);
  }
}

TEST(Replay, PosesFarAwayAreAsGood) {
  // The resolution of a small body far from the origin follows its size, not its distance.
  const Scene scene = load_scene(kScenes + "cube_drop.yaml");
  Replay replay = simulated(scene, 0.1);
  for (State& state : replay.clip.states) state.q[0] += 1e6;
  const Json data = Json::parse(replay_data(replay));
  const auto poses = unpack_poses(data["motions"][0], scene.model.num_bodies());
  EXPECT_NEAR(poses[3][1].translation.x(), replay.clip.states[3].q[0], 1e-3);
  EXPECT_LT(resolution_of(replay).position, 1e-3);
}

TEST(Replay, ForcesCarryTheWeight) {
  const Scene scene = load_scene(kScenes + "box_stack.yaml");
  const Replay replay = simulated(scene, 1.0);
  const Json contacts = Json::parse(replay_data(replay))["contacts"];
  test::StreamReader reader(contacts["data"]);
  const int last = replay.clip.num_frames() - 1;
  double carried = 0.0;
  for (int i = 0; i < contacts["tracks"].get<int>(); ++i) {
    const auto pair = contacts["pairs"][reader.next()];
    const std::int64_t start = reader.next(), count = reader.next();
    std::vector<std::vector<std::int64_t>> c;
    for (int k = 0; k < 6; ++k) c.push_back(reader.steps(count));
    const bool on_ground = pair[0] == "ground" || pair[1] == "ground";
    if (on_ground && start <= last && last < start + count)
      carried += c[5][last - start] * contacts["force_resolution_N"].get<double>();
  }
  EXPECT_TRUE(reader.at_end());
  EXPECT_NEAR(carried, 10 * 9.80665 * 1.0, 0.1);  // ten cubes of 1 kg, upwards
}

TEST(Replay, ClosuresCarryTheWeight) {
  const test::TempFolder folder;
  folder.write(
      "hung.yaml",
      "models:\n  - {name: load, sphere: 0.1, mass: 2, position: [0, 0, 1]}\nclosures:\n"
      "  - {type: distance, name: rope, between: [load/body, world], anchor_b: [0, 0, 2]}\n");
  const Scene scene = load_scene(folder.path() / "hung.yaml");
  const Replay replay = simulated(scene, 0.1);
  const Json pulls = Json::parse(replay_data(replay))["closure_forces"];
  test::StreamReader reader(pulls["data"]);
  ASSERT_EQ(pulls["tracks"], 1);
  EXPECT_EQ(pulls["pairs"][reader.next()][0], "rope");
  EXPECT_EQ(reader.next(), 0);
  const std::int64_t count = reader.next();
  EXPECT_EQ(count, replay.clip.num_frames());
  std::vector<std::vector<std::int64_t>> c;
  for (int k = 0; k < 6; ++k) c.push_back(reader.steps(count));
  // Body B is the world: the arrow is the force on the hanging body, upwards. The closure is stiff,
  // so 1e-3 is a large deviation.
  EXPECT_NEAR(c[5].back() * pulls["force_resolution_N"].get<double>(), 2 * 9.80665, 2e-2);
}

TEST(Visuals, ManyTrianglesBecomeFewer) {
  // On a unit sphere: merged vertices move by at most a cell, so the triangles' corners stay near
  // the sphere.
  TriangleMesh mesh;
  constexpr int kRound = 200, kUp = 100;
  for (int i = 0; i <= kUp; ++i)
    for (int j = 0; j < kRound; ++j) {
      const double a = M_PI * i / kUp, b = 2.0 * M_PI * j / kRound;
      mesh.vertices.emplace_back(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    }
  for (int i = 0; i < kUp; ++i)
    for (int j = 0; j < kRound; ++j) {
      const int p = kRound * i + j, q = kRound * i + (j + 1) % kRound;
      mesh.triangles.push_back({p, p + kRound, q});
      mesh.triangles.push_back({q, p + kRound, q + kRound});
    }
  make_coarser(mesh, 5000);
  EXPECT_LE(mesh.triangles.size(), 5000u);
  EXPECT_GT(mesh.triangles.size(), 1000u);
  for (const Vector3& v : mesh.vertices) EXPECT_NEAR(v.norm(), 1.0, 0.1);
  for (const auto& triangle : mesh.triangles)
    for (const int v : triangle) EXPECT_LT(v, static_cast<int>(mesh.vertices.size()));
}

TEST(Visuals, AreThoseOfTheRobotWhereItsLinksAre) {
  const std::string file = kScenes + "humanoid_drop.yaml";
  const Scene scene = load_scene(file);
  const Visuals visuals = read_visuals(file, scene.model, {});
  EXPECT_TRUE(visuals.notes.empty());
  EXPECT_EQ(visuals.shapes.size(), 31u);  // <visual> elements of humanoid.urdf
  EXPECT_EQ(visuals.instances, std::vector<int>{0});
  for (const Visual& visual : visuals.shapes) {
    ASSERT_GT(visual.body, 0);
    EXPECT_EQ(scene.model.joint(visual.body - 1).link, visual.name);
  }
  // Visuals identical to the collision shape are not stored twice.
  const std::string cube = kScenes + "cube_drop.yaml";
  EXPECT_TRUE(read_visuals(cube, load_scene(cube).model, {}).shapes.empty());
}

// The page shows the mesh of an object in pieces, and the pieces, which collide, beside it.
TEST(Visuals, AnObjectInPiecesShowsItsMesh) {
  const std::string file = test::source_dir() + "/data/scenes/hollow/brackets_in_bin.yaml";
  const Scene scene = load_scene(file);
  const Visuals visuals = read_visuals(file, scene.model, {});
  EXPECT_EQ(visuals.shapes.size(), 30U);
  EXPECT_EQ(visuals.instances.size(), 30U);
  ASSERT_EQ(visuals.meshes.size(), 1U);  // one for thirty brackets
  EXPECT_EQ(visuals.meshes[0].triangles.size(), 20U);
  for (const Visual& visual : visuals.shapes)
    EXPECT_EQ(scene.model.joint(visual.body - 1).link, visual.name);
}

TEST(Replay, FramesAreThoseAskedFor) {
  const Scene scene = load_scene(kScenes + "cube_drop.yaml");
  const double h = scene.options.time_step;
  for (const auto& [rate, step] :
       std::vector<std::pair<double, double>>{{100.0, 0.01}, {0.0, h}, {50.0, 0.02}, {1e6, h}}) {
    const Clip clip = simulated(scene, 0.1, rate).clip;
    ASSERT_GE(clip.num_frames(), 3);
    for (int k = 0; k + 1 < clip.num_frames(); ++k)
      EXPECT_NEAR(clip.states[k].time, k * step, 1e-9) << rate;
    EXPECT_NEAR(clip.states.back().time, 0.1, 1e-9);
  }
}

TEST(Replay, LongMotionsAreThinnedOut) {
  const Scene scene = load_scene(kScenes + "cube_drop.yaml");
  const double h = scene.options.time_step;
  Simulator simulator(scene);
  ClipRecorder recorder(scene, 1.0 / h, true, 50);
  for (int k = 0; k < 1000; ++k) {
    const State before = simulator.state();
    ASSERT_TRUE(simulator.step().succeeded());
    recorder.add_step(before, simulator.input(), h, simulator.state());
  }
  const Clip clip = recorder.finish(simulator.state());
  EXPECT_LE(clip.num_frames(), 51);
  EXPECT_GT(clip.num_frames(), 25);
  const double step = clip.states[1].time;
  EXPECT_NEAR(step, 32 * h, 1e-9);  // 50 frames of 1000 steps: halved five times
  for (int k = 0; k + 1 < clip.num_frames(); ++k) EXPECT_NEAR(clip.states[k].time, k * step, 1e-9);
  // Contacts stay with their frames: they move with the cube along x.
  ASSERT_FALSE(clip.contacts.empty());
  for (const Contact& contact : clip.contacts)
    EXPECT_NEAR(contact.position.x(), clip.states[contact.frame].q[0], 0.2);
  EXPECT_EQ(clip.contacts.back().frame, clip.num_frames() - 1);
  EXPECT_EQ(clip.asleep.size(), clip.states.size());
}

TEST(Replay, WhatRestsIsMarked) {
  const Scene scene = load_scene(kScenes + "box_stack.yaml");
  const Clip clip = simulated(scene, 2.0).clip;
  EXPECT_EQ(clip.asleep.front()[0], 0);
  EXPECT_EQ(clip.asleep.back(), std::vector<char>(scene.model.num_trees(), 1));
}

class Names : public testing::Test {
 protected:
  void expect_no_markup(const std::string& page, const std::string& name) const {
    EXPECT_EQ(page.find(name), std::string::npos);
    size_t scripts = 0;
    for (size_t at = 0; (at = page.find("</script", at)) != std::string::npos; ++at) ++scripts;
    EXPECT_EQ(scripts, 2u) << "the data's and the program's";
  }
};

TEST_F(Names, CannotInject) {
  const std::string evil =
      "</script><script>window.injected=1</script><img src=x onerror=\"i('&')\">";
  const test::TempFolder folder;
  folder.write("evil.yaml",
               "name: '</script><img src=x onerror=alert(1)>&amp;\"'\nground: {}\nmodels:\n"
               "  - {name: 'a<b>&\"</script><script>window.injected=1</script>', "
               "sphere: 0.1, mass: 1}\n");
  const Scene scene = load_scene(folder.path() / "evil.yaml");
  Replay replay = simulated(scene, 0.05);
  replay.title = evil;
  replay.made.emplace_back("command", evil);
  replay.inputs.push_back({evil, "</script>"});
  const std::string data = replay_data(replay);
  EXPECT_EQ(data.find('<'), std::string::npos);
  EXPECT_EQ(Json::parse(data)["title"], evil);
  if (!can_make_pages()) GTEST_SKIP() << why_no_pages();
  expect_no_markup(replay_page(replay), evil);
}

TEST_F(Names, OfNoTextStayJson) {
  const Scene scene = load_scene(kScenes + "cube_drop.yaml");
  Replay replay = simulated(scene, 0.01);
  replay.title = "broken \xff\xfe UTF-8";
  EXPECT_NO_THROW(Json::parse(replay_data(replay)));
}

TEST(Sizes, TenSecondsOfTheHumanoid) {
  if (!can_make_pages()) GTEST_SKIP() << why_no_pages();
  const Scene scene = load_scene(kScenes + "humanoid_drop.yaml");
  const Replay replay = simulated(scene, 10.0);
  EXPECT_EQ(replay.clip.num_frames(), 1001);
  const size_t bytes = replay_page(replay).size();
  RecordProperty("bytes", static_cast<int>(bytes));
  EXPECT_LT(bytes, 3'000'000u);
}

/// A thousand boxes tumble for 4 s without contact, which takes more bytes than bodies at rest.
TEST(Sizes, AThousandBoxes) {
  if (!can_make_pages()) GTEST_SKIP() << why_no_pages();
  const test::TempFolder folder;
  folder.write("boxes.yaml",
               "models:\n  - {name: box, box: [0.1, 0.2, 0.3], mass: 1, count: 1000, "
               "spacing: [1, 0.1, 0.01]}\n");
  const Scene scene = load_scene(folder.path() / "boxes.yaml");
  Replay replay;
  replay.scene = &scene;
  State state{0.0, scene.q, scene.v};
  for (int k = 0; k <= 400; ++k) {
    state.time = 0.01 * k;
    for (int b = 0; b < 1000; ++b) {
      const double t = state.time, spin = 1.0 + 0.01 * b;
      const Quaternion q = quaternion_exp(Vector3(spin * t, std::sin(spin * t), 0.3 * t));
      state.q.segment<7>(7 * b) << b + 0.2 * std::sin(spin * t), 0.1 * b + 0.5 * t,
          3.0 + std::cos(0.7 * spin * t), q.w(), q.x(), q.y(), q.z();
    }
    replay.clip.states.push_back(state);
  }
  const size_t bytes = replay_page(replay).size();
  RecordProperty("bytes", static_cast<int>(bytes));
  EXPECT_LT(bytes, 10'000'000u);
}

TEST(Refused, WhatCannotBeShown) {
  const Scene scene = load_scene(kScenes + "cube_drop.yaml");
  Replay replay = simulated(scene, 0.01);
  replay.clip.states[1].q[0] = 1e12;
  EXPECT_THROW(replay_data(replay), InputError);
  replay.clip.states[1].q[0] = std::nan("");
  EXPECT_THROW(replay_data(replay), InputError);
  replay.clip.states.clear();
  EXPECT_THROW(replay_data(replay), InputError);
}

}  // namespace
}  // namespace counterpoint::view::replay_test
