#include "page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/chart.h"
#include "report/html_page.h"
#include "variation.h"

namespace counterpoint::apps::sweep {
namespace {

constexpr std::int64_t kMostPlottedPoints = 2000;  // in one plot
constexpr std::size_t kMostRecorded = 8, kMostPlots = 48;

/// Order of the recorded values in plots: figures and chosen columns first, because they were
/// requested by name.
std::vector<std::size_t> shown_first(const Study& study) {
  const std::size_t all = recorded_names(study).size();
  const std::size_t chosen = study.record.columns.size() + study.record.metrics.size();
  std::vector<std::size_t> order;
  for (std::size_t i = all - chosen; i < all; ++i) order.push_back(i);
  for (std::size_t i = 0; i < all - chosen; ++i) order.push_back(i);
  if (order.size() > kMostRecorded) order.resize(kMostRecorded);
  return order;
}

}  // namespace

Page::Page(const Study& study)
    : study_(study),
      every_(std::max<std::int64_t>(
          1, (study.num_tasks() + kMostPlottedPoints - 1) / kMostPlottedPoints)) {
  for (const std::size_t recorded : shown_first(study)) {
    for (std::size_t axis = 0; axis < study.axes.size() && plots_.size() < kMostPlots; ++axis) {
      const Axis& one = study.axes[axis];
      if (!one.random && one.levels() < 2) continue;
      const auto levels = static_cast<std::size_t>(one.random ? 0 : one.levels());
      plots_.push_back(
          {axis, recorded, {}, {}, {}, std::vector<double>(levels), std::vector<double>(levels)});
    }
  }
}

void Page::add(std::int64_t task, const Row& row) {
  const std::vector<double> recorded = recorded_values(row);
  const std::vector<AxisValue> values = values_of(study_, task);
  for (Plot& plot : plots_) {
    const Axis& axis = study_.axes[plot.axis];
    const double y = recorded[plot.recorded];
    if (!std::isfinite(y)) continue;
    double x = values[plot.axis].number;
    if (!axis.random) {
      const std::size_t level = axis.level_of(values[plot.axis]);
      if (axis.has_words()) x = static_cast<double>(level);
      plot.sums[level] += y;
      plot.counts[level] += 1.0;
    }
    if (task % every_ != 0) continue;
    plot.x.push_back(x);
    plot.y.push_back(y);
    plot.remarks.push_back(fmt::format("task {}{}", task, row.failed() ? ", failed" : ""));
  }
}

std::string Page::text(const Summary& summary, const std::string& table) const {
  HtmlPage page("Sweep: " + study_.file.filename().string());
  page.paragraph(fmt::format("{} tasks on {}, {} of them failed. All rows: {}.", summary.rows,
                             study_.scene_file, summary.failed, table));
  if (every_ > 1)
    page.paragraph(fmt::format(
        "Dots: every task whose number {} divides. Lines: means over all tasks.", every_));
  if (!summary.reasons.empty()) {
    page.heading("Failed");
    PageTable reasons{{"task", "reason"}, {}};
    for (const auto& [task, reason] : summary.reasons)
      reasons.rows.push_back({std::to_string(task), reason});
    page.table(reasons);
  }
  const std::vector<std::string> names = recorded_names(study_);
  for (const Plot& plot : plots_) {
    const Axis& axis = study_.axes[plot.axis];
    Chart chart;
    chart.title = names[plot.recorded] + " over " + axis.name;
    chart.x_label = axis.name;
    if (axis.parameter && !axis.parameter->unit.empty())
      chart.x_label += " [" + axis.parameter->unit + "]";
    for (std::size_t i = 0; i < axis.words.size(); ++i)
      chart.x_label += fmt::format("{} {} = {}", i == 0 ? ":" : ",", i, axis.words[i]);
    chart.y_label = names[plot.recorded];
    Curve dots{"tasks", plot.x, plot.y, true, false, plot.remarks};
    if (!axis.random) {
      Curve means{"mean", {}, {}, false, true, {}};
      std::vector<std::pair<double, double>> points;
      for (std::size_t i = 0; i < plot.counts.size(); ++i)
        if (plot.counts[i] > 0.0)
          points.emplace_back(axis.has_words() ? static_cast<double>(i) : axis.numbers[i],
                              plot.sums[i] / plot.counts[i]);
      std::sort(points.begin(), points.end());
      for (const auto& [x, y] : points) means.add(x, y);
      chart.curves.push_back(means);
    }
    chart.curves.push_back(dots);
    page.picture(svg(chart));
  }
  return page.text();
}

}  // namespace counterpoint::apps::sweep
