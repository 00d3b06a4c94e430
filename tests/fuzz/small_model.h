// The small robot on a floating base, with a servo.
#pragma once

#include "counterpoint/model/scene.h"
#include "fuzz/fuzz.h"
#include "fuzz/small_robot.h"

namespace counterpoint::fuzz {

inline const Model& small_model() {
  static const Model model = [] {
    write("small.urdf", kSmallRobot);
    const char* scene =
        "models: [{urdf: small.urdf, base: floating, dynamics: {j: {servo: {stiffness: 1}}}}]\n";
    return load_scene(write("small.yaml", scene)).model;
  }();
  return model;
}

}  // namespace counterpoint::fuzz
