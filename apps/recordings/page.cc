#include "page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/report.h"

namespace counterpoint::apps {
namespace {

/// Values of one recording over its rows.
struct Series {
  std::vector<double> time, value;
};

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[std::lround(share * static_cast<double>(values.size() - 1))];
}

/// Quantile over the recordings row by row, as long as at least half of them have the row.
Curve over_recordings(const std::string& name, const std::vector<Series>& all, double share) {
  Curve curve{.name = name, .x = {}, .y = {}};
  for (size_t row = 0;; ++row) {
    std::vector<double> values;
    double time = 0.0;
    for (const Series& one : all) {
      if (row >= one.value.size()) continue;
      values.push_back(one.value[row]);
      time += one.time[row] - one.time[0];
    }
    if (values.empty() || 2 * values.size() < all.size()) return curve;
    curve.add(time / static_cast<double>(values.size()), quantile(values, share));
  }
}

void add_curves(const std::string& name, const std::vector<Series>& all, bool alone, Chart& chart) {
  chart.curves.push_back(over_recordings(all.size() > 1 ? name + ", median" : name, all, 0.5));
  if (!alone || all.size() < 4) return;
  chart.curves.push_back(over_recordings("lower quartile", all, 0.25));
  chart.curves.push_back(over_recordings("upper quartile", all, 0.75));
}

Chart error_chart(const std::vector<NamedPredictions>& sets, const std::string& title,
                  const std::string& unit, double Deviation::*metric, double scale) {
  Chart chart;
  chart.title = title;
  chart.y_label = unit;
  for (const NamedPredictions& set : sets) {
    std::vector<Series> all;
    for (const Prediction& p : *set.predictions) {
      if (p.failure) continue;
      Series& one = all.emplace_back();
      one.time = p.time;
      for (const Deviation& d : p.deviations) one.value.push_back(scale * (d.*metric));
    }
    if (!all.empty()) add_curves(set.name, all, sets.size() == 1, chart);
  }
  return chart;
}

}  // namespace

std::vector<Chart> error_charts(const std::vector<NamedPredictions>& sets, Compared by) {
  if (by == Compared::kImpacts) return {};
  if (by == Compared::kJoints)
    return {error_chart(sets, "Joint error", "mean error [rad or m]", &Deviation::joints, 1.0)};
  return {error_chart(sets, "Position error", "error [mm]", &Deviation::position, 1e3),
          error_chart(sets, "Rotation error", "error [degrees]", &Deviation::rotation, 1.0)};
}

namespace {

/// Unit of a position, by its name or its joint type.
std::string unit_of(const Model& model, const ColumnMap::Entry& entry) {
  const auto ends = [&](const char* end) { return entry.name.ends_with(end); };
  if (ends(".x") || ends(".y") || ends(".z")) return "m";
  if (ends(".qw") || ends(".qx") || ends(".qy") || ends(".qz")) return "1";
  for (int i = 1; i < model.num_bodies(); ++i)
    if (model.body(i).q_index == entry.index)
      return model.body(i).joint_type == JointType::kPrismatic ? "m" : "rad";
  return "";
}

}  // namespace

std::vector<Chart> coordinate_charts(const Model& model, const Recording& recording,
                                     const Prediction& prediction, const ColumnMap& map) {
  const double end = prediction.time.empty() ? recording.time[0] : prediction.time.back();
  std::vector<Chart> charts;
  for (const ColumnMap::Entry& entry : map.entries) {
    if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
    Chart& chart = charts.emplace_back();
    chart.title = entry.name;
    chart.y_label = unit_of(model, entry);
    Curve recorded{.name = "recorded", .x = {}, .y = {}},
        simulated{.name = "simulated", .x = {}, .y = {}};
    for (int row = 0; row < recording.num_rows(); ++row) {
      recorded.add(recording.time[row], recording.q(entry.index, row));
      if (recording.time[row] <= end)
        simulated.add(recording.time[row], prediction.q(entry.index, row));
    }
    chart.curves = {recorded, simulated};
  }
  return charts;
}

PageTable prediction_table(const std::vector<Prediction>& predictions, Compared by) {
  PageTable table{{"recording", "rows"}, {}};
  for (const auto& [name, value] : metrics({}, by)) table.header.emplace_back(name);
  for (const Prediction& p : predictions) {
    std::vector<std::string>& row = table.rows.emplace_back();
    row = {std::filesystem::path(p.file).filename().string(), std::to_string(p.rows)};
    for (const auto& [name, value] : metrics(p, by))
      row.push_back(p.failure ? "failed" : fmt::format("{:.4g}", value));
  }
  return table;
}

Json coordinate_list(const std::vector<CoordinateMetrics>& metrics) {
  Json list = Json::array();
  for (const CoordinateMetrics& one : metrics) {
    const auto number = [](const std::optional<double>& x) { return x ? Json(*x) : Json(); };
    list.push_back({{"name", one.name},
                    {"rms", one.rms},
                    {"mean", one.mean},
                    {"recorded_deviation", number(one.recorded_deviation)},
                    {"r2", number(one.r2)}});
  }
  return list;
}

PageTable coordinate_table(const std::vector<CoordinateMetrics>& metrics) {
  PageTable table{
      {"coordinate", "unexplained, rms [N or N m]", "mean", "recorded, deviation", "R2"}, {}};
  for (const CoordinateMetrics& one : metrics) {
    const auto text = [](const std::optional<double>& x) {
      return x ? fmt::format("{:.4g}", *x) : std::string("-");
    };
    table.rows.push_back(
        {one.name, text(one.rms), text(one.mean), text(one.recorded_deviation), text(one.r2)});
  }
  return table;
}

PageTable explanation_table(const std::vector<ExplainedRecording>& recordings) {
  PageTable table{{"recording", "rows"}, {}};
  for (const ExplainedRecording& one : recordings) {
    if (table.rows.empty())
      for (const auto& [name, value] : one.metrics) table.header.emplace_back(name);
    std::vector<std::string>& row = table.rows.emplace_back();
    row = {std::filesystem::path(one.file).filename().string(), std::to_string(one.rows)};
    for (const auto& [name, value] : one.metrics) row.push_back(fmt::format("{:.4g}", value));
  }
  return table;
}

Chart unexplained_chart(const std::vector<ExplainedRecording>& recordings) {
  Chart chart;
  chart.title = "Unexplained force";
  chart.y_label = "of the weight; joints: N or N m";
  std::vector<Series> all;
  for (const ExplainedRecording& recording : recordings) {
    Series& one = all.emplace_back();
    one.time = recording.time;
    for (const Explanation& step : recording.steps)
      one.value.push_back(std::max(step.unexplained_force, step.unexplained_joint));
  }
  add_curves("unexplained", all, true, chart);
  return chart;
}

void write_page(const std::filesystem::path& folder, const HtmlPage& page) {
  make_report_folder(folder);
  for (size_t i = 0; i < page.files().size(); ++i)
    write_file(folder / fmt::format("chart{}.svg", i), page.files()[i]);
  write_file(folder / "index.html", page.text());
}

}  // namespace counterpoint::apps
