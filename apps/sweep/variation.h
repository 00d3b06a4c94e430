// The task of a number: values of all that varies, and the run that they make.
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

/// The draw of a task. Task numbers run over draws fastest, then over the last axis, ...
std::int64_t draw_of(const Study& study, std::int64_t task);

/// Values of the axes of a task: a pure function of the study and the number. Draw k of an axis is
/// the same at every point of the grid: points are compared on equal terms (common random numbers).
std::vector<AxisValue> values_of(const Study& study, std::int64_t task);

/// Whether another value of the axis makes another scene; else it makes another start, other
/// options of the run or other inputs.
bool changes_scene(const Axis& axis);
/// Sets a value of an axis that does. @throws InputError for a value that no scene may have.
void change_scene(const Axis& axis, const AxisValue& value, Scene& scene);
/// The study's scene at the values of all axes that change it: presets first, for figures go before
/// them, then in the order of the study.
Scene scene_at(const Study& study, const std::vector<AxisValue>& values);

/// A run on such a scene: takes the values of the other axes one after another.
class Trial {
 public:
  Trial(const Study& study, const Scene& scene);
  /// Of an axis that does not change the scene. @throws InputError for a value that no run may
  /// have.
  void set(const Axis& axis, const AxisValue& value);
  /// After the last: checks the whole, seeds inputs by the draw.
  void finish(std::int64_t draw = 0);

  VectorX q, v;  ///< the start: nq, nv
  SimulationOptions options;
  InputArguments inputs;

 private:
  std::map<int, Vector3>
      angles_;  ///< roll, pitch, yaw [rad], by the first coordinate of the quaternion
  bool seeded_ = false;
};

}  // namespace counterpoint::apps::sweep
