#include "variation.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::apps::sweep {
namespace {

/// Output function of splitmix64 (Steele, Lea, Flood, OOPSLA 2014) for a counter.
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Maps bits to the open interval (0, 1).
double uniform(std::uint64_t bits) { return (static_cast<double>(bits >> 11) + 0.5) * 0x1p-53; }

double drawn(const Axis& axis, std::uint64_t seed, std::int64_t draw) {
  Hash hash;
  hash.add(seed);
  hash.add(std::string_view(axis.name));
  hash.add(static_cast<std::uint64_t>(draw));
  const std::uint64_t first = mix(hash.value());
  const double u = uniform(first);
  switch (axis.distribution) {
    case Distribution::kUniform:
      return axis.a + u * (axis.b - axis.a);
    case Distribution::kLogUniform:
      return axis.a * std::pow(axis.b / axis.a, u);
    case Distribution::kNormal:  // Box and Muller
      return axis.a + axis.b * std::sqrt(-2.0 * std::log(u)) *
                          std::cos(2.0 * std::numbers::pi * uniform(mix(first)));
  }
  return 0.0;
}

template <class Value>
Value named(const std::optional<Value>& found, const std::string& axis, const std::string& word,
            const char* words) {
  if (!found)
    throw InputError(fmt::format("{}: there is no '{}'; expected one of {}", axis, word, words));
  return *found;
}

void set_input_seed(const AxisValue& value, Trial& trial) {
  const double x = value.number;
  if (!(x >= 0.0 && x < 0x1p53 && x == std::floor(x)))
    throw InputError(fmt::format("input_seed {}: expected a whole number, 0 or more", x));
  trial.inputs.seed = static_cast<std::uint64_t>(x);
  trial.seeded = true;
}

void set_integrator(const AxisValue& value, Trial& trial) {
  trial.options.integrator = named(integrator_from_name(value.word), "integrator", value.word,
                                   "semi_implicit_euler, implicit_midpoint, runge_kutta_4");
}

void set_friction_model(const AxisValue& value, Trial& trial) {
  trial.options.contact.friction_model =
      named(friction_model_from_name(value.word), "friction_model", value.word,
            "coulomb, convex, lagged");
}

/// A varied quantity with a name of its own.
struct Quantity {
  const char* name;
  bool words;
  void (*set)(const AxisValue& value, Trial& trial);  ///< null: it belongs to the scene
};
constexpr Quantity kQuantities[] = {
    {"time_step", false,
     [](const AxisValue& x, Trial& trial) { override_times({}, x.number, trial.options); }},
    {"duration", false,
     [](const AxisValue& x, Trial& trial) { override_times(x.number, {}, trial.options); }},
    {"random_inputs", false,
     [](const AxisValue& x, Trial& trial) { trial.inputs.random_scale = x.number; }},
    {"random_wrenches", false,
     [](const AxisValue& x, Trial& trial) { trial.inputs.random_wrench_scale = x.number; }},
    {"input_seed", false, set_input_seed},
    {"integrator", true, set_integrator},
    {"friction_model", true, set_friction_model},
    {"contact", true, nullptr},
    {"inputs", true, [](const AxisValue& x, Trial& trial) { trial.inputs.file = x.word; }}};

}  // namespace

std::int64_t draw_of(const Study& study, std::int64_t task) { return task % study.draws; }

std::vector<AxisValue> values_of(const Study& study, std::int64_t task) {
  std::vector<AxisValue> values(study.axes.size());
  std::int64_t rest = task / study.draws;
  for (std::size_t i = study.axes.size(); i-- > 0;) {
    const Axis& axis = study.axes[i];
    if (axis.random) {
      values[i].number = drawn(axis, study.seed, draw_of(study, task));
      continue;
    }
    const auto level = static_cast<std::size_t>(rest % axis.levels());
    rest /= axis.levels();
    if (axis.has_words())
      values[i].word = axis.words[level];
    else
      values[i].number = axis.numbers[level];
  }
  return values;
}

void change_scene(const Axis& axis, const AxisValue& value, Scene& scene) {
  if (axis.parameter)
    scene = with_parameters(scene, {*axis.parameter}, VectorX::Constant(1, value.number));
  else
    apply_contact_preset(
        named(contact_preset_from_name(value.word), axis.name, value.word, "fast, default, hard"),
        scene.options.contact);
}

Scene scene_at(const Study& study, const std::vector<AxisValue>& values) {
  Scene scene = study.scene;
  for (const bool parameters : {false, true})
    for (std::size_t i = 0; i < values.size(); ++i) {
      const Axis& axis = study.axes[i];
      if (axis.changes_scene() && axis.parameter.has_value() == parameters)
        change_scene(axis, values[i], scene);
    }
  return scene;
}

Trial::Trial(const Study& study, const Scene& scene)
    : q(scene.q), v(scene.v), options(scene.options) {
  inputs.file = study.inputs;
  inputs.random_scale = study.random_inputs;
  inputs.random_wrench_scale = study.random_wrenches;
  inputs.seed = study.seed;
}

void Trial::finish(std::int64_t draw) {
  if (!q.allFinite() || !v.allFinite()) throw InputError("the start is no finite number");
  if (!seeded) inputs.seed += static_cast<std::uint64_t>(draw);
  for (const auto& [at, rpy] : angles) {
    const Quaternion turned(rotation_from_rpy(rpy.x(), rpy.y(), rpy.z()));
    q.segment<4>(at) << turned.w(), turned.x(), turned.y(), turned.z();
  }
}

bool set_named_quantity(Axis& axis) {
  for (const Quantity& quantity : kQuantities) {
    if (axis.name != quantity.name) continue;
    if (quantity.set != nullptr) axis.set = quantity.set;
    axis.takes_words = quantity.words;
    axis.takes_files = axis.name == "inputs";
    return true;
  }
  return false;
}

std::vector<std::string> named_quantities(bool words) {
  std::vector<std::string> names;
  for (const Quantity& quantity : kQuantities)
    if (quantity.words == words) names.emplace_back(quantity.name);
  return names;
}

}  // namespace counterpoint::apps::sweep
