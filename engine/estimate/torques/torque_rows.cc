#include "counterpoint/engine/estimate/torques/torque_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "counterpoint/contact/thread_pool.h"
#include "counterpoint/engine/batch.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::estimation {
namespace {

/// Cutoff of the motion's filter over that of the forces'.
constexpr double kMotionCutoff = 3.0;
/// Filters are cut off at this many standard deviations.
constexpr double kReach = 4.0;
/// Narrowest filter [rows]: a Gaussian of fewer rows is none.
constexpr double kNarrowest = 0.5;
/// Rows whose distance differs by more than this share are not even.
constexpr double kEven = 0.02;
/// Distance of the rows in which contacts are looked for.
constexpr int kLooked = 10;
/// Rows that a task of a thread computes.
constexpr int kTaskRows = 500;

/// Standard deviation in time of the Gaussian with -3 dB at a frequency.
double width_of(double cutoff) {
  return std::sqrt(std::log(2.0)) / (2.0 * std::numbers::pi * cutoff);
}

/// Low-passes the columns of a matrix; at its ends by fewer neighbours.
MatrixX smoothed(const MatrixX& rows, double width) {
  if (width < kNarrowest) return rows;
  const int reach = static_cast<int>(std::ceil(kReach * width));
  const auto last = static_cast<int>(rows.cols()) - 1;
  MatrixX out(rows.rows(), rows.cols());
  for (int k = 0; k <= last; ++k) {
    const int side = std::min({reach, k, last - k});  // symmetric, so that slopes stay
    double sum = 0.0;
    VectorX mean = VectorX::Zero(rows.rows());
    for (int i = -side; i <= side; ++i) {
      const double weight = std::exp(-0.5 * i * i / (width * width));
      mean += weight * rows.col(k + i);
      sum += weight;
    }
    out.col(k) = mean / sum;
  }
  return out;
}

/// A recording's motion, smoothed, with velocities.
struct SmoothMotion {
  MatrixX q, v;
  double h = 0.0;  ///< [s]
};

SmoothMotion smooth_motion(const Model& model, const TorqueTask& task, const Recording& recording) {
  const int rows = recording.num_rows();
  SmoothMotion out;
  out.h = task.map.rate ? 1.0 / *task.map.rate
                        : (recording.time.back() - recording.time.front()) / (rows - 1);
  const double width = width_of(kMotionCutoff * task.options.cutoff) / out.h;
  out.q = smoothed(recording.q, width);
  out.v = smoothed(recording.v, width);
  std::vector<char> measured(static_cast<std::size_t>(model.nv()), 0);
  for (const ColumnMap::Entry& entry : task.map.entries)
    if (entry.kind == ColumnMap::Entry::Kind::kVelocity)
      measured[static_cast<std::size_t>(entry.index)] = 1;
  for (int k = 0; k < model.nv(); ++k) {
    if (measured[static_cast<std::size_t>(k)]) continue;
    // The velocity of a row is that over the step before it, as in the engine.
    for (int row = 1; row < rows; ++row)
      out.v(k, row) = (out.q(k, row) - out.q(k, row - 1)) / out.h;
    out.v(k, 0) = out.v(k, 1);
  }
  return out;
}

/// The Gaussian of a filter, and its derivative by the delay.
struct Tap {
  double weight = 0.0, slope = 0.0;
};

Tap tap(double distance, double width) {
  const double x = distance / width;
  Tap out;
  out.weight = std::exp(-0.5 * x * x);
  out.slope = -out.weight * x / width;
  return out;
}

/// Sums of taps for one centre and channel.
struct Sum {
  double weight = 0.0, modelled = 0.0, slope = 0.0, slope_weight = 0.0;
  double recorded = 0.0, recorded_weight = 0.0, rest = 0.0;
  Eigen::RowVectorXd derivatives;
};

/// Computes the rows of one recording.
class Pass {
 public:
  Pass(const Scene& scene, const TorqueTask& task, const std::vector<StepParameter>& parameters,
       const std::vector<ChannelValues>& channels, const Recording& recording)
      : scene_(scene),
        task_(task),
        parameters_(parameters),
        channels_(channels),
        forces_(recorded_forces(task.map)),
        recording_(recording),
        motion_(smooth_motion(scene.model, task, recording)),
        options_(free_steps(scene.options, motion_.h)),
        width_(std::max(kNarrowest, width_of(task.options.cutoff) / motion_.h)),
        spacing_(std::max(1, static_cast<int>(std::lround(0.5 / task.options.cutoff / motion_.h)))),
        margin_(static_cast<int>(
            std::ceil(kReach * width_ + std::abs(task.longest_delay) / motion_.h))) {}

