// Values of the axes for each task number, and the run with them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "input/applied_inputs.h"
#include "study.h"

namespace counterpoint::apps::sweep {

struct AxisValue {
  double number = 0.0;
  std::string word;
  bool operator==(const AxisValue&) const = default;
};

/// Draw of a task. Task numbers vary the draw fastest, then the last axis, ...
std::int64_t draw_of(const Study& study, std::int64_t task);

/// Values of the axes of a task, a pure function of the study and the number. Draw k of an axis is
/// the same at every point of the grid, so that points are compared with common random numbers.
std::vector<AxisValue> values_of(const Study& study, std::int64_t task);

/// True if the axis changes the scene; otherwise it changes the start, the options or the inputs of
/// a run.
bool changes_scene(const Axis& axis);
/// Sets a value of such an axis. @throws InputError for an invalid value
void change_scene(const Axis& axis, const AxisValue& value, Scene& scene);
/// The study's scene with the values of all axes that change it: presets first, so that explicit
/// parameters override them, then in the order of the study.
Scene scene_at(const Study& study, const std::vector<AxisValue>& values);

/// A run on such a scene; takes the values of the other axes one by one.
class Trial {
 public:
  Trial(const Study& study, const Scene& scene);
  /// Sets the value of an axis that does not change the scene. @throws InputError for an invalid
  /// value
  void set(const Axis& axis, const AxisValue& value);
  /// Call after the last set(): checks the result and seeds the inputs by the draw.
  void finish(std::int64_t draw = 0);

  VectorX q, v;  ///< start: nq, nv
  SimulationOptions options;
  InputArguments inputs;

 private:
  std::map<int, Vector3>
      angles_;  ///< roll, pitch, yaw [rad], by index of the quaternion's first coordinate
  bool seeded_ = false;
};

}  // namespace counterpoint::apps::sweep
