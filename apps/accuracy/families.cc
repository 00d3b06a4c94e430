#include "families.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/step.h"
#include "mujoco_families.h"

namespace counterpoint::apps::accuracy {
namespace {

constexpr double kEventShare = 1e-2;          // [s]: event_tolerance per unit of control tolerance
constexpr int kDoublings = 4, kHalvings = 3;  // powers of two around the scene's time step

/// Writes a value of the varied parameter into a setting.
using Change = std::function<void(EngineSetting&, double)>;

void set_time_step(EngineSetting& setting, double h) { setting.options.time_step = h; }
void set_compliance(EngineSetting& setting, double eps) {
  setting.options.contact.compliance = eps;
}
void set_smoothing(EngineSetting& setting, double delta) {
  setting.options.contact.smoothing = delta;
}
void set_tolerance(EngineSetting& setting, double tolerance) {
  setting.solver.tolerance = tolerance;
}

class Maker {
 public:
  Maker(const Scene& scene, const Plan& plan) : scene_(scene), base_{scene.options, {}} {
    base_.options.step_control.reset();
    for (int k = std::min(kDoublings, plan.doublings); k >= -kHalvings; --k)
      steps_.push_back(exact_step(plan, std::ldexp(plan.time_step, k)));
  }

  const EngineSetting& base() const { return base_; }
  const Scene& scene() const { return scene_; }
  const std::vector<double>& steps() const { return steps_; }

  /// A curve over the time step.
  Family over_steps(const std::string& vary, const std::string& name,
                    const EngineSetting& setting) const {
    return over(vary, name, "time_step_s", set_time_step, steps_, setting,
                [](double h) { return seconds_text(h); });
  }

  Family over(const std::string& vary, const std::string& name, const std::string& parameter,
              const Change& change, const std::vector<double>& values, const EngineSetting& setting,
              const std::function<std::string(double)>& text) const {
    Family family{vary, name, parameter, {}};
    for (const double value : values) {
      EngineSetting changed = setting;
      change(changed, value);
      family.settings.push_back(
          {fmt::format("{}, {}", name, text(value)), value, key(changed),
           [&scene = scene_, changed] { return counterpoint_adapter(scene, changed); }, changed});
    }
    return family;
  }

 private:
  static std::string key(const EngineSetting& setting) {
    const SimulationOptions& o = setting.options;
    return fmt::format("{} {} {} {} {} {}", integrator_name(o.integrator), o.time_step,
                       friction_model_name(o.contact.friction_model), o.contact.compliance,
                       o.contact.smoothing, setting.solver.tolerance);
  }