  /// Number of centres: compared rows.
  int count() const {
    return std::max(0, (recording_.num_rows() - 3 - 2 * margin_) / spacing_ + 1);
  }
  double h() const { return motion_.h; }  ///< [s]
  int center(int index) const { return 1 + margin_ + index * spacing_; }

  /// Computes the sums of centres begin ... end - 1: centre by centre, channel by channel.
  std::vector<Sum> run(int begin, int end) const {
    const auto channels = forces_.size();
    const auto columns = static_cast<Eigen::Index>(parameters_.size());
    std::vector<Sum> sums(static_cast<std::size_t>(end - begin) * channels);
    for (Sum& sum : sums) sum.derivatives.setZero(columns);
    ParameterDerivator derivator(scene_.model, parameters_);
    Workspace workspace(scene_.model);
    Inverse inverse;
    InverseParameterDerivatives d;
    const int first = center(begin) - margin_, last = center(end - 1) + margin_;
    for (int row = first; row <= last; ++row) {
      if (parameters_.empty())
        step_inverse(scene_.model, options_, motion_.q.col(row), motion_.v.col(row),
                     motion_.v.col(row + 1), workspace, inverse);
      else
        derivator.inverse(scene_.model, options_, motion_.q.col(row), motion_.v.col(row),
                          motion_.v.col(row + 1), Input(), workspace, inverse, d);
      if (inverse.fault.any())
        throw InputError(fmt::format("{}: row {}: {}", recording_.file, row,
                                     describe(scene_.model, inverse.fault).reason));
      const int low = std::max(begin, (row - 1 - 2 * margin_ + spacing_ - 1) / spacing_);
      for (int c = low; c < end && center(c) - margin_ <= row; ++c)
        for (std::size_t k = 0; k < channels; ++k)
          add(row, c, k, inverse, d, sums[static_cast<std::size_t>(c - begin) * channels + k]);
    }
    return sums;
  }

 private:
  void add(int row, int c, std::size_t channel, const Inverse& inverse,
           const InverseParameterDerivatives& d, Sum& sum) const {
    const int k = forces_[channel];
    const double distance = row - center(c);
    const Tap own = tap(distance, width_);
    sum.recorded_weight += own.weight;
    sum.recorded += own.weight * recording_.applied_force(k, row);
    if (std::abs(motion_.v(k, row)) < task_.options.rest_speed) sum.rest += own.weight;
    const Tap shifted = tap(distance + channels_[channel].delay / motion_.h, width_);
    sum.weight += shifted.weight;
    sum.slope_weight += shifted.slope;
    sum.modelled += shifted.weight * inverse.applied_force[k];
    sum.slope += shifted.slope * inverse.applied_force[k];
    if (!parameters_.empty()) sum.derivatives += shifted.weight * d.du.row(k);
  }

  const Scene& scene_;
  const TorqueTask& task_;
  const std::vector<StepParameter>& parameters_;
  const std::vector<ChannelValues>& channels_;
  const std::vector<int> forces_;
  const Recording& recording_;
  const SmoothMotion motion_;
  const SimulationOptions options_;
  const double width_;  ///< [rows]
  const int spacing_, margin_;
};

/// Appends the rows of a recording to those of each channel.
void append(const std::vector<std::vector<Sum>>& parts, int recording, double h,
            std::vector<ChannelRows>& out) {
  Eigen::Index rows = out[0].recorded.size();
  Eigen::Index more = 0;
  for (const auto& part : parts) more += static_cast<Eigen::Index>(part.size() / out.size());
  for (ChannelRows& channel : out) {
    for (VectorX* x : {&channel.recorded, &channel.modelled, &channel.slope})
      x->conservativeResize(rows + more);
    channel.derivatives.conservativeResize(rows + more, Eigen::NoChange);
  }
  for (const auto& part : parts)
    for (std::size_t i = 0; i < part.size(); ++i) {
      ChannelRows& channel = out[i % out.size()];
      const Sum& sum = part[i];
      channel.recorded[rows] = sum.recorded / sum.recorded_weight;
      channel.modelled[rows] = sum.modelled / sum.weight;
      channel.slope[rows] =
          (sum.slope - channel.modelled[rows] * sum.slope_weight) / sum.weight / h;
      channel.derivatives.row(rows) = sum.derivatives / sum.weight;
      channel.rests.push_back(sum.rest > 0.5 * sum.recorded_weight);
      channel.recording.push_back(recording);
      if (i % out.size() + 1 == out.size()) ++rows;
    }
}

}  // namespace

