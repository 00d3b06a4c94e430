// Passes over the recordings of a fit of joint forces, each followed by a search.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/estimate/torques/torque_search.h"

namespace counterpoint::estimation {

/// Returns the dry and the breakaway friction of each of these coordinates as parameters of steps.
std::vector<StepParameter> friction_of(const std::vector<int>& coordinates);
/// Returns the part of `modelled` that is dry friction [N, N m]. first: the column of the channel's
/// derivatives by its dry friction, before that by breakaway friction (friction_of).
VectorX modelled_friction(const Model& model, const ChannelRows& channel, Eigen::Index first);

/// Delays, gravity and Stribeck speeds act linearly only near the values of a pass, and joints at
/// rest need friction beyond what holds them or do not: passes follow each other until nothing
/// changes. Other parameters need one.
class TorquePasses {
 public:
  /// The arguments must outlive this.
  TorquePasses(const Scene& scene, const TorqueTask& task, const Coordinates& coordinates,
               const LinearQuantities& quantities);

  /// Replaces the Stribeck speeds of the start by those of a few between their bounds at which the
  /// forces of their joints agree best.
  void scan_speeds();
  /// start_cost: of the first pass.
  void run(double& start_cost);

  const TorqueSearch& search() const { return *search_; }
  int count() const { return count_; }  ///< passes so far

 private:
  std::vector<ChannelRows> rows_at(const VectorX& x);
  void begin(const VectorX& x, const std::vector<ChannelRows>& rows, double most);

  const Scene& scene_;
  const TorqueTask& task_;
  const Coordinates& coordinates_;
  const LinearQuantities& quantities_;
  const std::vector<int> forces_;
  std::vector<Eigen::Index> speeds_;  ///< parameters that are Stribeck speeds
  bool releases_ = false;             ///< friction at rest is known, and joints may rest
  VectorX x_;
  std::optional<Coordinates> bounds_;
  std::optional<TorqueSearch> search_;
  int count_ = 0;
};

}  // namespace counterpoint::estimation
