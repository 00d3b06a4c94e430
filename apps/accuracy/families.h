// What is varied: a family of settings is a curve, a setting a point of it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "adapters/engine_adapter.h"
#include "pieces.h"

namespace counterpoint::apps::accuracy {

/// One point of a curve.
struct Setting {
  std::string label;       ///< in words: "implicit_midpoint, 2 ms"
  double parameter = 0.0;  ///< what the curve runs over
  /// Equal keys are equal settings, measured once; empty: measured by itself.
  std::string key;
  /// @throws InputError, peers::NotExpressible: why it cannot be run (said, not a failure).
  std::function<std::unique_ptr<EngineAdapter>()> make;
  /// Of this engine only: how it is told; physics is measured on it (physics.h).
  std::optional<EngineSetting> engine = {};
};

/// One curve. Its order is fitted where it runs over the time step.
struct Family {
  std::string vary;       ///< item of --vary
  std::string name;       ///< in the legend
  std::string parameter;  ///< JSON name of what it runs over: "time_step_s", "compliance", ...
  std::vector<Setting> settings;
  bool other_engine = false;  ///< beside this one: neither on the front nor recommended
  /// If set, errors are those to this engine's own run, at a time step given: its limit is another
  /// one. @throws as Setting::make.
  std::function<std::unique_ptr<EngineAdapter>(double time_step)> own = {};
  bool over_time_step() const { return parameter == "time_step_s"; }
};

/// Families, and items that say nothing about this scene with the reason.
struct Families {
  std::vector<Family> families;
  std::vector<std::string> left_out;
};

/// Names that --vary takes, in their order.
const std::vector<std::string>& vary_items();
/// What is varied unless something else is asked for: not `law`, which is slow, nor `adaptive` and
/// `mujoco`.
std::vector<std::string> usual_items();

/// The families of the items, at the scene's options but for what is varied. Time steps run from 16
/// times the scene's (or the longest that divides a piece) to an eighth. The scene must outlive
/// them. @throws InputError for an unknown item.
Families make_families(const Scene& scene, const Plan& plan, const std::vector<std::string>& items);

/// Which kinds of rows of the contact problem a scene can have.
struct Rows {
  bool any = false;       ///< constraints of any kind
  bool contacts = false;  ///< bodies that can touch
  bool friction = false;  ///< with friction
  bool smoothed = false;  ///< rows whose law is smoothed: all but equalities
};
Rows rows_of(const Scene& scene);

/// "2 ms", "31.25 us".
std::string seconds_text(double seconds);

}  // namespace counterpoint::apps::accuracy
