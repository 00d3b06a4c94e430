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
Value named(const std::optional<Value>& found, const Axis& axis, const std::string& word,
            const char* words) {
  if (!found)
    throw InputError(
        fmt::format("{}: there is no '{}'; expected one of {}", axis.name, word, words));
  return *found;
}

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

bool changes_scene(const Axis& axis) {
  return axis.place == Place::kParameter || axis.place == Place::kContact;
}

void change_scene(const Axis& axis, const AxisValue& value, Scene& scene) {
  if (axis.place == Place::kContact)
    apply_contact_preset(
        named(contact_preset_from_name(value.word), axis, value.word, "fast, default, hard"),
        scene.options.contact);
  else
    scene = with_parameters(scene, {axis.parameter}, VectorX::Constant(1, value.number));
}

Scene scene_at(const Study& study, const std::vector<AxisValue>& values) {
  Scene scene = study.scene;
  for (const Place place : {Place::kContact, Place::kParameter})
    for (std::size_t i = 0; i < values.size(); ++i)
      if (study.axes[i].place == place) change_scene(study.axes[i], values[i], scene);
  return scene;
}

Trial::Trial(const Study& study, const Scene& scene)
    : q(scene.q), v(scene.v), options(scene.options) {
  inputs.file = study.inputs;
  inputs.random_scale = study.random_inputs;
  inputs.random_wrench_scale = study.random_wrenches;
  inputs.seed = study.seed;
}

void Trial::set(const Axis& axis, const AxisValue& value) {
  const double x = value.number;
  switch (axis.place) {
    case Place::kParameter:
    case Place::kContact:
      break;
    case Place::kPosition:
      q[axis.index] = x;
      break;
    case Place::kVelocity:
      v[axis.index] = x;
      break;
    case Place::kAngle:
      angles_.try_emplace(axis.index, Vector3::Zero()).first->second[axis.angle] = x;
      break;
    case Place::kTimeStep:
      override_times({}, x, options);
      break;
    case Place::kDuration:
      override_times(x, {}, options);
      break;
    case Place::kRandomInputs:
      inputs.random_scale = x;
      break;
    case Place::kRandomWrenches:
      inputs.random_wrench_scale = x;
      break;
    case Place::kInputSeed:
      if (!(x >= 0.0 && x < 0x1p53 && x == std::floor(x)))
        throw InputError(fmt::format("input_seed {}: expected a whole number, 0 or more", x));
      inputs.seed = static_cast<std::uint64_t>(x);
      seeded_ = true;
      break;
    case Place::kIntegrator:
      options.integrator = named(integrator_from_name(value.word), axis, value.word,
                                 "semi_implicit_euler, implicit_midpoint, runge_kutta_4");
      break;
    case Place::kFrictionModel:
      options.contact.friction_model =
          named(friction_model_from_name(value.word), axis, value.word, "coulomb, convex, lagged");
      break;
    case Place::kInputs:
      inputs.file = value.word;
      break;
  }
}

void Trial::finish(std::int64_t draw) {
  if (!q.allFinite() || !v.allFinite()) throw InputError("the start is no finite number");
  if (!seeded_) inputs.seed += static_cast<std::uint64_t>(draw);
  for (const auto& [at, rpy] : angles_) {
    const Quaternion turned(rotation_from_rpy(rpy.x(), rpy.y(), rpy.z()));
    q.segment<4>(at) << turned.w(), turned.x(), turned.y(), turned.z();
  }
}

}  // namespace counterpoint::apps::sweep
