#include "counterpoint/engine/estimate/torques/torque_passes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace counterpoint::estimation {
namespace {

using K = ParameterKind;
using S = StepParameterKind;

/// Largest number of passes, and that where Stribeck speeds are sought.
constexpr int kPasses = 8, kSpeedPasses = 30;
/// Stribeck speeds that are tried first, evenly spaced by their logarithms.
constexpr int kTriedSpeeds = 7;
/// Largest change of the logarithm of a Stribeck speed in a pass, and the least to which failures
/// reduce it.
constexpr double kMostChange = 0.7, kLeastChange = 1e-3;
/// A deviation that is smaller by this share is a better agreement.
constexpr double kBetter = 1e-6;

bool has_kind(const std::vector<Parameter>& parameters, K kind) {
  return std::any_of(parameters.begin(), parameters.end(),
                     [&](const Parameter& p) { return p.kind == kind; });
}

bool is_target(const std::vector<int>& targets, int coordinate) {
  return std::find(targets.begin(), targets.end(), coordinate) != targets.end();
}

/// Sets the rows at rest in which more than friction at rest is needed to those of a joint that
/// friction at rest has just not held; they do not count as rest. steps: the parameters whose
/// derivatives come first, before those of friction_of, which begin at `first`.
void release(const Model& model, const std::vector<StepParameter>& steps, Eigen::Index first,
             const ChannelValues& values, ChannelRows& channel) {
  const int k = channel.coordinate;
  if (!model.breaks_away(k)) return;
  const VectorX rubbed = modelled_friction(model, channel, first);
  const double most = model.friction_at_rest(k);
  for (Eigen::Index i = 0; i < channel.recorded.size(); ++i) {
    char& rests = channel.rests[static_cast<std::size_t>(i)];
    if (!rests) continue;
    const double without = channel.modelled[i] - rubbed[i];
    const double needed = (channel.recorded[i] - values.offset) / values.gain - without;
    if (std::abs(needed) <= most) continue;
    rests = 0;
    const double side = std::copysign(1.0, needed);
    channel.modelled[i] = without + side * most;
    for (std::size_t j = 0; j < steps.size(); ++j) {
      const S kind = steps[j].kind;
      if (kind != S::kDryFriction && kind != S::kBreakawayFriction && kind != S::kStribeckSpeed)
        continue;
      if (is_target(steps[j].targets, k))
        channel.derivatives(i, static_cast<Eigen::Index>(j)) =
            kind == S::kBreakawayFriction ? side : 0.0;
    }
  }
}

}  // namespace

std::vector<StepParameter> friction_of(const std::vector<int>& coordinates) {
  std::vector<StepParameter> out;
  for (const int k : coordinates)
    for (const S kind : {S::kDryFriction, S::kBreakawayFriction})
      out.push_back({kind, {k}, {}, {}});
  return out;
}

VectorX modelled_friction(const Model& model, const ChannelRows& channel, Eigen::Index first) {
  const int k = channel.coordinate;
  VectorX out = model.dry_friction()[k] * channel.derivatives.col(first);
  if (model.breaks_away(k))
    out += model.breakaway_friction()[k] * channel.derivatives.col(first + 1);
  return out;
}

TorquePasses::TorquePasses(const Scene& scene, const TorqueTask& task,
                           const Coordinates& coordinates, const LinearQuantities& quantities)
    : scene_(scene),
      task_(task),
      coordinates_(coordinates),
      quantities_(quantities),
      forces_(recorded_forces(task.map)),
      x_(coordinates.prior) {
  for (std::size_t i = 0; i < coordinates.parameters.size(); ++i)
    if (coordinates.parameters[i].kind == K::kStribeckSpeed)
      speeds_.push_back(static_cast<Eigen::Index>(i));
  for (int k = 0; k < scene.model.nv(); ++k) releases_ = releases_ || scene.model.breaks_away(k);
  releases_ = task.options.rest_speed > 0.0 &&
              (releases_ || has_kind(coordinates.parameters, K::kBreakawayFriction));
}

