#include "recordings/identify_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/trajectory.h"
#include "recordings/page.h"

namespace counterpoint::apps {
namespace {

/// Parameters of a page's table of correlations, at most.
constexpr std::size_t kCorrelated = 20;

Json json_metrics(const std::vector<Prediction>& predictions, Compared by) {
  Json out = Json::object();
  for (const auto& [name, value] : median_metrics(predictions, by)) out[name] = value;
  return out;
}

/// Returns a number, or a dash for null.
std::string number_text(const Json& value) {
  return value.is_number() ? fmt::format("{:.5g}", value.get<double>()) : std::string("-");
}

Json json_parameter(const Parameter& parameter, double scene, const FittedParameter& found) {
  const auto number = [](const std::optional<Interval>& i, double Interval::*side) {
    return i ? Json((*i).*side) : Json();
  };
  return {{"name", parameter.name},
          {"unit", parameter.unit},
          {"scene", scene},
          {"value", found.value},
          {"lower_95", number(found.interval, &Interval::lower)},
          {"upper_95", number(found.interval, &Interval::upper)},
          {"bootstrap_lower_95", number(found.bootstrap, &Interval::lower)},
          {"bootstrap_upper_95", number(found.bootstrap, &Interval::upper)},
          {"identifiable", found.interval.has_value()},
          {"lower_bound", parameter.lower},
          {"upper_bound", parameter.upper},
          {"at_bound", found.at_bound},
          {"prior_deviation", parameter.deviation ? Json(*parameter.deviation) : Json()}};
}

void print_parameter(const Json& p, const Report& report) {
  std::string interval = "not identifiable", bootstrap;
  if (p["identifiable"])
    interval =
        p["lower_95"].is_null() ? "" : format_entries("{lower_95:.5g} ... {upper_95:.5g}", p);
  if (!p["bootstrap_lower_95"].is_null())
    bootstrap =
        format_entries(", bootstrap {bootstrap_lower_95:.5g} ... {bootstrap_upper_95:.5g}", p);
  report.print("{}{}{}{}{}", format_entries("  {name:<22} {value:>11.6g} {unit:<18} 95 %: ", p),
               interval, bootstrap, p["at_bound"] ? ", at its bound" : "",
               format_entries(" (scene {scene:.6g})\n", p));
}

/// Writes the base parameters with 95 % intervals, if every moving body has inertial parameters
/// among those found or is known.
void fill_base_parameters(const Model& model, const TorqueFit& found, Report& report) {
  if (found.bodies.empty()) return;
  const BaseParameters base = base_parameters(model);
  VectorX all = inertial_parameters(model);
  std::vector<Eigen::Index> columns;
  for (std::size_t b = 0; b < found.bodies.size(); ++b) {
    const Eigen::Index at = 10 * (found.bodies[b] - 1);
    all.segment<10>(at) = found.inertial.segment<10>(10 * static_cast<Eigen::Index>(b));
    for (Eigen::Index k = 0; k < 10; ++k) columns.push_back(at + k);
  }
  const VectorX values = base.combinations * all;
  const MatrixX moved = base.combinations(Eigen::all, columns);
  const VectorX deviations =
      (moved * found.inertial_covariance * moved.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
  Json& list = report["base_parameters"] = Json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i)
    list.push_back({{"name", base.names[static_cast<std::size_t>(i)]},
                    {"value", values[i]},
                    {"deviation", deviations[i]}});
  report.print(
      "motions of these links tell {} combinations of their {} inertial parameters (--json: "
      "base_parameters)\n",
      values.size(), all.size());
}

void add_parameters(const Json& report, HtmlPage& page) {
  const Json& list = report["parameters"];
  PageTable table{{"parameter", "unit", "scene", "found", "95 % from", "to", "bounds from", "to",
                   "prior deviation"},
                  {}};
  for (const Json& p : list) {
    std::vector<std::string>& row = table.rows.emplace_back();
    row = {p["name"], p["unit"]};
    for (const char* key : {"scene", "value", "lower_95", "upper_95", "lower_bound", "upper_bound",
                            "prior_deviation"})
      row.push_back(number_text(p[key]));
  }
  page.table(table);
  if (!report.contains("fold_parameters")) return;
  page.heading(fmt::format("Parameters over {} folds", report["folds"].size()));
  PageTable folds{{"parameter", "unit", "mean", "standard deviation"}, {}};
  for (const Json& p : report["fold_parameters"])
    folds.rows.push_back(
        {p["name"], p["unit"], number_text(p["mean"]), number_text(p["deviation"])});
  page.table(folds);
}

/// Adds what the recordings do not tell, the singular values, and the correlations.
void add_told(const Json& report, HtmlPage& page) {
  page.heading("Combinations that the recordings do not tell");
  std::vector<std::string> untold;
  for (const Json& direction : report["told"]["untold"])
    untold.push_back(direction["words"].get<std::string>());
  if (untold.empty()) untold.push_back("none");
  page.list(untold);
  page.heading("Singular values of the sensitivity [noise deviations a range]");
  PageTable spectrum{{"direction", "singular value"}, {}};
  for (const Json& value : report["told"]["spectrum"])
    spectrum.rows.push_back({std::to_string(spectrum.rows.size() + 1), number_text(value)});
  page.table(spectrum);
  const Json& list = report["parameters"];
  if (list.size() > kCorrelated) return;
  page.heading("Correlations of the estimates");
  PageTable correlations{{"parameter"}, {}};
  for (std::size_t i = 0; i < list.size(); ++i) {
    correlations.header.push_back(list[i]["name"]);
    std::vector<std::string> row = {list[i]["name"].get<std::string>()};
    for (const Json& value : report["correlation"][i])
      row.push_back(fmt::format("{:.3f}", value.get<double>()));
    correlations.rows.push_back(row);
  }
  page.table(correlations);
}

}  // namespace

Rollouts roll_out(Experiment e, const Scene& found, const std::vector<int>& which) {
  e.prediction.horizon = 0;
  e.map.sensors.clear();  // recorded readings that rollouts are not compared with
  return {predict_all(e, e.scene, which), predict_all(e, found, which)};
}

Json score(const Rollouts& rollouts, Compared by) {
  const auto& [before, after] = rollouts;
  int better = 0;
  for (size_t i = 0; i < before.size(); ++i)
    better += metrics(after[i], by)[0].second < metrics(before[i], by)[0].second;
  return {{"recordings", before.size()},
          {"better", better},
          {"scene", json_metrics(before, by)},
          {"found", json_metrics(after, by)}};
}

void print_score(const char* title, const Json& score, const Report& report) {
  report.print("{}: {}", title,
               format_entries("{recordings} recordings, {better} of them predicted better; median "
                              "as the scene is / as found\n",
                              score));
  const Json& found = score["found"];
  for (const auto& [name, value] : score["scene"].items())
    if (found.contains(name))
      report.print("  {:<26} {:10.5g} {:10.5g}\n", name, value.get<double>(),
                   found[name].get<double>());
}

void print_coordinates(const Json& coordinates, const Report& report) {
  const auto number = [](const Json& x) {
    return x.is_null() ? std::string("-") : fmt::format("{:.4g}", x.get<double>());
  };
  report.print("  rms of the difference and R2, as the scene is / as found\n");
  const size_t count = std::min(coordinates["scene"].size(), coordinates["found"].size());
  for (size_t i = 0; i < count; ++i) {
    const Json &before = coordinates["scene"][i], &after = coordinates["found"][i];
    report.print("  {:<26} {:>10} {:>10} {:>10} {:>10}\n", before["name"].get<std::string>(),
                 number(before["rms"]), number(after["rms"]), number(before["r2"]),
                 number(after["r2"]));
  }
}

void fill_report(const std::vector<Parameter>& parameters, const VectorX& start, const Fit& found,
                 Report& report) {
  report["status"] = "ok";
  Json list = Json::array();
  std::string set;
  for (size_t i = 0; i < parameters.size(); ++i) {
    list.push_back(
        json_parameter(parameters[i], start[static_cast<Eigen::Index>(i)], found.parameters[i]));
    print_parameter(list.back(), report);
    set += fmt::format("{}{}={:.8g}", i == 0 ? "" : ",", parameters[i].name,
                       found.parameters[i].value);
  }
  report.print("  --set {}\n", set);
  report["parameters"] = list;
  report["set"] = set;
  Json correlation = Json::array();
  for (Eigen::Index i = 0; i < found.correlation.rows(); ++i) {
    const VectorX row = found.correlation.row(i);
    correlation.push_back(std::vector<double>(row.begin(), row.end()));
  }
  report["correlation"] = correlation;
  report["start_cost"] = found.start_cost;
  report["cost"] = found.cost;
  report["loss_scale"] = found.loss_scale;
  report["evaluations"] = found.evaluations;
  report["linearizations"] = found.linearizations;
}

void write_settings(const std::string& file, const std::string& scene_file,
                    const Json& parameters) {
  std::string text = fmt::format("# Identified for {}: counterpoint ... --set @{}\n", scene_file,
                                 std::filesystem::path(file).filename().string());
  for (const Json& p : parameters) {
    text += format_entries("{name}={value:.10g}  # {unit}; ", p);
    text += p["lower_95"].is_null() ? "not told"
                                    : format_entries("95 %: {lower_95:.5g} ... {upper_95:.5g}", p);
    text += format_entries("; scene {scene:.6g}\n", p);
  }
  write_file(file, text);
}

void fill_constants(const std::vector<EstimatedParameter>& constants, Report& report) {
  if (constants.empty()) return;
  Json& list = report["sensor_constants"] = Json::array();
  for (const EstimatedParameter& one : constants) {
    list.push_back({{"name", one.name},
                    {"unit", one.unit},
                    {"value", one.value},
                    {"deviation", one.deviation}});
    report.print("{}", format_entries("  {name:<22} {value:>11.6g} {unit:<18} standard deviation "
                                      "{deviation:.2g}\n",
                                      list.back()));
  }
}

void fill_told(const std::vector<Parameter>& parameters, const Fit& found, Report& report) {
  const Identifiability told = identifiability(parameters, found);
  Json& out = report["told"];
  out["spectrum"] = std::vector<double>(told.spectrum.begin(), told.spectrum.end());
  out["untold"] = Json::array();
  for (const UntoldDirection& direction : told.untold) {
    Json changes = Json::object();
    for (const auto& [i, change] : direction.parts)
      changes[parameters[static_cast<std::size_t>(i)].name] = change;
    out["untold"].push_back(
        {{"words", direction.words}, {"deviation", direction.deviation}, {"changes", changes}});
  }
  Json& shares = out["shares"] = Json::object();
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const VectorX row = told.shares.row(static_cast<Eigen::Index>(i));
    shares[parameters[i].name] = std::vector<double>(row.begin(), row.end());
  }
  const std::size_t count = parameters.size();
  report.print(
      "{} of {} directions are told; singular values {:.3g} ... {:.3g} noise deviations "
      "a range\n",
      count - told.untold.size(), count, told.spectrum[0], told.spectrum[told.spectrum.size() - 1]);
  for (const UntoldDirection& direction : told.untold)
    report.print("  not told: {}\n", direction.words);
}

