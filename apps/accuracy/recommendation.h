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
  double from = 0.0, to = 0.0;  ///< time steps of the range [s], longest first
  int points = 0;
};

/// Fits the finest points, at most four, with errors above ten times the reference's (below that
/// they are dominated by it). Empty with fewer than three points.
std::optional<Order> fit_order(const std::vector<double>& time_steps,
                               const std::vector<double>& errors, double reference_error);
std::optional<Order> fit_order(const MeasuredFamily& measured, double reference_error);

/// Orders of the single pieces, sorted, from errors above ten times the reference's error in that
/// piece. Pieces in which bodies collide at several points at once converge more slowly than pieces
/// without events, and the mean error follows the slowest.
std::vector<double> piece_orders(const MeasuredFamily& measured, const Reference& reference);

/// Points that no other point beats in both error and cost, by increasing cost. Families that
/// repeat an earlier one are skipped.
std::vector<Place> pareto_front(const std::vector<MeasuredFamily>& measured);

struct Recommendation {
  bool met = false;            ///< some setting reaches the wanted error
  std::optional<Place> place;  ///< cheapest such setting; if there is none, the most accurate one
  std::string words;
};

/// Cheapest setting whose measured error plus the reference's own error is at most `want`. The text
/// says so if `want` is below ten times the reference's error.
Recommendation recommend(const std::vector<MeasuredFamily>& measured, double want,
                         double reference_error);

/// Behaviour of the block with a setting: " With it a block held on a slope creeps at ..."; empty
/// if no block was measured.
std::string block_words(const Point& point);

/// Cheapest settings of this engine and of the others for an error; empty where none reaches it.
struct Comparison {
  double error = 0.0;
  std::optional<Place> ours, theirs;
};

/// Compares decade by decade, adding the error of each setting's reference. Empty if no other
/// engine was measured.
std::vector<Comparison> compare_engines(const std::vector<MeasuredFamily>& measured,
                                        double reference_error);

/// Errors below this multiple of the reference's own error cannot be distinguished from zero.
inline constexpr double kAboveReference = 10.0;

}  // namespace counterpoint::apps::accuracy