  const Scene& scene_;
  EngineSetting base_;
  std::vector<double> steps_;
};

std::string plain(double value) { return fmt::format("{:g}", value); }

void add_time_step(const Maker& make, Families& out) {
  out.families.push_back(
      make.over_steps("timestep", integrator_name(make.base().options.integrator), make.base()));
}

void add_integrators(const Maker& make, Families& out) {
  for (const Integrator integrator :
       {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint, Integrator::kRungeKutta4}) {
    EngineSetting setting = make.base();
    setting.options.integrator = integrator;
    out.families.push_back(make.over_steps("integrator", integrator_name(integrator), setting));
  }
}

void add_friction(const Maker& make, Families& out) {
  for (const FrictionModel model :
       {FrictionModel::kCoulomb, FrictionModel::kLagged, FrictionModel::kConvex}) {
    EngineSetting setting = make.base();
    setting.options.contact.friction_model = model;
    out.families.push_back(make.over_steps(
        "friction", fmt::format("friction {}", friction_model_name(model)), setting));
  }
}

/// Contact presets, chosen by one word: `contact: fast | default | hard`.
void add_presets(const Maker& make, Families& out) {
  for (const ContactPreset preset :
       {ContactPreset::kFast, ContactPreset::kDefault, ContactPreset::kHard}) {
    EngineSetting setting = make.base();
    apply_contact_preset(preset, setting.options.contact);
    out.families.push_back(
        make.over_steps("preset", fmt::format("contact {}", contact_preset_name(preset)), setting));
  }
}

/// The law of 2011 has no regularized Coulomb friction, so both laws use convex friction here.
void add_laws(const Maker& make, Families& out) {
  EngineSetting setting = make.base();
  setting.options.integrator = Integrator::kSemiImplicitEuler;
  setting.options.contact.friction_model = FrictionModel::kConvex;
  out.families.push_back(make.over_steps("law", "law spectral, convex", setting));
  Family other = make.over_steps("law", "law kinetic_energy, convex", setting);
  for (Setting& point : other.settings) {
    point.key.clear();
    point.make = [&scene = make.scene(), changed = *point.engine] {
      return kinetic_energy_adapter(scene, changed);
    };
    point.engine.reset();
  }
  out.families.push_back(other);
}

/// Step control as a function of its tolerance, for every integrator; event tolerances follow it.
void add_adaptive(const Maker& make, Families& out) {
  struct Range {
    Integrator integrator;
    int from, to;  ///< powers of ten
  };
  for (const auto& [integrator, from, to] :
       {Range{Integrator::kSemiImplicitEuler, 1, -3}, Range{Integrator::kImplicitMidpoint, 1, -6},
        Range{Integrator::kRungeKutta4, 0, -9}}) {
    EngineSetting setting = make.base();
    setting.options.integrator = integrator;
    std::vector<double> tolerances;
    for (int power = from; power >= to; --power) tolerances.push_back(std::pow(10.0, power));
    Family family = make.over(
        "adaptive", fmt::format("adaptive {}", integrator_name(integrator)), "control_tolerance",
        [](EngineSetting& changed, double tolerance) {
          StepControlOptions& control = changed.options.step_control.emplace();
          control.tolerance = tolerance;
          control.event_tolerance = std::clamp(kEventShare * tolerance, 1e-7, 1e-3);
        },
        tolerances, setting, plain);
    for (Setting& each : family.settings) {
      each.key.clear();     // the key does not contain step control
      each.engine.reset();  // physics is measured with a constant step
    }
    out.families.push_back(std::move(family));
  }
}

/// One parameter: varied at the scene's time step, and the time step varied at two of its values.
struct Sweep {
  const char* item;
  const char* parameter;
  Change change;
  std::vector<double> values;        ///< from loose to tight
  std::array<double, 2> with_steps;  ///< two of `values`
};

std::vector<Sweep> sweeps() {
  return {{"compliance",
           "compliance",
           set_compliance,
           {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8},
           {1e-2, 1e-4}},
          {"smoothing",
           "smoothing_m",
           set_smoothing,
           {1e-4, 1e-5, 1e-6, 1e-7, 1e-9, 1e-11, 1e-13, 1e-15},
           {1e-5, 1e-8}},
          {"tolerance",
           "tolerance",
           set_tolerance,
           {1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12},
           {1e-3, 1e-6}}};
}

void add_sweep(const Maker& make, const Sweep& sweep, Families& out) {
  out.families.push_back(make.over(
      sweep.item, fmt::format("{} at {}", sweep.item, seconds_text(make.base().options.time_step)),
      sweep.parameter, sweep.change, sweep.values, make.base(), plain));
  for (const double value : sweep.with_steps) {
    EngineSetting setting = make.base();
    sweep.change(setting, value);
    out.families.push_back(
        make.over_steps(sweep.item, fmt::format("{} {:g}", sweep.item, value), setting));
  }
}

/// Reason why an item has no effect on a scene; empty: it has one.
std::string idle(const std::string& item, const Rows& rows) {
  if (item == "friction" || item == "law")
    return rows.friction ? "" : "nothing can touch with friction";
  if (item == "smoothing") return rows.smoothed ? "" : "nothing in this scene is smoothed";
  if (item == "compliance" || item == "tolerance" || item == "preset")
    return rows.any ? "" : "the scene has no constraints to solve";
  return "";
}

}  // namespace

Rows rows_of(const Scene& scene) {
  const collision::Collider collider(scene.model);
  Rows rows;
  for (const EffectUse& use : list_effects(scene.model, collider, scene.options)) {
    if (!use.on || use.rows == 0) continue;
    rows.any = true;
    rows.contacts |= use.effect == Effect::kContacts;
    rows.friction |= use.effect == Effect::kFriction;
    rows.smoothed |= use.effect != Effect::kClosures && use.effect != Effect::kMimics;
  }
  return rows;
}

std::string seconds_text(double seconds) {
  if (seconds < 1e-3) return fmt::format("{:.4g} us", 1e6 * seconds);
  if (seconds < 1.0) return fmt::format("{:.4g} ms", 1e3 * seconds);
  return fmt::format("{:.4g} s", seconds);
}

const std::vector<std::string>& vary_items() {
  static const std::vector<std::string> items = {
      "timestep",  "integrator", "friction", "compliance", "smoothing",
      "tolerance", "preset",     "law",      "adaptive",   "mujoco"};
  return items;
}

std::vector<std::string> usual_items() {
  std::vector<std::string> items = vary_items();
  std::erase_if(items, [](const std::string& item) {
    return item == "law" || item == "adaptive" || item == "mujoco";
  });
  return items;
}

Families make_families(const Scene& scene, const Plan& plan,
                       const std::vector<std::string>& items) {
  const Maker make(scene, plan);
  const Rows rows = rows_of(scene);
  Families out;
  for (const std::string& item : items) {
    const auto& known = vary_items();
    if (std::find(known.begin(), known.end(), item) == known.end()) {
      throw InputError(
          fmt::format("--vary {}: expected one or more of {}", item, fmt::join(known, ", ")));
    }
    if (const std::string why = idle(item, rows); !why.empty()) {
      out.left_out.push_back(fmt::format("{}: {}", item, why));
      continue;
    }
    if (item == "timestep") add_time_step(make, out);
    if (item == "integrator") add_integrators(make, out);
    if (item == "friction") add_friction(make, out);
    if (item == "preset") add_presets(make, out);
    if (item == "law") add_laws(make, out);
    if (item == "adaptive") add_adaptive(make, out);
    if (item == "mujoco") add_mujoco(scene, make.steps(), rows.any, out);
    for (const Sweep& sweep : sweeps())
      if (item == sweep.item) add_sweep(make, sweep, out);
  }
  return out;
}

}  // namespace counterpoint::apps::accuracy
