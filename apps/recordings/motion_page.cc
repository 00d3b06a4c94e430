#include "recordings/motion_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/engine/trajectory.h"
#include "recordings/page.h"
#include "report/html_page.h"
#include "view/view_option.h"

namespace counterpoint::apps {
namespace {

/// Half the height of bands [standard deviations].
constexpr double kBand = 2.0;
/// Limits on the numbers of links and joints with charts.
constexpr std::size_t kLinksShown = 12, kJointsShown = 40;

Curve estimated_curve(const std::string& name, const MotionEstimate& estimate,
                      const MatrixX& values, const MatrixX& deviations, Eigen::Index row) {
  Curve curve{.name = name, .x = {}, .y = {}};
  for (std::size_t k = 0; k < estimate.time.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    if (!std::isfinite(values(row, column))) continue;
    curve.add(estimate.time[k], values(row, column));
    curve.band.push_back(kBand * deviations(row, column));
  }
  return curve;
}

Curve recorded_curve(const std::string& name, const Recording& recording, const MatrixX& values,
                     Eigen::Index row) {
  Curve curve{.name = name, .x = {}, .y = {}};
  for (std::size_t k = 0; k < recording.time.size(); ++k)
    curve.add(recording.time[k], values(row, static_cast<Eigen::Index>(k)));
  return curve;
}

Curve row_curve(const std::vector<double>& time, const VectorX& values, double scale) {
  Curve curve{.name = "", .x = {}, .y = {}};
  for (std::size_t k = 0; k < time.size(); ++k)
    if (const double value = values[static_cast<Eigen::Index>(k)]; std::isfinite(value))
      curve.add(time[k], scale * value);
  return curve;
}

/// Adds charts of the vertical and horizontal force of one sum.
void add_sum_charts(const ExplainedMotions& motions, std::size_t index, std::size_t sum,
                    const std::string& name, std::vector<Chart>& charts) {
  const MotionEstimate& estimate = motions.estimates[index];
  const Recording& recording = motions.recordings[index];
  const auto add = [&](std::size_t axis, Chart& chart) {
    const auto row = static_cast<Eigen::Index>(3 * sum + axis);
    const std::string letter(1, "xyz"[axis]);
    chart.curves.push_back(
        estimated_curve(letter, estimate, estimate.sum_force, estimate.sum_deviation, row));
    if (sum < motions.map.contact_forces.size() &&
        !motions.map.contact_forces[sum].components[axis].column.empty())
      chart.curves.push_back(
          recorded_curve(letter + ", recorded", recording, recording.contact_force, row));
  };
  Chart vertical, horizontal;
  vertical.title = name + ": contact force, vertical";
  horizontal.title = name + ": contact force, horizontal";
  vertical.y_label = horizontal.y_label = "force [N]";
  add(2, vertical);
  add(0, horizontal);
  add(1, horizontal);
  charts.push_back(std::move(vertical));
  charts.push_back(std::move(horizontal));
}

/// Selects the sums to show: all recorded ones, then the links with the largest forces.
std::vector<std::size_t> shown_sums(const ColumnMap& map, const MotionEstimate& estimate) {
  std::vector<std::size_t> order(estimate.sums.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t recorded = std::min(map.contact_forces.size(), order.size());
  const auto size = [&](std::size_t k) {
    const MatrixX force = estimate.sum_force.middleRows(static_cast<Eigen::Index>(3 * k), 3);
    return force.array().isFinite().select(force.array().abs(), 0.0).sum();
  };
  std::stable_sort(order.begin() + static_cast<std::ptrdiff_t>(recorded), order.end(),
                   [&](std::size_t a, std::size_t b) { return size(a) > size(b); });
  order.resize(std::min(order.size(), recorded + kLinksShown));
  return order;
}

void add_joint_charts(const ExplainedMotions& motions, std::size_t index,
                      std::vector<Chart>& charts) {
  const Model& model = motions.scene.model;
  const MotionEstimate& estimate = motions.estimates[index];
  const CoordinateNames names = coordinate_names(model);
  const std::vector<std::string> units = force_units(model);
  const std::vector<char> motors = optimization::motors_of(model);
  std::size_t shown = 0;
  for (std::size_t i = 0; i < motors.size() && shown < kJointsShown; ++i) {
    if (motors[i] == 0) continue;
    ++shown;
    const auto row = static_cast<Eigen::Index>(i);
    Chart& chart = charts.emplace_back();
    chart.title = names.force[i];
    chart.y_label = fmt::format("applied force [{}]", units[i]);
    chart.curves.push_back(
        estimated_curve("estimated", estimate, estimate.force, estimate.force_deviation, row));
    for (const ColumnMap::Entry& entry : motions.map.entries)
      if (entry.kind == ColumnMap::Entry::Kind::kForce && entry.index == row)
        chart.curves.push_back(recorded_curve("recorded", motions.recordings[index],
                                              motions.recordings[index].applied_force, row));
  }
}

/// Selects the rows for a replay: at most kDefaultRate per second, and the last one.
std::vector<std::size_t> played_rows(const std::vector<double>& time) {
  std::vector<std::size_t> out;
  view::FrameClock clock(view::kDefaultRate);
  for (std::size_t k = 0; k < time.size(); ++k)
    if (clock.due(time[k]) || k + 1 == time.size()) out.push_back(k);
  return out;
}

/// The estimated motion with its contact forces.
view::Clip estimated_clip(const MotionEstimate& estimate) {
  view::Clip clip;
  clip.name = "estimated";
  clip.rows = static_cast<long>(estimate.time.size());
  clip.has_contacts = true;
  for (const std::size_t k : played_rows(estimate.time)) {
    const auto column = static_cast<Eigen::Index>(k);
    if (!estimate.q.col(column).allFinite()) break;
    for (const ContactEstimate& pair : estimate.contacts[k])
      clip.contacts.push_back({.frame = clip.num_frames(),
                               .geometry_a = pair.geometry_a,
                               .geometry_b = pair.geometry_b,
                               .position = pair.centre,
                               .force = pair.force});
    clip.states.push_back({estimate.time[k], estimate.q.col(column), VectorX()});
  }
  return clip;
}

view::Clip recorded_clip(const MotionEstimate& estimate) {
  view::Clip clip;
  clip.name = "recorded";
  clip.rows = static_cast<int>(estimate.time.size());
  for (const std::size_t k : played_rows(estimate.time))
    clip.states.push_back(
        {estimate.time[k], estimate.recorded.col(static_cast<Eigen::Index>(k)), VectorX()});
  return clip;
}

/// Table of the agreement with recorded forces.
PageTable agreement_table(const ExplainedMetrics& metrics) {
  PageTable table{{"recorded force", "rms of the difference", "unit", "of the weight [%]",
                   "rows within the 95 % interval [%]"},
                  {}};
  for (const auto* list : {&metrics.contact_forces, &metrics.applied_forces})
    for (const ForceAgreement& one : *list)
      table.rows.push_back(
          {one.name, fmt::format("{:.4g}", one.rms), one.unit,
           one.unit == "N" ? fmt::format("{:.3g}", 100.0 * one.rms / metrics.weight) : "-",
           fmt::format("{:.0f}", 100.0 * one.inside_95)});
  return table;
}

PageTable summary_table(const ExplainedMotions& motions) {
  PageTable table{{"recording", "rows", "errors", "Newton steps", "seconds", "cost ratio",
                   "not explained [weights]", "at most", "outliers"},
                  {}};
  for (const MotionEstimate& one : motions.estimates)
    table.rows.push_back(
        {std::filesystem::path(one.file).filename().string(), std::to_string(one.time.size()),
         recording_errors_name(one.errors), std::to_string(one.newton_steps),
         fmt::format("{:.3g}", one.seconds), fmt::format("{:.3g}", one.mean_cost_ratio),
         fmt::format("{:.3g}", one.unexplained_mean), fmt::format("{:.3g}", one.unexplained_max),
         std::to_string(one.outliers.size())});
  return table;
}

/// Adds the part of the page about one recording.
void add_recording(const ExplainedMotions& motions, std::size_t index,
                   const ExplainedMetrics& metrics, HtmlPage& page) {
  const MotionEstimate& estimate = motions.estimates[index];
  page.paragraph(weight_in_words(estimate, metrics) + ".");
  const std::string complaint = motion_complaint(estimate, metrics);
  if (!complaint.empty()) page.paragraph("Not to be trusted: " + complaint + ".");
  const PageTable agreement = agreement_table(metrics);
  if (!agreement.rows.empty()) page.table(agreement);
  page.paragraph("Bands: two standard deviations to either side.");
  for (const Chart& chart : explained_charts(motions, index, metrics))
    page.picture_with_file(svg(chart));
}

}  // namespace

std::vector<Chart> explained_charts(const ExplainedMotions& motions, std::size_t index,
                                    const ExplainedMetrics& metrics) {
  const MotionEstimate& estimate = motions.estimates[index];
  const std::vector<std::string> names = sum_names(motions.map, estimate.sums);
  std::vector<Chart> charts;
  for (const std::size_t sum : shown_sums(motions.map, estimate))
    add_sum_charts(motions, index, sum, names[sum], charts);
  if (metrics.has_unactuated) {
    Chart& chart = charts.emplace_back();
    chart.title = "Force that nothing explains";
    chart.y_label = "of the weight [%]";
    chart.curves.push_back(row_curve(estimate.time, metrics.unexplained, 100.0));
  }
  Chart& cost = charts.emplace_back();
  cost.title = "Distance from the recording";
  cost.y_label = "mean square [variances]";
  cost.curves.push_back(row_curve(estimate.time, estimate.cost_ratio, 1.0));
  add_joint_charts(motions, index, charts);
  return charts;
}

void write_motion_page(const std::filesystem::path& folder, const MotionOrigin& origin,
                       const ExplainedMotions& motions,
                       const std::vector<ExplainedMetrics>& metrics) {
  make_report_folder(folder);
  HtmlPage page("Forces behind recordings: " + origin.scene_file);
  page.table(summary_table(motions));
  for (std::size_t i = 0; i < motions.estimates.size(); ++i) {
    const std::string& file = motions.recordings[i].file;
    page.heading(std::filesystem::path(file).filename().string());
    if (view::can_make_pages()) {
      const std::string replay = fmt::format("replay{}.html", i);
      view::write_replay(
          folder / replay, motions.scene, {origin.scene_file, {origin.map, file}, origin.packages},
          estimated_clip(motions.estimates[i]), {recorded_clip(motions.estimates[i])});
      page.links(
          {{"the motion with its contact forces, to play; the recording is its ghost", replay}});
    }
    add_recording(motions, i, metrics[i], page);
  }
  write_page(folder, page);
}

}  // namespace counterpoint::apps
