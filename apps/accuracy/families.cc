#include "families.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
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
    return over(
        vary, name, "time_step_s",
        [](EngineSetting& changed, double h) { changed.options.time_step = h; }, steps_, setting,
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

/// Varies one parameter at the scene's time step over `values`, from loose to tight, and the time
/// step at two of its values.
void add_sweep(const Maker& make, const std::string& item, const std::string& parameter,
               const Change& change, const std::vector<double>& values,
               const std::vector<double>& with_steps, Families& out) {
  out.families.push_back(
      make.over(item, fmt::format("{} at {}", item, seconds_text(make.base().options.time_step)),
                parameter, change, values, make.base(), plain));
  for (const double value : with_steps) {
    EngineSetting setting = make.base();
    change(setting, value);
    out.families.push_back(make.over_steps(item, fmt::format("{} {:g}", item, value), setting));
  }
}

void add_compliance(const Maker& make, Families& out) {
  add_sweep(
      make, "compliance", "compliance",
      [](EngineSetting& setting, double eps) { setting.options.contact.compliance = eps; },
      {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}, {1e-2, 1e-4}, out);
}

void add_smoothing(const Maker& make, Families& out) {
  add_sweep(
      make, "smoothing", "smoothing_m",
      [](EngineSetting& setting, double delta) { setting.options.contact.smoothing = delta; },
      {1e-4, 1e-5, 1e-6, 1e-7, 1e-9, 1e-11, 1e-13, 1e-15}, {1e-5, 1e-8}, out);
}

void add_tolerance(const Maker& make, Families& out) {
  add_sweep(
      make, "tolerance", "tolerance",
      [](EngineSetting& setting, double tolerance) { setting.solver.tolerance = tolerance; },
      {1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12}, {1e-3, 1e-6}, out);
}

void add_other_engine(const Maker& make, Families& out) {
  add_mujoco(make.scene(), make.steps(), rows_of(make.scene()).any, out);
}

/// A value of --vary.
struct Item {
  const char* name;
  void (*add)(const Maker& make, Families& out);
  bool usual = true;              ///< varied by default
  bool Rows::*acts_on = nullptr;  ///< rows without which it has no effect; null: none needed
  const char* without = "";       ///< why it has none then
};
constexpr const char* kNoRows = "the scene has no constraints to solve";
constexpr const char* kNoFriction = "nothing can touch with friction";
constexpr Item kItems[] = {
    {"timestep", add_time_step},
    {"integrator", add_integrators},
    {"friction", add_friction, true, &Rows::friction, kNoFriction},
    {"compliance", add_compliance, true, &Rows::any, kNoRows},
    {"smoothing", add_smoothing, true, &Rows::smoothed, "nothing in this scene is smoothed"},
    {"tolerance", add_tolerance, true, &Rows::any, kNoRows},
    {"preset", add_presets, true, &Rows::any, kNoRows},
    {"law", add_laws, false, &Rows::friction, kNoFriction},
    {"adaptive", add_adaptive, false},
    {"mujoco", add_other_engine, false}};

std::vector<std::string> item_names(bool all) {
  std::vector<std::string> names;
  for (const Item& item : kItems)
    if (all || item.usual) names.emplace_back(item.name);
  return names;
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

std::vector<std::string> vary_items() { return item_names(true); }

std::vector<std::string> usual_items() { return item_names(false); }

Families make_families(const Scene& scene, const Plan& plan,
                       const std::vector<std::string>& items) {
  const Maker make(scene, plan);
  const Rows rows = rows_of(scene);
  Families out;
  for (const std::string& name : items) {
    const auto item = std::find_if(std::begin(kItems), std::end(kItems),
                                   [&](const Item& known) { return name == known.name; });
    if (item == std::end(kItems)) {
      throw InputError(fmt::format("--vary {}: expected one or more of {}", name,
                                   fmt::join(vary_items(), ", ")));
    }
    if (item->acts_on == nullptr || rows.*item->acts_on)
      item->add(make, out);
    else
      out.left_out.push_back(fmt::format("{}: {}", name, item->without));
  }
  return out;
}

}  // namespace counterpoint::apps::accuracy
