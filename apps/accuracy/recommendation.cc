#include "recommendation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace counterpoint::apps::accuracy {
namespace {

constexpr int kMostPoints = 4, kLeastPoints = 3;

std::vector<Place> places(const std::vector<MeasuredFamily>& measured, bool other_engine = false) {
  std::vector<Place> out;
  for (size_t f = 0; f < measured.size(); ++f) {
    if (!measured[f].same_as.empty() || measured[f].family.other_engine != other_engine) continue;
    for (size_t p = 0; p < measured[f].points.size(); ++p)
      if (measured[f].points[p].measured()) out.push_back({f, p});
  }
  return out;
}

/// Cheapest setting whose error, plus that of its reference, is at most `want`.
std::optional<Place> cheapest(const std::vector<MeasuredFamily>& measured, double want,
                              double reference_error, bool other_engine) {
  std::optional<Place> best;
  for (const Place& place : places(measured, other_engine)) {
    const Point& point = point_at(measured, place);
    const double own = measured[place.family].own_error.value_or(reference_error);
    if (!(point.error.all + own <= want)) continue;
    if (!best || point.cost < point_at(measured, *best).cost) best = place;
  }
  return best;
}

std::string cost_text(double cost) {
  return fmt::format("{} of processor time a simulated second ({:.3g} times faster than real time)",
                     seconds_text(cost), 1.0 / cost);
}

}  // namespace

std::optional<Order> fit_order(const std::vector<double>& time_steps,
                               const std::vector<double>& errors, double reference_error) {
  std::vector<std::pair<double, double>> usable;  // (log h, log error), finest first
  for (size_t i = 0; i < time_steps.size(); ++i)
    if (std::isfinite(errors[i]) && errors[i] > kAboveReference * reference_error)
      usable.emplace_back(std::log(time_steps[i]), std::log(errors[i]));
  std::sort(usable.begin(), usable.end());
  if (usable.size() > kMostPoints) usable.resize(kMostPoints);
  if (usable.size() < kLeastPoints) return {};
  const auto n = static_cast<double>(usable.size());
  double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const auto& [h, e] : usable) {
    x += h / n;
    y += e / n;
  }
  for (const auto& [h, e] : usable) {
    xx += (h - x) * (h - x);
    xy += (h - x) * (e - y);
  }
  return Order{xy / xx, std::exp(usable.back().first), std::exp(usable.front().first),
               static_cast<int>(usable.size())};
}

std::optional<Order> fit_order(const MeasuredFamily& measured, double reference_error) {
  if (!measured.family.over_time_step()) return {};
  std::vector<double> steps, errors;
  for (const Point& point : measured.points) {
    steps.push_back(point.setting.parameter);
    errors.push_back(point.error.all);
  }
  return fit_order(steps, errors, reference_error);
}

std::vector<double> piece_orders(const MeasuredFamily& measured, const Reference& reference) {
  std::vector<double> orders;
  if (!measured.family.over_time_step() || measured.points.empty()) return orders;
  for (size_t k = 0; k < reference.pieces.size(); ++k) {
    std::vector<double> steps, errors;
    for (const Point& point : measured.points) {
      if (!point.measured()) continue;
      steps.push_back(point.setting.parameter);
      errors.push_back(point.piece_errors[k]);
    }
    if (const auto order = fit_order(steps, errors, reference.piece_errors[k]))
      orders.push_back(order->slope);
  }
  std::sort(orders.begin(), orders.end());
  return orders;
}

std::vector<Place> pareto_front(const std::vector<MeasuredFamily>& measured) {
  std::vector<Place> all = places(measured);
  std::stable_sort(all.begin(), all.end(), [&](const Place& a, const Place& b) {
    return point_at(measured, a).cost < point_at(measured, b).cost;
  });
  std::vector<Place> front;
  double best = std::numeric_limits<double>::infinity();
  for (const Place& place : all) {
    const double error = point_at(measured, place).error.all;
    if (!(error < best)) continue;
    best = error;
    front.push_back(place);
  }
  return front;
}

std::string block_words(const Point& point) {
  if (!point.physics || !point.physics->block) return {};
  const BlockMetrics& block = *point.physics->block;
  return fmt::format(
      " With it a block held on a slope creeps at {:.2g} um/s, and one that slides at 2 m/s rises "
      "by "
      "{:.2g} mm at most.",
      1e6 * block.creep, 1e3 * std::max(block.hover, 0.0));
}

Recommendation recommend(const std::vector<MeasuredFamily>& measured, double want,
                         double reference_error) {
  const std::vector<Place> all = places(measured);
  const auto nearest =
      std::min_element(all.begin(), all.end(), [&](const Place& a, const Place& b) {
        return point_at(measured, a).error.all < point_at(measured, b).error.all;
      });
  Recommendation out;
  out.place = cheapest(measured, want, reference_error, false);
  out.met = out.place.has_value();
  if (!out.met && nearest != all.end()) out.place = *nearest;
  if (out.place) {
    const Point& point = point_at(measured, *out.place);
    out.words =
        out.met ? fmt::format("for an error of {:g}: {}. Its error is {:.2g}; it takes {}.", want,
                              point.setting.label, point.error.all, cost_text(point.cost))
                : fmt::format(
                      "no setting measured has an error of {:g} or less. The most accurate is {}: "
                      "error {:.2g}, {}.",
                      want, point.setting.label, point.error.all, cost_text(point.cost));
  } else {
    out.words = "no setting came to its end: there is nothing to recommend.";
  }
  if (want < kAboveReference * reference_error) {
    out.words += fmt::format(
        " The reference itself may be off by {:.2g}: an error of {:g} cannot be told from it; "
        "--finer makes it better.",
        reference_error, want);
  }
  return out;
}

std::vector<Comparison> compare_engines(const std::vector<MeasuredFamily>& measured,
                                        double reference_error) {
  std::vector<Comparison> out;
  if (places(measured, true).empty()) return out;
  for (int power = 0; power >= -14; --power) {
    const double error = std::pow(10.0, power);
    const Comparison row{error, cheapest(measured, error, reference_error, false),
                         cheapest(measured, error, reference_error, true)};
    if (row.ours || row.theirs) out.push_back(row);
  }
  return out;
}

}  // namespace counterpoint::apps::accuracy
