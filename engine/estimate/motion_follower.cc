#include "counterpoint/engine/estimate/motion_follower.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/estimate/follow/motion_window.h"
#include "counterpoint/engine/estimate/motion/motion_priors.h"
#include "counterpoint/engine/estimate/motion/motion_result.h"
#include "counterpoint/engine/estimate/motion/pair_forces.h"
#include "counterpoint/engine/estimate/motion/recorded_motion.h"
#include "counterpoint/engine/estimate/sensors/motion_filter.h"

namespace counterpoint::estimation {
namespace {

/// Final smoothing for white errors, relative to that of an offline estimate: two steps per row do
/// not converge with a harder law.
constexpr double kSofterLaws = 10.0;
/// Number of rows over which the contact law hardens.
constexpr int kHardening = 10;
/// Frames that move less than this fraction of the final smoothing keep their linearization.
constexpr double kStill = 0.3;

struct Row {
  double time = 0.0;
  VectorX q, measured, force;
};

/// Replaces joints with a non-finite component by their values in `last`, marked as not measured.
void leave_out_missing(const Model& model, const VectorX& last, Row& row) {
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    const int nq = joint_nq(body.joint_type), nv = joint_nv(body.joint_type);
    if (row.q.segment(body.q_index, nq).allFinite()) continue;
    row.q.segment(body.q_index, nq) = last.segment(body.q_index, nq);
    row.measured.segment(body.v_index, nv).setZero();
  }
}

}  // namespace

struct MotionFollower::Impl {
  Impl(const Scene& given_scene, const ColumnMap& given_map, const FollowOptions& given_options)
      : scene(given_scene),
        map(given_map),
        options(given_options),
        errors(given_options.errors),
        sums(with_links(given_scene.model, given_options.sums)) {
    const std::vector<char> coordinates = recorded_coordinates(scene.model, map);
    recorded.resize(scene.model.nv());
    for (int i = 0; i < recorded.size(); ++i)
      recorded[i] = coordinates[static_cast<std::size_t>(i)] != 0 ? 1.0 : 0.0;
    if (options.lag < 1 || options.window < options.lag + 4)
      throw InputError(fmt::format(
          "a window of {} rows with a lag of {}: 1 row or more of lag are expected, and a window "
          "of 4 rows more than it",
          options.window, options.lag));
    if (recorded.isZero(0.0))
      throw InputError("the column map names no position; a motion is explained from positions");
  }

  MotionEstimate none() const { return empty_estimate(scene.model, {}, sums); }

  Recording first_recording() const {
    Recording recording;
    recording.file = "rows";
    const auto count = static_cast<Eigen::Index>(first.size());
    recording.q.resize(scene.model.nq(), count);
    recording.v = MatrixX::Zero(scene.model.nv(), count);
    recording.applied_force = recording.v;
    for (Eigen::Index k = 0; k < count; ++k) {
      const Row& row = first[static_cast<std::size_t>(k)];
      recording.time.push_back(row.time);
      recording.q.col(k) = row.q;
      recording.applied_force.col(k) = row.force;
    }
    return recording;
  }

  /// The first rows, evenly spaced, with their noise.
  RecordedMotion first_rows(const Recording& recording) const {
    RecordedMotion out = prepare(scene.model, map, recording);
    if (out.rows() == recording.num_rows())
      for (int k = 0; k < out.rows(); ++k)
        out.measured.col(k) =
            out.measured.col(k).cwiseProduct(first[static_cast<std::size_t>(k)].measured);
    return out;
  }

  /// Estimates all of the first rows with a new window.
  MotionEstimate begin() {
    const Recording recording = first_recording();
    const RecordedMotion rows = first_rows(recording);
    if (!errors) {
      MotionEstimateOptions whole;
      whole.threads = options.threads;
      errors = estimate_motion(scene, map, recording, whole).errors;
    }
    MotionEstimate out = explain(rows, *errors);
    first.clear();
    return out;
  }

