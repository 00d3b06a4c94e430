#include "counterpoint/engine/estimate/follow/motion_window.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/batch.h"
#include "counterpoint/engine/estimate/motion/motion_continuation.h"
#include "counterpoint/engine/estimate/sensors/motion_filter.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

/// Largest step of a coordinate [m, rad], beyond which the linearization is invalid.
constexpr double kLongestWindowStep = 0.3;
/// Damping of the first step of a row, as a fraction of the diagonal. It is multiplied by
/// kMoreDamping after a failed step and by kLessDamping after a good one, down to
/// kLeastWindowDamping.
constexpr double kFirstWindowDamping = 1e-3, kMoreDamping = 10.0, kLessDamping = 0.1;
constexpr double kLeastWindowDamping = 1e-6;
/// Limit of trials; in the first kNewTrials, frames whose laws no longer change are not damped, so
/// that their fronts stay valid.
constexpr int kTrials = 5, kNewTrials = 3;
/// Initial guess of a new frame: this fraction of the way from the extrapolated motion to the
/// measurement.
constexpr double kTowards = 0.5;

}  // namespace

MotionWindow::MotionWindow(MotionProblem problem, const WindowOptions& options)
    : options_(options),
      problem_(std::move(problem)),
      pool_(num_threads_of(options.threads)),
      model_(problem_.model),
      instants_(index_of(options.frames)),
      equations_(index_of(options.frames)),
      fronts_(model_, options.frames, static_cast<int>(problem_.parameters.size())),
      moved_(index_of(options.frames), 0.0) {
  const int nv = problem_.nv(), frames = options.frames;
  for (int age = 0; age <= options.hardening; ++age) {
    const double share = options.hardening > 0 ? double(age) / options.hardening : 1.0;
    laws_.push_back(
        stage_options(problem_, options.newest * std::pow(options.oldest / options.newest, share)));
  }
  problem_.measured.clear();
  problem_.position_weight.setZero(nv, frames);
  problem_.acceleration.setZero(nv, frames);
  problem_.force.setZero(nv, frames);
  point_.parameters.setZero(static_cast<Eigen::Index>(problem_.parameters.size()));
  steps_.setZero(nv, frames);
  apply_parameters();
}

MotionWindow::~MotionWindow() = default;

void MotionWindow::apply_parameters() {
  if (!models_.empty() && problem_.parameters.empty()) return;
  models_.clear();
  model_ = problem_.model;
  SimulationOptions unused = problem_.options;
  for (std::size_t k = 0; k < problem_.parameters.size(); ++k)
    change_parameter(problem_.parameters[k], point_.parameters[static_cast<int>(k)], model_,
                     unused);
  for (int i = 0; i < pool_.size(); ++i)
    models_.push_back(std::make_unique<InstantModel>(problem_, model_));
}

int MotionWindow::age_of(int t) const {
  return std::clamp(frames() - 1 - t + age_, 0, options_.hardening);
}

const SimulationOptions& MotionWindow::options_of(int t) const {
  return laws_[index_of(age_of(t))];
}

const Inverse& MotionWindow::invert(int t) {
  return models_.front()->invert(point_, options_of(t), t);
}

void MotionWindow::drop_first() {
  fronts_.drop_first();
  std::rotate(instants_.begin(), instants_.begin() + 1, instants_.end());
  std::rotate(moved_.begin(), moved_.begin() + 1, moved_.end());
  point_.q.erase(point_.q.begin());
  problem_.measured.erase(problem_.measured.begin());
  for (MatrixX* columns : {&problem_.position_weight, &problem_.acceleration, &problem_.force})
    for (Eigen::Index t = 1; t < columns->cols(); ++t) columns->col(t - 1) = columns->col(t);
  valid_ = std::max(0, valid_ - 1);
  begins_ = false;
}

void MotionWindow::push(const WindowRow& row) {
  if (frames() == options_.frames) drop_first();
  const int t = frames();
  VectorX q = row.q;
  if (t > 1) {
    q = moved(model_, point_.q[index_of(t - 1)],
              difference(model_, point_.q[index_of(t - 2)], point_.q[index_of(t - 1)]));
    const VectorX off = difference(model_, q, row.q);
    q = moved(model_, q, kTowards * (row.weight.array() > 0.0).select(off, 0.0));
  }
  point_.q.push_back(q);
  problem_.measured.push_back(row.q);
  problem_.position_weight.col(t) = row.weight;
  problem_.acceleration.col(t).setZero();
  problem_.force.col(t) = row.force;
  moved_[index_of(t)] = kInfinity;
}

void MotionWindow::set_acceleration(int t, const VectorX& acceleration) {
  problem_.acceleration.col(t) = acceleration;
}