void fill_torques(const Model& model, const TorqueFit& found, Report& report) {
  fill_base_parameters(model, found, report);
  if (!report["told"]["untold"].empty())
    report.print("`counterpoint excite` designs a motion that tells as much as any can\n");
  const CoordinateNames names = coordinate_names(model);
  Json& channels = report["channels"] = Json::array();
  for (const TorqueChannel& channel : found.channels)
    channels.push_back({{"name", names.force[static_cast<std::size_t>(channel.coordinate)]},
                        {"rows", channel.rows},
                        {"deviation", channel.deviation},
                        {"correlation", channel.correlation}});
}

void write_identify_page(const std::string& folder, const std::string& scene_file,
                         const Rollouts& rollouts, Compared by, const Json& report) {
  const auto& [before, after] = rollouts;
  HtmlPage page("Parameters found: " + scene_file);
  add_parameters(report, page);
  add_told(report, page);
  for (const char* part : {"train", "test"}) {
    if (!report.contains(part)) continue;
    page.heading(fmt::format("{}: {} recordings", part, report[part]["recordings"].get<int>()));
    PageTable scores{{"median", "scene", "found"}, {}};
    for (const auto& [name, value] : report[part]["scene"].items())
      scores.rows.push_back(
          {name, number_text(value), number_text(report[part]["found"].value(name, Json()))});
    page.table(scores);
  }
  for (const Chart& chart : error_charts({{"scene", &before}, {"as found", &after}}, by))
    page.picture_with_file(svg(chart));
  page.heading("Each recording not fitted, as found");
  page.table(prediction_table(after, by));
  write_page(folder, page);
}