  MotionEstimate explain(const RecordedMotion& rows, RecordingErrors kind) {
    const bool slow = kind == RecordingErrors::kSlow;
    MotionPriors priors = slow ? slow_priors(scene, map, rows) : white_priors(scene, map, rows);
    h = rows.h();
    cutoff = priors.cutoff;
    weight = priors.position.cwiseInverse();
    WindowOptions w;
    w.frames = options.window;
    w.steps = options.steps;
    w.threads = options.threads;
    w.newest = priors.smoothing_starts.back();
    w.oldest = slow ? priors.smoothing_end : kSofterLaws * priors.smoothing_end;
    w.hardening = std::min(kHardening, options.lag);
    w.changing = std::max(w.hardening, slow ? reach() + 1 : 0);
    w.still = kStill * w.oldest;
    window = std::make_unique<MotionWindow>(motion_problem(scene, rows, priors), w);
    times.clear();
    told = 0;
    MotionEstimate out = none();
    const int together = std::min(options.window, rows.rows());
    for (int k = 0; k < rows.rows(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      add({rows.time[i], rows.frames[i], rows.measured.col(k), rows.force.col(k)});
      if (k + 1 < together) continue;
      if (k + 1 == together) window->begin();
      if (k + 1 > together) window->improve();
      tell(options.lag, out);
    }
    next = rows.time.back() + h;
    return out;
  }

  /// Number of rows on either side that affect an acceleration of the low-passed recording.
  int reach() const { return low_pass_reach(cutoff, h) + 1; }

  void add(const Row& row) {
    if (static_cast<int>(times.size()) == options.window) {
      times.erase(times.begin());
      --told;
    }
    times.push_back(row.time);
    window->push({row.q, weight.cwiseProduct(row.measured), row.force});
    if (cutoff <= 0.0) return;
    const std::vector<VectorX>& all = window->problem().measured;
    const int count = static_cast<int>(all.size()), seen = std::min(count, 2 * reach() + 1);
    const std::vector<VectorX> newest(all.end() - seen, all.end());
    const MatrixX a = accelerations(scene.model, low_pass(scene.model, newest, h, cutoff), h);
    for (int k = std::max(1, seen - reach()); k + 1 < seen; ++k)
      window->set_acceleration(count - seen + k, a.col(k));
  }

  /// Appends the unreported rows of age `age` and more; age 0 includes the last row.
  void tell(int age, MotionEstimate& out) {
    const int end = window->frames() - age;
    if (told >= end) return;
    std::vector<double> time(times.begin() + told, times.begin() + end);
    MotionEstimate rows = empty_estimate(scene.model, time, sums);
    for (int t = told; t < end; ++t) set_row(t, t - told, rows);
    told = end;
    MotionEstimate both = empty_estimate(scene.model, joined(out.time, time), sums);
    append(out, 0, 0, both);
    append(rows, static_cast<int>(out.time.size()), 0, both);
    out = std::move(both);
    out.errors = errors.value_or(RecordingErrors::kWhite);
    out.position_deviation = weight.cwiseInverse();
  }

  static std::vector<double> joined(std::vector<double> a, const std::vector<double>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  }

  /// Writes frame t of the window into row `row` of a result.
  void set_row(int t, int row, MotionEstimate& out) {
    const std::vector<VectorX>& q = window->point().q;
    const auto i = static_cast<std::size_t>(t);
    const bool inner = t > 0 && t + 1 < window->frames();
    const std::size_t before = t > 0 ? i - 1 : i, behind = t + 1 < window->frames() ? i + 1 : i;
    out.q.col(row) = q[i];
    out.v.col(row) = difference(scene.model, q[before], q[behind]) /
                     (h * static_cast<double>(std::max<std::size_t>(1, behind - before)));
    const MotionProblem& problem = window->problem();
    const VectorX own = problem.position_weight.col(t);
    const double count = static_cast<double>((own.array() > 0.0).count());
    const VectorX off = difference(scene.model, problem.measured[i], q[i]).cwiseProduct(own);
    out.cost_ratio[row] = count > 0.0 ? off.squaredNorm() / count : 0.0;
    if (!inner) return;
    set_unsure(scene.model, window->invert(t), row, out);
  }

  /// Adds rows at even times between the last pushed row and this one.
  void add_between(const Row& row, MotionEstimate& out) {
    const auto step = [&](const Row& one) {
      add(one);
      window->improve();
      tell(options.lag, out);
      next = one.time + h;
    };
    if (std::abs(row.time - next) <= kUneven * h) return step(row);
    const double interval = row.time - last.time;
    const VectorX by = difference(scene.model, last.q, row.q);
    while (next <= row.time + kUneven * h) {
      const double share = std::min(1.0, (next - last.time) / interval);
      Row one{next, moved(scene.model, last.q, share * by), last.measured.cwiseMin(row.measured),
              VectorX()};
      one.force = (1.0 - share) * last.force + share * row.force;
      if (interval > kGap * h && share < 1.0 - kUneven) one.measured.setZero();
      step(one);
    }
  }

  const Scene scene;
  const ColumnMap map;
  FollowOptions options;
  std::optional<RecordingErrors> errors;
  std::vector<ContactSum> sums;
  VectorX recorded, weight;
  double h = 0.0, cutoff = 0.0, next = 0.0;  ///< next: time of the next even row [s]
  std::vector<Row> first;                    ///< rows before the first estimate
  Row last;                                  ///< the row pushed last
  std::unique_ptr<MotionWindow> window;
  std::vector<double> times;  ///< times of the window's frames [s]
  int told = 0;               ///< number of frames of the window that were reported
};

MotionFollower::MotionFollower(const Scene& scene, const ColumnMap& map,
                               const FollowOptions& options)
    : impl_(std::make_unique<Impl>(scene, map, options)) {
  refuse_sensors(map, "rows that are followed");
  refuse_inputs(map, "rows that are followed");
}
MotionFollower::~MotionFollower() = default;

RecordingErrors MotionFollower::errors() const {
  return impl_->errors.value_or(RecordingErrors::kWhite);
}
const std::vector<ContactSum>& MotionFollower::sums() const { return impl_->sums; }

MotionEstimate MotionFollower::push(double time, const VectorX& q, const VectorX& force) {
  Impl& p = *impl_;
  const Model& model = p.scene.model;
  if (q.size() != model.nq() || (force.size() != 0 && force.size() != model.nv()))
    throw InputError(
        fmt::format("a row of {} positions and {} forces; {}, and {} or none are expected",
                    q.size(), force.size(), model.nq(), model.nv()));
  const bool any = p.window || !p.first.empty();
  if (!std::isfinite(time) || (any && !(time > p.last.time)))
    throw InputError(fmt::format("a row at {} s behind one at {} s; times are expected to rise",
                                 time, any ? p.last.time : 0.0));
  Row row{time, q, p.recorded, force.size() > 0 ? force : VectorX(VectorX::Zero(model.nv()))};
  leave_out_missing(model, any ? p.last.q : p.scene.q, row);
  MotionEstimate out = p.none();
  if (p.window && time - p.last.time > p.options.window * p.h) out = finish();
  if (p.window) {
    p.add_between(row, out);
    p.last = row;
    return out;
  }
  p.first.push_back(row);
  p.last = row;
  if (static_cast<int>(p.first.size()) < std::max(kFollowedRows, p.options.window)) return out;
  return out.time.empty() ? p.begin() : out;
}

MotionEstimate MotionFollower::finish() {
  Impl& p = *impl_;
  MotionEstimate out = p.none();
  if (!p.window && static_cast<int>(p.first.size()) >= kLeastRows) out = p.begin();
  if (p.window) {
    for (int age = 1; age <= p.options.lag; ++age) p.window->improve(age);
    p.tell(0, out);
  }
  p.window.reset();
  p.first.clear();
  return out;
}

}  // namespace counterpoint::estimation
