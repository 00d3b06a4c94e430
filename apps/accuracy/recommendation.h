// Evaluation of measurements: orders, the Pareto front, the cheapest setting for a wanted error.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "measure.h"

namespace counterpoint::apps::accuracy {

/// Slope of log error over log time step, by least squares.
struct Order {
  double slope = 0.0;
  double from = 0.0, to = 0.0;  ///< time steps of the range [s], from the longest
  int points = 0;
};

/// Over the finest points, at most four, whose errors stand above ten times the reference's (nearer
/// to it they are the reference's). Nothing with fewer than three.
std::optional<Order> fit_order(const std::vector<double>& time_steps,
                               const std::vector<double>& errors, double reference_error);
std::optional<Order> fit_order(const MeasuredFamily& measured, double reference_error);

/// The orders of single pieces, sorted: where bodies strike each other at several points at once
/// they converge more slowly than where nothing happens, and their mean follows the slowest. Each
/// above ten times the reference's error in that piece.
std::vector<double> piece_orders(const MeasuredFamily& measured, const Reference& reference);

/// Points that no other one beats in both error and cost, by rising cost. Families that repeat an
/// earlier one are not looked at.
std::vector<Place> pareto_front(const std::vector<MeasuredFamily>& measured);

struct Recommendation {
  bool met = false;            ///< some setting is as good as wanted
  std::optional<Place> place;  ///< the cheapest that is; if none is, the most accurate one
  std::string words;
};

/// The cheapest setting whose error is at most `want`, however the reference may be off: measured
/// error and the reference's own add up to no more. Where `want` is below ten times the latter,
/// that is said.
Recommendation recommend(const std::vector<MeasuredFamily>& measured, double want,
                         double reference_error);

/// What else comes with a setting: " With it a block held on a slope creeps at ..."; empty where no
/// block was looked at.
std::string block_words(const Point& point);

/// The cheapest settings of this engine and of the others for an error; none where none is as good.
struct Comparison {
  double error = 0.0;
  std::optional<Place> ours, theirs;
};

/// Decade by decade, each with the error of what it is measured against added. Empty where no other
/// engine was measured.
std::vector<Comparison> compare_engines(const std::vector<MeasuredFamily>& measured,
                                        double reference_error);

/// Errors below this many times the reference's own are not told from zero.
inline constexpr double kAboveReference = 10.0;

}  // namespace counterpoint::apps::accuracy
