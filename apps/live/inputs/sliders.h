// The sliders of a live page: inputs of a model that a reader can set.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "counterpoint/engine/state.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::live {

struct Slider {
  /// True: an applied force, `index` is a coordinate of v. False: another input, `index` is an
  /// entry of InputColumns::of.
  bool force = false;
  int index = 0;
  std::string group, name, unit;
  double lower = 0.0, upper = 1.0;
  double value = 0.0;  ///< at the start
  int closure = -1;    ///< index into Model::closures, if it switches one: 1 attached, 0 released
};

/// Sliders for the targets of servos, forces of motors, forces and targets of tendons, commands of
/// actuators, and switched closures. z: internal states at the start.
std::vector<Slider> sliders_of(const Model& model, const VectorX& z);

/// The inputs that sliders ask for.
class Wanted {
 public:
  Wanted(const Model& model, std::vector<Slider> sliders);

  const std::vector<Slider>& sliders() const { return sliders_; }
  /// Sets an input of a slider's kind. @throws InputError if no slider has this index.
  void set(bool force, int index, double value);
  /// Sets applied forces and all inputs but wrenches, which it clears.
  void apply(Input& input) const;
  /// Present value of each slider; z: internal states, which say whether closures are attached.
  std::vector<double> values(const VectorX& z) const;

 private:
  const Model& model_;
  const std::vector<Slider> sliders_;
  const InputColumns columns_;
  VectorX inputs_;  ///< values of columns_
  VectorX force_;   ///< nv
};

}  // namespace counterpoint::live