SimulationOptions free_steps(SimulationOptions options, double h) {
  for (const Effect effect : {Effect::kContacts, Effect::kClosures, Effect::kSleeping,
                              Effect::kLimits, Effect::kServos, Effect::kActuators})
    options.effects.set(effect, false);
  options.integrator = Integrator::kSemiImplicitEuler;
  options.time_step = h;
  return options;
}

std::vector<int> recorded_forces(const ColumnMap& map) {
  std::vector<int> out;
  for (const ColumnMap::Entry& entry : map.entries)
    if (entry.kind == ColumnMap::Entry::Kind::kForce) out.push_back(entry.index);
  std::sort(out.begin(), out.end());
  return out;
}

void check_torques(const Scene& scene, const TorqueTask& task) {
  const Model& model = scene.model;
  refuse_inputs(task.map, "objective torque");
  if (model.nq() != model.nv())
    throw InputError(
        "objective torque: the scene has free, spherical or planar joints; use --objective "
        "explain");
  if (!model.closures().empty())
    throw InputError("objective torque: the scene has closures, whose forces are not recorded");
  if (recorded_forces(task.map).empty())
    throw InputError("objective torque: the column map has no forces (JOINT.u)");
  Explainer explainer(scene, task.map, scene.options.contact.margin);
  for (const Recording* recording : task.recordings) {
    const int rows = recording->num_rows();
    if (rows < 3) throw InputError(recording->file + ": 3 rows or more are expected");
    const double h = (recording->time.back() - recording->time.front()) / (rows - 1);
    for (int row = 0; row + 1 < rows && !task.map.rate; ++row)
      if (!(std::abs(recording->time[row + 1] - recording->time[row] - h) <= kEven * h + 1e-12))
        throw InputError(
            fmt::format("{}: rows are not even: {:.6g} s after {:.6g} s, {:.6g} s on "
                        "average; give the column map a 'rate', or resample",
                        recording->file, recording->time[row + 1] - recording->time[row],
                        recording->time[row], h));
    if (!scene.options.effects.has(Effect::kContacts)) continue;
    for (int row = 0; row + 1 < rows; row += kLooked)
      if (explainer.explain(*recording, row, h).contacts > 0)
        throw InputError(fmt::format(
            "{}: at {:.6g} s shapes touch, or nearly; use --objective force, or, if nothing does, "
            "--option effects.contacts=false",
            recording->file, recording->time[row]));
  }
}

std::vector<ChannelRows> torque_rows(const Scene& scene, const TorqueTask& task,
                                     const std::vector<StepParameter>& parameters,
                                     const std::vector<ChannelValues>& channels) {
  std::vector<ChannelRows> out;
  for (const int k : recorded_forces(task.map)) {
    ChannelRows& channel = out.emplace_back();
    channel.coordinate = k;
    channel.derivatives.resize(0, static_cast<Eigen::Index>(parameters.size()));
  }
  contact::ThreadPool pool(num_threads_of(task.options.threads));
  for (std::size_t r = 0; r < task.recordings.size(); ++r) {
    if (task.options.stop && task.options.stop()) break;
    const Pass pass(scene, task, parameters, channels, *task.recordings[r]);
    const int spacing = pass.center(1) - pass.center(0);
    const int each = std::max(1, kTaskRows / spacing);
    const int tasks = (pass.count() + each - 1) / each;
    std::vector<std::vector<Sum>> parts(static_cast<std::size_t>(tasks));
    pool.run(tasks, [&](int i, int) {
      parts[static_cast<std::size_t>(i)] =
          pass.run(i * each, std::min((i + 1) * each, pass.count()));
    });
    append(parts, static_cast<int>(r), pass.h(), out);
  }
  return out;
}

}  // namespace counterpoint::estimation