std::vector<Chart> force_charts(const TorqueScore& before, const TorqueScore& after) {
  std::vector<Chart> out;
  for (std::size_t c = 0; c < after.coordinates.size(); ++c) {
    Chart& chart = out.emplace_back();
    chart.title = after.coordinates[c].name;
    chart.x_label = "compared row";
    chart.y_label = "force [N, N m]";
    for (const auto& [name, values] :
         {std::pair{"recorded", &after.recorded[c]}, std::pair{"scene", &before.predicted[c]},
          std::pair{"found", &after.predicted[c]}}) {
      Curve& curve = chart.curves.emplace_back();
      curve.name = name;
      for (Eigen::Index i = 0; i < values->size(); ++i)
        curve.add(static_cast<double>(i), (*values)[i]);
    }
  }
  return out;
}

void write_torque_page(const std::string& folder, const std::string& scene_file,
                       const std::vector<Chart>& charts, const Json& report) {
  HtmlPage page("Parameters found: " + scene_file);
  add_parameters(report, page);
  add_told(report, page);
  for (const char* part : {"train", "test"}) {
    if (!report.contains(part)) continue;
    const Json& scored = report[part];
    page.heading(fmt::format("{}: {} recordings", part, scored["recordings"].get<int>()));
    PageTable table{{"force", "rms of the difference, scene", "found", "R2, scene", "found"}, {}};
    const Json &before = scored["coordinates"]["scene"], &after = scored["coordinates"]["found"];
    for (std::size_t i = 0; i < before.size(); ++i)
      table.rows.push_back({before[i]["name"], number_text(before[i]["rms"]),
                            number_text(after[i]["rms"]), number_text(before[i]["r2"]),
                            number_text(after[i]["r2"])});
    page.table(table);
  }
  page.heading("Forces, of the recordings not fitted if there are any");
  for (const Chart& chart : charts) page.picture_with_file(svg(chart));
  write_page(folder, page);
}

}  // namespace counterpoint::apps