std::vector<ChannelRows> TorquePasses::rows_at(const VectorX& x) {
  const std::vector<Parameter>& parameters = coordinates_.parameters;
  const VectorX values = coordinates_.values(x);
  const Scene now = with_parameters(scene_, parameters, values);
  const std::vector<StepParameter> steps = quantities_.step_parameters(now.model);
  std::vector<StepParameter> all = steps;
  if (releases_)
    for (const StepParameter& p : friction_of(forces_)) all.push_back(p);
  const std::vector<ChannelValues> channels = channel_values(forces_, parameters, values);
  std::vector<ChannelRows> rows = torque_rows(now, task_, all, channels);
  ++count_;
  const auto own = static_cast<Eigen::Index>(steps.size());
  for (std::size_t c = 0; c < rows.size() && releases_; ++c) {
    release(now.model, steps, own + 2 * static_cast<Eigen::Index>(c), channels[c], rows[c]);
    rows[c].derivatives.conservativeResize(Eigen::NoChange, own);
  }
  const auto count = rows[0].recorded.size();
  if (count > static_cast<Eigen::Index>(parameters.size()) / 2) return rows;
  throw InputError(fmt::format(
      "{}: {} rows are left to compare, for {} parameters; expected a longer recording, or a "
      "higher cutoff than {:g} Hz",
      task_.recordings.front()->file, count, parameters.size(), task_.options.cutoff));
}

/// Begins a search from x, which may change Stribeck speeds by factors up to exp(most).
void TorquePasses::begin(const VectorX& x, const std::vector<ChannelRows>& rows, double most) {
  const VectorX values = coordinates_.values(x);
  const Model model = with_parameters(scene_, coordinates_.parameters, values).model;
  search_.reset();
  bounds_.emplace(coordinates_.near(x, most));
  search_.emplace(*bounds_, quantities_, rows, x,
                  model.dry_friction().cwiseMax(model.breakaway_friction()));
}

void TorquePasses::scan_speeds() {
  if (speeds_.empty()) return;
  const VectorX start = x_;
  std::vector<double> best(speeds_.size(), HUGE_VAL);
  for (int tried = -1; tried < kTriedSpeeds; ++tried) {
    VectorX x = start;
    for (const Eigen::Index i : speeds_)
      if (tried >= 0)
        x[i] = coordinates_.lower[i] + (tried + 0.5) / kTriedSpeeds * coordinates_.range(i);
    begin(x, rows_at(x), 0.0);
    search_->run();
    for (std::size_t s = 0; s < speeds_.size(); ++s) {
      const Eigen::Index i = speeds_[s];
      const std::vector<int>& joints = coordinates_.parameters[static_cast<std::size_t>(i)].targets;
      double misfit = 0.0;
      for (const TorqueChannel& channel : search_->channels())
        if (is_target(joints, channel.coordinate)) misfit += std::log(channel.deviation);
      if (misfit >= best[s] - kBetter) continue;
      best[s] = misfit;
      x_[i] = x[i];
    }
  }
}

void TorquePasses::run(double& start_cost) {
  const std::vector<Parameter>& parameters = coordinates_.parameters;
  const bool again = releases_ || !speeds_.empty() || has_kind(parameters, K::kForceDelay) ||
                     (has_kind(parameters, K::kGravity) && parameters.size() > 1);
  const int passes = speeds_.empty() ? kPasses : kSpeedPasses;
  VectorX from = x_;
  std::vector<ChannelRows> rows = rows_at(x_);
  double most = kMostChange, misfit = HUGE_VAL;
  for (int pass = 1;; ++pass) {
    begin(from, rows, most);
    if (pass == 1) start_cost = search_->cost();
    misfit = search_->misfit();
    search_->run();
    x_ = search_->x();
    const bool settled = search_->moved(from) <= kSettled || !again;
    if (settled || pass >= passes || (task_.options.stop && task_.options.stop())) return;
    std::vector<ChannelRows> next = rows_at(x_);
    if (!speeds_.empty() && most > kLeastChange) {
      begin(x_, next, most);
      if (search_->misfit() > misfit + kBetter) {
        most *= 0.25;
        continue;  // from where this pass began
      }
      most = std::min(kMostChange, 2.0 * most);
    }
    from = x_;
    rows = std::move(next);
  }
}

}  // namespace counterpoint::estimation
