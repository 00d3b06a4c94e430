#include "axis_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "variation.h"

namespace counterpoint::apps::sweep {
namespace {

namespace fs = std::filesystem;

constexpr int kMostPoints = 1'000'000;
/// Number of values of a list that are tried when the study is read. Later values that cannot run
/// become failed rows.
constexpr std::size_t kMostTried = 100;

/// Finds a coordinate of the start, or an angle of a free body. False if the name is neither.
bool find_coordinate(const std::string& name, const YamlValue& value, const Model& model,
                     Axis& axis) {
  const CoordinateNames names = coordinate_names(model);
  const auto index_of = [](const std::vector<std::string>& list, const std::string& what) {
    return static_cast<int>(std::find(list.begin(), list.end(), what) - list.begin());
  };
  const size_t dot = name.rfind('.');
  if (dot == std::string::npos) return false;
  const std::string owner = name.substr(0, dot), last = name.substr(dot + 1);
  constexpr std::array kAngles = {"roll", "pitch", "yaw"};
  const int quaternion = index_of(names.q, owner + ".qw");
  const bool turns = quaternion < static_cast<int>(names.q.size());
  const auto angle = std::find(kAngles.begin(), kAngles.end(), last);
  if (turns && angle != kAngles.end()) {
    axis.set = [quaternion, i = angle - kAngles.begin()](const AxisValue& x, Trial& trial) {
      trial.angles.try_emplace(quaternion, Vector3::Zero()).first->second[i] = x.number;
    };
    return true;
  }
  if (const int i = index_of(names.q, name); i < static_cast<int>(names.q.size())) {
    if (turns && last.size() == 2 && last[0] == 'q')
      value.fail(fmt::format(
          "a quaternion cannot vary by one of its numbers; use {0}.roll, {0}.pitch, {0}.yaw [rad]",
          owner));
    axis.set = [i](const AxisValue& x, Trial& trial) { trial.q[i] = x.number; };
    return true;
  }
  if (const int i = index_of(names.v, name); i < static_cast<int>(names.v.size())) {
    axis.set = [i](const AxisValue& x, Trial& trial) { trial.v[i] = x.number; };
    return true;
  }
  return false;
}

void find_quantity(const YamlValue& value, const Scene& scene, Axis& axis) {
  if (set_named_quantity(axis) || find_coordinate(axis.name, value, scene.model, axis)) return;
  try {
    axis.parameter = parse_parameters(axis.name, scene).front();
  } catch (const InputError& error) {
    value.fail(fmt::format(
        "'{}' is nothing that can vary: expected a coordinate of the start (cube.vx), {}, {}, or "
        "a figure of the scene ({})",
        axis.name, fmt::join(named_quantities(false), ", "),
        fmt::join(named_quantities(true), ", "), error.what()));
  }
}

void read_range(const YamlValue& value, Axis& axis) {
  value.expect_map({"from", "to", "points", "log"});
  const double from = value.at("from").number(), to = value.at("to").number();
  const int points = value.at("points").integer(2, kMostPoints);
  const bool log = value.has("log") && value.at("log").boolean();
  if (log && !(from > 0.0 && to > 0.0)) value.fail("log: true needs 'from' and 'to' above 0");
  for (int i = 0; i < points; ++i) {
    const double share = static_cast<double>(i) / (points - 1);
    const double x = log ? from * std::pow(to / from, share) : from + share * (to - from);
    axis.numbers.push_back(i == 0 ? from : i == points - 1 ? to : x);
  }
}

void read_random(const YamlValue& value, Axis& axis) {
  value.expect_map({"uniform", "log_uniform", "normal"});
  const auto entries = value.entries();
  if (entries.size() != 1) value.fail("expected one of uniform, log_uniform, normal");
  const auto& [word, two] = entries.front();
  const std::vector<double> numbers = two.numbers();
  const bool normal = word == "normal";
  if (numbers.size() != 2)
    two.fail(normal ? "expected [MEAN, STANDARD DEVIATION]" : "expected [LOW, HIGH]");
  axis.random = true;
  axis.a = numbers[0];
  axis.b = numbers[1];
  axis.distribution = normal              ? Distribution::kNormal
                      : word == "uniform" ? Distribution::kUniform
                                          : Distribution::kLogUniform;
  if (normal && !(axis.b >= 0.0)) two.fail("the standard deviation must not be below 0");
  if (!normal && !(axis.a < axis.b)) two.fail("expected LOW below HIGH");
  if (word == "log_uniform" && !(axis.a > 0.0)) two.fail("log_uniform needs LOW above 0");
}

void read_values(const YamlValue& value, const Study& study, Axis& axis) {
  if (value.is_map()) {
    if (axis.takes_words) value.fail(fmt::format("{} varies over a list of words", axis.name));
    if (value.has("from") || value.has("to") || value.has("points"))
      read_range(value, axis);
    else
      read_random(value, axis);
    return;
  }
  if (!value.is_list())
    value.fail(
        "expected a list [A, B, ...], {from: A, to: B, points: N}, or one of {uniform: [LOW, "
        "HIGH]}, "
        "{log_uniform: [LOW, HIGH]}, {normal: [MEAN, DEVIATION]}");
  for (const YamlValue& one : value.list()) {
    if (axis.takes_files)
      axis.words.push_back(file_beside(one, study.file));
    else if (axis.takes_words)
      axis.words.push_back(one.text());
    else
      axis.numbers.push_back(one.number());
  }
  if (axis.numbers.empty() && axis.words.empty())
    value.fail("the list is empty: expected a value or more");
}

/// Tries values while the line of the file is known, instead of failing in the middle of a sweep.
void try_values(const YamlValue& value, const Study& study, const Axis& axis) {
  const std::vector<YamlValue> lines = value.is_list() ? value.list() : std::vector<YamlValue>{};
  const std::size_t count = static_cast<std::size_t>(axis.random ? 0 : axis.levels());
  for (std::size_t i = 0; i < std::min(count, kMostTried); ++i) {
    try {
      const AxisValue one =
          axis.has_words() ? AxisValue{0.0, axis.words[i]} : AxisValue{axis.numbers[i], {}};
      if (axis.changes_scene()) {
        Scene changed = study.scene;
        change_scene(axis, one, changed);
      } else {
        Trial trial(study, study.scene);
        axis.set(one, trial);
        trial.finish();
      }
    } catch (const InputError& error) {
      (lines.empty() ? value : lines[i]).fail(error.what());
    }
  }
}

}  // namespace

std::string file_beside(const YamlValue& value, const fs::path& study) {
  const fs::path given = value.text();
  const fs::path file = given.is_absolute() ? given : study.parent_path() / given;
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    value.fail(fmt::format("there is no file {}", file.string()));
  return file.string();
}

Axis read_axis(const std::string& name, const YamlValue& value, const Study& study) {
  Axis axis;
  axis.name = name;
  find_quantity(value, study.scene, axis);
  read_values(value, study, axis);
  try_values(value, study, axis);
  return axis;
}

}  // namespace counterpoint::apps::sweep
