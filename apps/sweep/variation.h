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
};

/// The draw of a task. Task numbers run over draws fastest, then over the last axis, ...
std::int64_t draw_of(const Study& study, std::int64_t task);

/// Values of the axes of a task: a pure function of the study and the number. Draw k of an axis is
/// the same at every point of the grid: points are compared on equal terms (common random numbers).
std::vector<AxisValue> values_of(const Study& study, std::int64_t task);

/// A run of the study that takes values one after another.
class Trial {
 public:
  explicit Trial(const Study& study);
  /// @throws InputError for a value that no scene may have.
  void set(const Axis& axis, const AxisValue& value);
  /// After the last: checks the whole, seeds inputs by the draw.
  void finish(std::int64_t draw = 0);

  Scene scene;
  InputArguments inputs;

 private:
  std::map<int, Vector3>
      angles_;  ///< roll, pitch, yaw [rad], by the first coordinate of the quaternion
  bool seeded_ = false;
};

}  // namespace counterpoint::apps::sweep
