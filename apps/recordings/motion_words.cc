// Figures of an estimated motion as a report and in words.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "recordings/motion_metrics.h"

namespace counterpoint::apps {
namespace {

/// Limits for trust: with white errors MotionEstimate::mean_cost_ratio stays below kMostCost, and a
/// correct scene leaves less than kMostUnexplained unexplained [weights].
constexpr double kMostCost = 4.0, kMostUnexplained = 0.1;
/// Limits on the numbers of outliers, carriers, parameters, sensors and coloured residuals that are
/// listed.
constexpr std::size_t kOutliersTold = 5, kCarriersTold = 4, kParametersTold = 4, kSensorsTold = 4,
                      kColouredTold = 4;
/// Residuals count as coloured above this autocorrelation, or above kMostByChance over the square
/// root of the number of rows, if that is larger.
constexpr double kMostCorrelation = 0.3, kMostByChance = 4.0;
/// Carriers below this share are not listed [weights].
constexpr double kLeastShare = 5e-3;

std::string percent(double share) { return fmt::format("{:.2g} %", 100.0 * share); }

/// Formats a share as a percentage, from 9.5 % on as a whole number.
std::string rounded_percent(double share) {
  return std::abs(share) < 0.095 ? percent(share) : fmt::format("{:.0f} %", 100.0 * share);
}

/// At most `count` items, the one with the largest `size` first.
template <class Item, class Size>
std::vector<Item> largest(std::vector<Item> items, std::size_t count, const Size& size) {
  std::stable_sort(items.begin(), items.end(),
                   [&](const Item& a, const Item& b) { return size(a) > size(b); });
  items.resize(std::min(items.size(), count));
  return items;
}

std::vector<Outlier> worst_outliers(const MotionEstimate& estimate) {
  return largest(estimate.outliers, kOutliersTold, [](const Outlier& o) { return o.deviations; });
}

Json agreement_list(const std::vector<ForceAgreement>& agreements, double weight) {
  Json list = Json::array();
  for (const ForceAgreement& one : agreements) {
    Json& entry = list.emplace_back();
    entry["name"] = one.name;
    entry["unit"] = one.unit;
    entry["rows"] = one.rows;
    entry["rms"] = one.rms;
    if (one.unit == "N") entry["rms_weights"] = one.rms / weight;
    entry["inside_95"] = one.inside_95;
  }
  return list;
}

Json worst_row(const WorstRow& worst) {
  return {{"value", worst.value}, {"time_s", worst.time}, {"coordinate", worst.coordinate}};
}

std::string agreement_lines(const std::vector<ForceAgreement>& agreements, double weight) {
  std::string out;
  for (const ForceAgreement& one : agreements) {
    out += fmt::format("  {}: {:.4g} {} rms from the recorded force", one.name, one.rms, one.unit);
    if (one.unit == "N") out += ", " + percent(one.rms / weight) + " of the weight";
    out += "; 95 % interval holds in " + rounded_percent(one.inside_95) + " of the rows\n";
  }
  return out;
}

std::string parameter_lines(const MotionEstimate& estimate) {
  const std::vector<EstimatedParameter> told =
      largest(estimate.parameters, kParametersTold,
              [](const EstimatedParameter& one) { return std::abs(one.value); });
  std::string out;
  for (const EstimatedParameter& one : told)
    out += fmt::format("  {}: {:.2g} +- {:.2g} {} from the scene's\n", one.name, one.value,
                       one.deviation, one.unit);
  if (const std::size_t more = estimate.parameters.size() - told.size(); more > 0)
    out += fmt::format("  {} more parameters differ by less (--json)\n", more);
  return out;
}

/// Lists the sensors with the largest rms residuals in units of their standard deviations.
std::string sensor_lines(const MotionEstimate& estimate) {
  const auto ratio = [](const SensorMetrics& s) { return s.rms / s.deviation; };
  const std::vector<SensorMetrics> worst = largest(estimate.sensors, kSensorsTold, ratio);
  std::string out;
  for (const SensorMetrics& one : worst)
    out += fmt::format("  {} ({}): {:.2g} {} rms from the motion, {:.2g} of its deviations\n",
                       one.name, sensor_kind_name(one.kind), one.rms, sensor_unit(one.kind),
                       ratio(one));
  if (const std::size_t more = estimate.sensors.size() - worst.size(); more > 0)
    out += fmt::format("  {} more sensors are nearer (--json)\n", more);
  return out;
}

Json sensor_list(const MotionEstimate& estimate) {
  Json list = Json::array();
  for (const SensorMetrics& one : estimate.sensors)
    list.push_back({{"name", one.name},
                    {"kind", sensor_kind_name(one.kind)},
                    {"unit", sensor_unit(one.kind)},
                    {"rows", one.rows},
                    {"deviation", one.deviation},
                    {"rms", one.rms},
                    {"outliers", one.outliers}});
  return list;
}

std::string outlier_lines(const Model& model, const MotionEstimate& estimate) {
  if (estimate.outliers.empty()) return {};
  const std::vector<std::string> names = position_names(model);
  std::string out = fmt::format("  {} place{} of the recording not believed, the worst:",
                                estimate.outliers.size(), estimate.outliers.size() == 1 ? "" : "s");
  for (const Outlier& one : worst_outliers(estimate))
    out += fmt::format(
        " {}{} at {:.4g} s by {:.3g} ({:.0f} deviations);",
        one.acceleration ? "acceleration of " : "", names[static_cast<std::size_t>(one.coordinate)],
        estimate.time[static_cast<std::size_t>(one.row)], one.difference, one.deviations);
  out.back() = '\n';
  return out;
}

/// Coordinates whose residuals are not white, worst first.
std::vector<Eigen::Index> coloured(const MotionEstimate& estimate) {
  const VectorX& correlation = estimate.residual_correlation;
  const double rows = std::max(1.0, static_cast<double>(estimate.time.size()));
  const double most = std::max(kMostCorrelation, kMostByChance / std::sqrt(rows));
  std::vector<Eigen::Index> out;
  for (Eigen::Index i = 0; i < correlation.size(); ++i)
    if (correlation[i] > most) out.push_back(i);
  std::stable_sort(out.begin(), out.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return correlation[a] > correlation[b]; });
  return out;
}

/// Line about the whiteness of the residuals; empty if no autocorrelation is known.
std::string whiteness_line(const Model& model, const MotionEstimate& estimate) {
  const VectorX& correlation = estimate.residual_correlation;
  if (!(correlation.array() == correlation.array()).any()) return {};  // all are NaN
  const std::vector<Eigen::Index> worst = coloured(estimate);
  if (worst.empty()) return "  residuals are white: the scene lacks nothing that positions show\n";
  const std::vector<std::string> names = position_names(model);
  std::string out = "  residuals are not white (autocorrelation from row to row):";
  for (std::size_t k = 0; k < std::min(worst.size(), kColouredTold); ++k)
    out += fmt::format("{} {} {:.2f}", k > 0 ? "," : "", names[static_cast<std::size_t>(worst[k])],
                       correlation[worst[k]]);
  if (worst.size() > kColouredTold)
    out += fmt::format(", {} more (--json)", worst.size() - kColouredTold);
  return out +
         "; the scene may lack a contact, friction, a right mass or length there, or errors "
         "change slowly (--errors slow)\n";
}

}  // namespace

