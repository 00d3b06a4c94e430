#include "counterpoint/model/mjcf/forces/actuator_law.h"

#include <tinyxml2.h>

#include <algorithm>
#include <numbers>

namespace counterpoint::mjcf {
namespace {

const std::vector<std::string> kTags = {"general",     "motor",  "position", "velocity",
                                        "intvelocity", "damper", "cylinder", "muscle",
                                        "adhesion",    "plugin"};

void set_first(const std::vector<double>& from, std::vector<double>& to) {
  if (from.empty()) return;
  to = from;
  to.resize(std::max<std::size_t>(to.size(), 3));
}

std::optional<std::pair<double, double>> range_of(const Values& v, const char* key) {
  const std::vector<double> range = v.numbers(key, 2, 2);
  if (range.empty()) return std::nullopt;
  return std::pair(range[0], range[1]);
}

void apply_common(const Values& v, Law& law) {
  if (const auto r = range_of(v, "ctrlrange")) law.control_range = r;
  if (const auto r = range_of(v, "forcerange")) law.force_range = r;
  law.control_limited = v.text("ctrllimited", law.control_limited);
  law.force_limited = v.text("forcelimited", law.force_limited);
  law.inherited_range = v.number("inheritrange", law.inherited_range);
  if (const auto r = range_of(v, "actrange")) law.activation_range = r;
  law.activation_limited = v.text("actlimited", law.activation_limited);
  const std::vector<double> gear = v.numbers("gear", 1, 6);
  if (!gear.empty()) law.gear = gear;
}

void apply_general(const Values& v, Law& law) {
  law.gain_type = v.text("gaintype", law.gain_type);
  law.bias_type = v.text("biastype", law.bias_type);
  law.dynamics = v.text("dyntype", law.dynamics);
  set_first(v.numbers("dynprm", 1, 10), law.dynamics_numbers);
  set_first(v.numbers("gainprm", 1, 10), law.gain);
  set_first(v.numbers("biasprm", 1, 10), law.bias);
}

void apply_position(const Values& v, Law& law) {
  const double kp = v.number("kp", law.gain[0]);
  law.gain = {kp, 0.0, 0.0};
  law.gain_type = "fixed";
  law.bias_type = "affine";
  law.bias[1] = -kp;
  if (const auto kv = v.number("kv")) {
    law.bias[2] = -*kv;
    law.damping_ratio = 0.0;
  }
  if (const auto ratio = v.number("dampratio")) law.damping_ratio = *ratio;
  if (const double time = v.number("timeconst", 0.0); time > 0.0) {
    law.dynamics = "filterexact";
    law.dynamics_numbers = {time};
  }
}

void apply_velocity(const Values& v, Law& law) {
  const double kv = v.number("kv", law.gain[0]);
  law.gain = {kv, 0.0, 0.0};
  law.bias = {0.0, 0.0, -kv};
  law.gain_type = "fixed";
  law.bias_type = "affine";
}

/// A position servo whose target is the integral of the control.
void apply_intvelocity(const Values& v, Law& law) {
  apply_position(v, law);
  law.dynamics = "integrator";
}

/// A piston: the pressure behind a first order lag presses on its area.
void apply_cylinder(const Values& v, Law& law) {
  law.gain = {v.number("area", law.gain[0]), 0.0, 0.0};
  if (const auto diameter = v.number("diameter"))
    law.gain[0] = 0.25 * std::numbers::pi * *diameter * *diameter;
  law.gain_type = "fixed";
  law.bias_type = "affine";
  set_first(v.numbers("bias", 3, 3), law.bias);
  law.dynamics = "filter";
  law.dynamics_numbers = {v.number("timeconst", law.dynamics_numbers[0])};
}

/// Applies the attributes of an element, or of a default class, over those applied before.
void apply(const Document& document, const Element& element, Law& law) {
  const Values v(document, element);
  const std::string tag = element.Name();
  law.unsupported.clear();
  law.by_itself = false;
  if (tag == "general") {
    apply_general(v, law);
  } else if (tag == "motor") {
    law.gain = {1.0, 0.0, 0.0};
    law.gain_type = "fixed";
    law.bias_type = law.dynamics = "none";
  } else if (tag == "position") {
    apply_position(v, law);
  } else if (tag == "velocity") {
    apply_velocity(v, law);
  } else if (tag == "intvelocity") {
    apply_intvelocity(v, law);
  } else if (tag == "damper") {
    const double above = law.gain_type == "affine" ? -law.gain[2] : 1.0;  // a default class
    law.gain = {0.0, 0.0, -v.number("kv", above)};
    law.gain_type = "affine";
    law.bias_type = law.dynamics = "none";
  } else if (tag == "muscle") {
    law.dynamics = law.gain_type = law.bias_type = "muscle";
  } else if (tag == "adhesion") {
    law.gain = {v.number("gain", law.gain[0]), 0.0, 0.0};
    law.gain_type = "fixed";
    law.bias_type = law.dynamics = "none";
  } else if (tag == "cylinder") {
    apply_cylinder(v, law);
  } else if (tag == "plugin") {
    law.dynamics = v.text("dyntype", law.dynamics);
    set_first(v.numbers("dynprm", 1, 10), law.dynamics_numbers);
  } else {
    law.unsupported = "<" + tag + ">";
    law.by_itself = true;
  }
  apply_common(v, law);
}

}  // namespace

std::vector<const Element*> law_levels(const Defaults& defaults, const Element& e) {
  std::vector<const Element*> levels = defaults.chain(e, "", kTags);
  levels.push_back(&e);
  return levels;
}

Law read_law(const Document& document, const std::vector<const Element*>& levels) {
  Law law;
  for (const Element* level : levels) apply(document, *level, law);
  return law;
}

bool is_limited(const Document& document, const Element& e, const std::string& limited,
                const std::optional<std::pair<double, double>>& range) {
  return range && (limited == "true" || (limited == "auto" && document.compiler(e).auto_limits));
}

}  // namespace counterpoint::mjcf
