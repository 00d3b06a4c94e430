// Values of the axes for each task number, and the run with them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "input/applied_inputs.h"
#include "study.h"

namespace counterpoint::apps::sweep {

/// Draw of a task. Task numbers vary the draw fastest, then the last axis, ...
std::int64_t draw_of(const Study& study, std::int64_t task);

/// Values of the axes of a task, a pure function of the study and the number. Draw k of an axis is
/// the same at every point of the grid, so that points are compared with common random numbers.
std::vector<AxisValue> values_of(const Study& study, std::int64_t task);

/// Sets a value of an axis that changes the scene. @throws InputError for an invalid value
void change_scene(const Axis& axis, const AxisValue& value, Scene& scene);
/// The study's scene with the values of all axes that change it: presets first, so that explicit
/// parameters override them, then in the order of the study.
Scene scene_at(const Study& study, const std::vector<AxisValue>& values);

/// A run on such a scene; Axis::set of the other axes changes it.
class Trial {
 public:
  Trial(const Study& study, const Scene& scene);
  /// Call after the last change: checks the result and seeds the inputs by the draw. @throws
  /// InputError
  void finish(std::int64_t draw = 0);

  VectorX q, v;  ///< start: nq, nv
  SimulationOptions options;
  InputArguments inputs;
  bool seeded = false;  ///< the seed of the inputs is varied, and not by the draw
  /// Roll, pitch, yaw [rad], by index of the quaternion's first coordinate.
  std::map<int, Vector3> angles;
};

/// Makes the axis vary a quantity of a run that has a name of its own: time_step, inputs, ... False
/// if there is none of the axis's name.
bool set_named_quantity(Axis& axis);

/// Names of these quantities, and of the contact preset: of numbers, or of words.
std::vector<std::string> named_quantities(bool words);

}  // namespace counterpoint::apps::sweep