Json motion_entry(const Model& model, const MotionEstimate& estimate,
                  const ExplainedMetrics& metrics) {
  const std::string complaint = motion_complaint(estimate, metrics);
  const std::vector<std::string> names = position_names(model);
  Json entry;
  entry["file"] = estimate.file;
  entry["status"] = estimate.stopped ? "stopped" : complaint.empty() ? "ok" : "doubtful";
  entry["complaint"] = complaint;
  entry["errors"] = recording_errors_name(estimate.errors);
  entry["rows"] = estimate.time.size();
  entry["newton_steps"] = estimate.newton_steps;
  entry["seconds"] = estimate.seconds;
  entry["smoothing_m"] = estimate.smoothing;
  entry["cost_ratio"] = estimate.mean_cost_ratio;
  entry["cost_ratio_worst"] = worst_row(metrics.worst_cost);
  entry["unexplained_mean"] = estimate.unexplained_mean;
  entry["unexplained_max"] = estimate.unexplained_max;
  entry["unexplained_worst"] = worst_row(metrics.worst_unexplained);
  entry["weight_N"] = metrics.weight;
  entry["support"] = metrics.support;
  entry["carried"] = metrics.carried;
  Json& carriers = entry["carriers"] = Json::array();
  for (const Carrier& one : metrics.carriers)
    carriers.push_back({{"name", one.name}, {"share", one.share}});
  entry["contact_forces"] = agreement_list(metrics.contact_forces, metrics.weight);
  entry["applied_forces"] = agreement_list(metrics.applied_forces, metrics.weight);
  Json& parameters = entry["parameters"] = Json::array();
  for (const EstimatedParameter& one : estimate.parameters)
    parameters.push_back({{"name", one.name},
                          {"unit", one.unit},
                          {"difference", one.value},
                          {"deviation", one.deviation}});
  Json& deviations = entry["position_deviations"] = Json::array();
  for (Eigen::Index i = 0; i < estimate.position_deviation.size(); ++i)
    if (const double d = estimate.position_deviation[i]; std::isfinite(d))
      deviations.push_back({{"name", names[static_cast<std::size_t>(i)]}, {"deviation", d}});
  entry["sensors"] = sensor_list(estimate);
  entry["residuals_white"] = coloured(estimate).empty();
  Json& residuals = entry["residual_correlations"] = Json::array();
  for (Eigen::Index i = 0; i < estimate.residual_correlation.size(); ++i)
    if (const double r = estimate.residual_correlation[i]; std::isfinite(r))
      residuals.push_back({{"name", names[static_cast<std::size_t>(i)]}, {"correlation", r}});
  if (residuals.empty()) entry["residuals_white"] = nullptr;
  entry["outliers"] = estimate.outliers.size();
  Json& worst = entry["outliers_worst"] = Json::array();
  for (const Outlier& one : worst_outliers(estimate))
    worst.push_back({{"name", names[static_cast<std::size_t>(one.coordinate)]},
                     {"of", one.acceleration ? "acceleration" : "position"},
                     {"time_s", estimate.time[static_cast<std::size_t>(one.row)]},
                     {"difference", one.difference},
                     {"deviations", one.deviations}});
  return entry;
}

