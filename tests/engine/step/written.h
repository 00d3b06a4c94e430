// A scene that is written as MJCF and read back.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "counterpoint/engine/simulator.h"
#include "counterpoint/model/robot_files.h"
#include "support/paths.h"
#include "support/random_model.h"
#include "support/temp_folder.h"

namespace counterpoint::test {

/// Numbers have 17 digits; rotations pass through quaternions, and lengths of paths through sums of
/// a few numbers near one: some round-offs.
inline constexpr double kRoundOff = 1e-12;

class WrittenModels : public ::testing::Test {
 protected:
  /// A finger of three joints (knuckle, middle_joint, tip_joint) in its start pose, with `parts`.
  Scene finger(const std::string& parts) const {
    return load_scene(folder_.write(
        "scene.yaml", "time_step: 0.001\nmodels:\n  - {urdf: " + source_dir() +
                          "/data/robots/finger.urdf, position: [0, 0, 0.1], joints: {knuckle: "
                          "0.3, middle_joint: 0.4, tip_joint: 0.2}}\n" +
                          parts));
  }
  /// Writes a scene into exported_, and reads it.
  Scene written(const Scene& scene) {
    exported_ = export_mjcf(scene);
    return load_scene(folder_.write("scene.xml", exported_.text));
  }
  bool lost(const std::string& where, const std::string& what) const {
    return std::any_of(exported_.lost.begin(), exported_.lost.end(), [&](const Note& note) {
      return note.where.find(where) != std::string::npos &&
             note.message.find(what) != std::string::npos;
    });
  }
  /// Speeds after a step from random speeds, to a tolerance far below kRoundOff.
  static VectorX speeds_after_step(const Scene& scene) {
    Simulator sim(scene);
    sim.settings().tolerance = 1e-15;
    State state = sim.state();
    state.v = random_vector(scene.model.nv(), 7, 2.0);
    sim.set_state(state);
    EXPECT_TRUE(sim.step().succeeded());
    return sim.state().v;
  }
  static void expect_same_step(const Scene& scene, const Scene& back) {
    const VectorX v = speeds_after_step(scene);
    EXPECT_LE((v - speeds_after_step(back)).norm(), kRoundOff * (1.0 + v.norm()));
    Scene idle = scene;
    idle.options.effects = scene.options.effects.without({Effect::kTendons, Effect::kActuators});
    // The forces in question are felt, or else the comparison says nothing of them.
    EXPECT_GT((v - speeds_after_step(idle)).norm(), 1e-3);
  }

  TempFolder folder_;
  Exported exported_;
};

}  // namespace counterpoint::test
