#include "counterpoint/model/scene/scene_options.h"

#include <fmt/format.h>

#include <limits>

#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

int read_budget(const YamlValue& in) {
  if (in.is_text("none")) return 0;
  return in.integer(1, std::numeric_limits<int>::max());
}

Integrator read_integrator(const YamlValue& in) {
  const auto integrator = integrator_from_name(in.text());
  if (!integrator)
    in.fail("'" + in.text() +
            "' is not one of semi_implicit_euler, implicit_midpoint, runge_kutta_4");
  return *integrator;
}

StepControlOptions read_step_control(const YamlValue& in) {
  in.expect_map({"tolerance", "relative_tolerance", "event_tolerance", "min_step", "max_step",
                 "interval", "strict"});
  StepControlOptions out;
  if (in.has("tolerance")) out.tolerance = in.at("tolerance").positive();
  if (in.has("relative_tolerance"))
    out.relative_tolerance = in.at("relative_tolerance").number(0.0, kInfinity);
  if (in.has("event_tolerance")) out.event_tolerance = in.at("event_tolerance").positive();
  if (in.has("min_step")) out.min_step = in.at("min_step").positive();
  if (in.has("max_step")) out.max_step = in.at("max_step").positive();
  if (in.has("interval")) out.interval = in.at("interval").number(0.0, kInfinity);
  if (in.has("strict")) out.strict = in.at("strict").boolean();
  if (const std::string flaw = step_control_flaw(out); !flaw.empty()) in.fail(flaw);
  return out;
}

bool read_velocity_forces(const YamlValue& in) {
  if (!in.is_text("mean") && !in.is_text("start")) in.fail("mean or start is expected");
  return in.is_text("mean");
}

double read_bound(const YamlValue& in) { return in.is_text("none") ? kInfinity : in.positive(); }

/// Reads `effects: {NAME: on or off}`.
void read_effects(const YamlValue& in, EffectSet& effects) {
  for (const auto& [name, value] : in.entries()) {
    const auto effect = effect_from_name(name);
    if (!effect) value.fail("'" + name + "' is no effect; known: " + effect_names());
    effects.set(*effect, value.boolean());
  }
}

void read_preset(const YamlValue& value, ContactOptions& contact) {
  const auto preset = contact_preset_from_name(value.text());
  if (!preset) value.fail("'" + value.text() + "' is not one of fast, default, hard");
  apply_contact_preset(*preset, contact);
}

/// Reads `contact: fast`, or `contact: {preset: fast, ...}`; other keys override the preset.
void read_contact(const YamlValue& in, ContactOptions& contact) {
  if (!in.is_map()) return read_preset(in, contact);
  in.expect_map({"preset", "friction_model", "compliance", "smoothing", "stabilization",
                 "max_recovery_speed", "margin", "reach_acceleration", "slip_time"});
  if (in.has("preset")) read_preset(in.at("preset"), contact);
  if (in.has("friction_model")) {
    const YamlValue value = in.at("friction_model");
    const auto model = friction_model_from_name(value.text());
    if (!model) value.fail("'" + value.text() + "' is not one of convex, lagged, coulomb");
    contact.friction_model = *model;
  }
  if (in.has("compliance")) contact.compliance = in.at("compliance").positive();
  if (in.has("smoothing")) contact.smoothing = in.at("smoothing").number(0.0, kInfinity);
  if (in.has("stabilization")) contact.stabilization = in.at("stabilization").number(0.0, 1.0);
  if (in.has("max_recovery_speed")) {
    contact.max_recovery_speed = in.at("max_recovery_speed").number(0.0, kInfinity);
  }
  if (in.has("margin")) contact.margin = in.at("margin").number(0.0, kInfinity);
  if (in.has("reach_acceleration"))
    contact.reach_acceleration = in.at("reach_acceleration").number(0.0, kInfinity);
  if (in.has("slip_time")) contact.slip_time = in.at("slip_time").positive();
}

}  // namespace

void read_options(const YamlValue& in, Faults& faults, SimulationOptions& out) {
  const auto take = [&](const char* key, auto&& read) {
    if (in.has(key)) faults.collect([&] { read(in.at(key)); });
  };
  take("time_step", [&](const YamlValue& value) { out.time_step = value.positive(); });
  take("integrator", [&](const YamlValue& value) { out.integrator = read_integrator(value); });
  take("duration", [&](const YamlValue& value) { out.duration = value.number(0.0, kInfinity); });
  take("max_speed", [&](const YamlValue& value) { out.max_speed = read_bound(value); });
  take("closing_time", [&](const YamlValue& value) { out.closing_time = read_bound(value); });
  take("step_budget", [&](const YamlValue& value) { out.step_budget = read_budget(value); });
  take("velocity_forces",
       [&](const YamlValue& value) { out.mean_velocity_forces = read_velocity_forces(value); });
  take("effects", [&](const YamlValue& value) { read_effects(value, out.effects); });
  take("step_control",
       [&](const YamlValue& value) { out.step_control = read_step_control(value); });
  take("contact", [&](const YamlValue& value) { read_contact(value, out.contact); });
}

void set_option(const std::string& key, const std::string& value, SimulationOptions& options) {
  const YamlValue setting = YamlValue::setting(key, value);
  setting.expect_map({}, kOptionKeys);
  SimulationOptions changed = options;
  Faults faults;
  read_options(setting, faults, changed);
  faults.throw_if_any();
  options = changed;
}

}  // namespace counterpoint