std::string motion_text(const Model& model, const MotionEstimate& estimate,
                        const ExplainedMetrics& metrics) {
  std::string out = fmt::format(
      "{}: {} rows, errors {}, {} Newton steps, {:.3g} s\n", estimate.file, estimate.time.size(),
      recording_errors_name(estimate.errors), estimate.newton_steps, estimate.seconds);
  out += agreement_lines(metrics.contact_forces, metrics.weight);
  out += agreement_lines(metrics.applied_forces, metrics.weight);
  out += parameter_lines(estimate);
  out += sensor_lines(estimate);
  out += outlier_lines(model, estimate);
  out += whiteness_line(model, estimate);
  return out + weight_in_words(estimate, metrics) + "\n";
}

std::string weight_in_words(const MotionEstimate& estimate, const ExplainedMetrics& metrics) {
  std::string out = fmt::format("the {} carries ", metrics.support);
  if (metrics.carriers.empty()) {
    out += "nothing";
  } else {
    out += rounded_percent(metrics.carried) + " of the weight";
    std::string separator = ": ";
    double rest = 0.0;
    for (std::size_t k = 0; k < metrics.carriers.size(); ++k) {
      const Carrier& one = metrics.carriers[k];
      if (k >= kCarriersTold || std::abs(one.share) < kLeastShare) {
        rest += one.share;
        continue;
      }
      out += separator + one.name + " " + rounded_percent(one.share);
      separator = ", ";
    }
    if (std::abs(rest) >= kLeastShare) out += separator + "others " + rounded_percent(rest);
  }
  if (!metrics.has_unactuated)
    return out + "; every coordinate has a motor, which explains the rest";
  return out + fmt::format("; {} of the weight is not explained (at most {} at {:.4g} s)",
                           rounded_percent(estimate.unexplained_mean),
                           rounded_percent(estimate.unexplained_max),
                           metrics.worst_unexplained.time);
}

std::string motion_complaint(const MotionEstimate& estimate, const ExplainedMetrics& metrics) {
  if (estimate.stopped) return {};  // the search was stopped, so this is not its final motion
  if (estimate.errors == RecordingErrors::kWhite && estimate.mean_cost_ratio > kMostCost)
    return fmt::format(
        "the motion found is farther from the recording than its errors allow ({:.3g} times their "
        "square in the mean), most at {:.4g} s in {}: the scene, a standard deviation of the "
        "column map, or --errors white is wrong",
        estimate.mean_cost_ratio, metrics.worst_cost.time, metrics.worst_cost.coordinate);
  if (estimate.unexplained_mean > kMostUnexplained)
    return fmt::format(
        "{} of the weight is not explained in the mean, most at {:.4g} s in {}: something pushes "
        "there that the scene does not have, or its masses are wrong",
        rounded_percent(estimate.unexplained_mean), metrics.worst_unexplained.time,
        metrics.worst_unexplained.coordinate);
  return {};
}

}  // namespace counterpoint::apps
