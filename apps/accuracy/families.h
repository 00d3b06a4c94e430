// Varied settings: a family of settings is a curve, a setting is a point on it.
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
  double parameter = 0.0;  ///< value of the varied parameter
  /// Settings with equal keys are equal and measured once; empty: always measured.
  std::string key;
  /// @throws InputError, peers::NotExpressible with the reason why it cannot run (reported, not a
  /// failure).
  std::function<std::unique_ptr<EngineAdapter>()> make;
  /// Setting of this engine, for which physics is measured (physics.h); empty: another engine.
  std::optional<EngineSetting> engine = {};
};

/// One curve. Its order of convergence is fitted if it varies the time step.
struct Family {
  std::string vary;       ///< item of --vary
  std::string name;       ///< in the legend
  std::string parameter;  ///< JSON name of the varied parameter: "time_step_s", "compliance", ...
  std::vector<Setting> settings;
  bool other_engine = false;  ///< not this engine: neither on the front nor recommended
  /// If set, errors refer to this engine's own run at the given time step, since it converges to
  /// another limit. @throws as Setting::make.
  std::function<std::unique_ptr<EngineAdapter>(double time_step)> own = {};
  bool over_time_step() const { return parameter == "time_step_s"; }
};

/// Families, and the items without effect on this scene, each with the reason.
struct Families {
  std::vector<Family> families;
  std::vector<std::string> left_out;
};

/// Values of --vary, in order.
std::vector<std::string> vary_items();
/// Items varied by default: all but `law`, which is slow, `adaptive` and `mujoco`.
std::vector<std::string> usual_items();

/// Families of the items, at the scene's options apart from the varied one. Time steps run from 16
/// times the scene's (or the longest that divides a piece) to an eighth. The scene must outlive
/// them. @throws InputError for an unknown item.
Families make_families(const Scene& scene, const Plan& plan, const std::vector<std::string>& items);

/// Kinds of rows that the contact problem of a scene can have.
struct Rows {
  bool any = false;       ///< constraints of any kind
  bool contacts = false;  ///< some bodies can touch
  bool friction = false;  ///< some contacts have friction
  bool smoothed = false;  ///< rows whose law is smoothed: all but equalities
};
Rows rows_of(const Scene& scene);

/// Time with its unit: "2 ms", "31.25 us".
std::string seconds_text(double seconds);

}  // namespace counterpoint::apps::accuracy
