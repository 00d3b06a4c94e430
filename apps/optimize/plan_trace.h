// The plans of a run of `control`, shown in its replay beside the motion.
#pragma once

#include <array>
#include <vector>

#include "counterpoint/engine/optimize/control.h"
#include "view/clip.h"
#include "view/curves.h"

namespace counterpoint::apps {

class PlanTrace {
 public:
  /// interval: between replans [s].
  explicit PlanTrace(double interval) : interval_(interval) {}

  /// Adds the plan that a replan made in `seconds` of processor time, a hook of run_control.
  void add(const optimization::Planner& planner, const optimization::ReplanReport& report,
           double seconds);

  /// Returns where each plan wants the robot to be at its end, and halfway to it.
  std::vector<view::Clip> ghosts() const;
  /// Returns curves over the frames of a clip: commanded speeds (targets of velocity terms) beside
  /// the actual ones, cost of the plan, and time of a replan beside the interval.
  std::vector<view::Curve> curves(const Model& model, const view::Clip& clip) const;

 private:
  struct Speed {
    std::size_t term;  ///< index into the problem's terms
    Eigen::Index v;    ///< coordinate
    bool operator==(const Speed&) const = default;
  };
  struct Plan {
    double time, cost, seconds;
    std::vector<double> speeds;  ///< commanded [m/s, rad/s]
  };
  static constexpr std::array kShares = {1.0, 0.5};  ///< share of the horizon, by ghost

  /// Returns a value of the newest plan at each frame.
  template <class Value>
  std::vector<double> over(const view::Clip& clip, Value value) const;

  double interval_, horizon_ = 0.0;
  std::vector<Speed> speeds_;
  std::vector<Plan> plans_;
  std::array<std::vector<State>, kShares.size()> ahead_;
  State sample_;
  VectorX force_;
};

}  // namespace counterpoint::apps