/// Linearizes the instants whose first frame is `first` or later, and the one before them.
void MotionWindow::linearize(int first) {
  const int begin = begins_ && first == 0 ? 0 : first + 1, last = frames() - 1;
  pool_.run(frames() - begin, [&](int i, int thread) {
    models_[index_of(thread)]->differentiate(point_, options_of(begin + i), begin + i,
                                             !problem_.parameters.empty(),
                                             instants_[index_of(begin + i)]);
  });
  differentiated_ += std::max(0, last - begin);
  const int own = begins_ && first == 0 ? 0 : first + 2;
  pool_.run(frames() - own, [&](int i, int thread) {
    models_[index_of(thread)]->assemble(point_, instants_, own + i, equations_[index_of(own + i)]);
  });
  if (begins_ && first == 0) {
    fronts_.clear(0);
    for (int t = 0; t < std::min(2, frames()); ++t) fronts_.add(0, equations_[index_of(t)], 2 - t);
    WindowFront& front = fronts_.front(0);
    const VectorX weight2 = problem_.parameter_weight.cwiseAbs2();
    front.information.bottomRightCorner(weight2.size(), weight2.size()).diagonal() += weight2;
    front.gradient.tail(weight2.size()) += weight2.cwiseProduct(point_.parameters);
    front.at.q.clear();
    front.at.parameters = point_.parameters;
    for (int a = 0; a < std::min(3, frames()); ++a) front.at.q.push_back(point_.q[index_of(a)]);
  } else {
    fronts_.move(first, point_);
  }
}

bool MotionWindow::factor(int first, int undamped, double damping) {
  for (int k = first; k < frames(); ++k) {
    const InstantEquations* own = k + 2 < frames() ? &equations_[index_of(k + 2)] : nullptr;
    const double own_damping = k > undamped ? damping : 0.0;
    if (!fronts_.eliminate(k, own, own_damping, point_)) return false;
  }
  if (!fronts_.solve_parameters(frames(), damping, parameter_step_)) return false;
  for (int k = frames() - 1; k >= first; --k)
    steps_.col(k) = fronts_.substitute(k, steps_.leftCols(frames()), parameter_step_);
  return steps_.middleCols(first, frames() - first).allFinite() && parameter_step_.allFinite();
}

/// Cost of the rows that depend on the frames from `first` on, including the front there.
double MotionWindow::cost(int first) {
  const bool all = begins_ && first == 0;
  const int begin = all ? 0 : first + 1;
  pool_.run(frames() - begin, [&](int i, int thread) {
    models_[index_of(thread)]->evaluate(point_, options_of(begin + i), begin + i,
                                        instants_[index_of(begin + i)]);
  });
  double sum = all ? 0.5 * point_.parameters.cwiseProduct(problem_.parameter_weight).squaredNorm()
                   : fronts_.cost(first, point_);
  for (int t = all ? 0 : first + 2; t < frames(); ++t) {
    sum += instants_[index_of(t)].cost;
    if (t + 1 < frames()) sum += change_cost(problem_, instants_, t);
  }
  return std::isfinite(sum) ? sum : kInfinity;
}

/// Moves the frames before `first` by back substitution, given the later ones.
void MotionWindow::follow_behind(int first) {
  for (int k = first - 1; k >= 0; --k) {
    const VectorX by = fronts_.substitute(k, point_);
    moved_[index_of(k)] = by.cwiseAbs().maxCoeff();
    point_.q[index_of(k)] = moved(model_, fronts_.eliminated_at(k), by);
  }
}

/// First frame to linearize again, at most `most`: three before the first one that moved.
int MotionWindow::first_moved(int most) const {
  int first = 0;
  while (first < most && moved_[index_of(first)] <= options_.still) ++first;
  return std::max(0, std::min({most, first - 3, valid_}));
}

bool MotionWindow::step(int first, int most) {
  linearize(first);
  const double before = cost(first);
  const MotionPoint start = point_;
  bool better = false;
  double damping = damping_;
  for (int trial = 0; trial < kTrials && !better; ++trial) {
    if (trial > 0) damping *= kMoreDamping;
    const int undamped = trial < kNewTrials ? std::max(first, most) : first - 1;
    if (!factor(first, undamped, damping)) continue;
    valid_ = undamped + 1;
    const auto active = steps_.middleCols(first, frames() - first);
    const double longest = active.cwiseAbs().maxCoeff();
    const double share = longest > kLongestWindowStep ? kLongestWindowStep / longest : 1.0;
    for (int k = first; k < frames(); ++k) {
      point_.q[index_of(k)] = moved(model_, start.q[index_of(k)], share * steps_.col(k));
      moved_[index_of(k)] = share * steps_.col(k).cwiseAbs().maxCoeff();
    }
    point_.parameters = start.parameters + share * parameter_step_;
    if (point_.parameters.size() > 0) apply_parameters();
    better = cost(first) < before;
  }
  damping_ = better ? std::max(kLeastWindowDamping, kLessDamping * damping) : damping;
  if (!better) {
    point_ = start;
    if (point_.parameters.size() > 0) apply_parameters();
    valid_ = std::min(valid_, first);
  }
  follow_behind(first);
  return better;
}

void MotionWindow::begin() {
  for (int age = 1 - frames(); age <= 0; ++age) improve(age);
}

void MotionWindow::improve(int age) {
  age_ = age;
  damping_ = kFirstWindowDamping;
  if (frames() < 4) return;
  int most = std::max(0, frames() - 1 - options_.changing - 2);
  if (age > 0) most = std::max(0, frames() - 3);
  if (age < 0) most = 0;
  for (int i = 0; i < options_.steps; ++i)
    if (!step(first_moved(most), most)) break;
}

}  // namespace counterpoint::estimation
