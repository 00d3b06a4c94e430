#include "study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "axis_reader.h"
#include "input/applied_inputs.h"
#include "input/data_folder.h"
#include "tasks/fingerprint.h"

namespace counterpoint::apps::sweep {
namespace {

namespace fs = std::filesystem;

/// True for figures that depend on the machine and its load: a table with them would not be
/// reproducible.
bool is_time(const std::string& metric) {
  return metric == "wall_seconds" || metric == "realtime_factor" ||
         metric.rfind("step_time_", 0) == 0;
}

std::string scene_path(const YamlValue& value, const fs::path& study) {
  const fs::path given = value.text();
  const fs::path beside = study.parent_path() / given;
  std::error_code error;
  if (given.is_relative() && fs::is_regular_file(beside, error)) return beside.string();
  try {
    const std::string found = bundled_scene(given.string());
    if (fs::is_regular_file(found, error)) return found;
  } catch (const InputError& e) {
    value.fail(e.what());
  }
  value.fail(fmt::format(
      "there is no file {}; expected one beside the study, or the name of a bundled scene",
      beside.string()));
}

RecordedColumn read_column(const YamlValue& value, const CoordinateNames& names) {
  using Of = RecordedColumn::Of;
  RecordedColumn column;
  column.name = value.text();
  std::string name = column.name;
  for (const auto& [word, of] :
       {std::pair{"min(", Of::kMin}, {"max(", Of::kMax}, {"mean(", Of::kMean}}) {
    const size_t length = std::string_view(word).size();
    if (name.rfind(word, 0) != 0 || name.back() != ')') continue;
    column.of = of;
    name = name.substr(length, name.size() - length - 1);
    break;
  }
  for (const auto* list : {&names.q, &names.v}) {
    const auto found = std::find(list->begin(), list->end(), name);
    if (found == list->end()) continue;
    column.velocity = list == &names.v;
    column.index = static_cast<int>(found - list->begin());
    return column;
  }
  value.fail(
      fmt::format("'{}' is no coordinate of the scene; expected NAME, min(NAME), max(NAME) or "
                  "mean(NAME) with one of: {}, {}",
                  column.name, fmt::join(names.q, ", "), fmt::join(names.v, ", ")));
}

Record read_record(const YamlValue& value, const Model& model) {
  value.expect_map({"final_state", "columns", "figures", "trajectories"});
  Record record;
  const CoordinateNames names = coordinate_names(model);
  if (value.has("final_state")) record.final_state = value.at("final_state").boolean();
  if (value.has("trajectories")) record.trajectories = value.at("trajectories").boolean();
  if (value.has("columns"))
    for (const YamlValue& one : value.at("columns").list())
      record.columns.push_back(read_column(one, names));
  if (!value.has("figures")) return record;
  for (const YamlValue& one : value.at("figures").list()) {
    record.metrics.push_back(one.text());
    if (is_time(record.metrics.back()))
      one.fail(
          "is a time of this machine, not the same twice; the table is to be. `counterpoint "
          "simulate "
          "--json` has it");
  }
  return record;
}

/// Hash of the study file, the files that it names, and the version, so that results of another
/// study are not reused.
std::uint64_t fingerprint_of(const Study& study) {
  tasks::Fingerprint hash;
  hash.add_file(study.file);
  hash.add_scene(study.scene);
  if (!study.inputs.empty()) hash.add_file(study.inputs);
  for (const Axis& axis : study.axes)
    for (const std::string& word : axis.words) {
      hash.add(std::string_view(word));
      if (axis.takes_files) hash.add_file(word);
    }
  return hash.value();
}

void read_settings(const YamlValue& root, Study& study) {
  std::optional<double> duration, time_step;
  if (root.has("duration")) duration = root.at("duration").positive();
  if (root.has("time_step")) time_step = root.at("time_step").positive();
  override_times(duration, time_step, study.scene.options);
  if (root.has("set")) {
    std::string settings;
    for (const auto& [name, value] : root.at("set").entries())
      settings += fmt::format("{}{}={:.17g}", settings.empty() ? "" : ",", name, value.number());
    try {
      study.scene = with_settings(std::move(study.scene), settings);
    } catch (const InputError& error) {
      root.at("set").fail(error.what());
    }
  }
  if (root.has("seed"))
    study.seed =
        static_cast<std::uint64_t>(root.at("seed").integer(0, std::numeric_limits<int>::max()));
  if (root.has("draws")) study.draws = root.at("draws").integer(1, 1'000'000'000);
  if (root.has("random_inputs")) study.random_inputs = root.at("random_inputs").number(0.0, 1e6);
  if (root.has("random_wrenches"))
    study.random_wrenches = root.at("random_wrenches").number(0.0, 1e6);
  if (root.has("inputs")) study.inputs = file_beside(root.at("inputs"), study.file);
}

}  // namespace

std::int64_t Study::num_tasks() const {
  std::int64_t count = draws;
  for (const Axis& axis : axes) count *= axis.levels();
  return count;
}

Study load_study(const fs::path& file) {
  const YamlValue root = YamlValue::load(file);
  root.expect_map({"name", "scene", "duration", "time_step", "set", "seed", "draws", "inputs",
                   "random_inputs", "random_wrenches", "vary", "record"});
  Study study;
  study.file = file;
  study.scene_file = scene_path(root.at("scene"), file);
  study.scene = load_scene(study.scene_file);
  read_settings(root, study);
  double tasks = static_cast<double>(study.draws);
  bool random = study.random_inputs > 0.0 || study.random_wrenches > 0.0;
  const YamlValue vary = root.at("vary");
  for (const auto& [name, value] : vary.entries()) {
    study.axes.push_back(read_axis(name, value, study));
    const Axis& axis = study.axes.back();
    random = random || axis.random || name == "random_inputs" || name == "random_wrenches";
    tasks *= static_cast<double>(axis.levels());
    if (tasks > 1e12) value.fail("makes more than 1e12 tasks; expected fewer points or draws");
  }
  if (study.draws > 1 && !random)
    root.at("draws").fail(
        "nothing is random: all draws would be the same; leave it out, or give an axis "
        "{uniform: [LOW, HIGH]} or the like, or random_inputs");
  if (root.has("record")) study.record = read_record(root.at("record"), study.scene.model);
  study.fingerprint = fingerprint_of(study);
  return study;
}

}  // namespace counterpoint::apps::sweep
