#include "counterpoint/engine/estimate/motion/motion_fit.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "counterpoint/engine/batch.h"
#include "counterpoint/engine/estimate/parameters/parameter_kinds.h"
#include "counterpoint/engine/estimate/parameters/step_parameters.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

/// Largest step of a coordinate [m, rad], beyond which the linearization is invalid.
constexpr double kMaxStep = 0.3;
/// Number of instants whose normal equations are held in memory at a time.
constexpr int kBatch = 32;

std::size_t size(int i) { return static_cast<std::size_t>(i); }

}  // namespace

MotionFit::MotionFit(const MotionProblem& problem, MotionPoint start, int threads)
    : problem_(&problem),
      pool_(num_threads_of(threads)),
      options_(problem.options),
      model_(problem.model),
      point_(std::move(start)),
      instants_(size(problem.frames())),
      equations_(size(kBatch)),
      system_(problem.frames(), problem.nv(), problem.num_parameters()) {
  apply_parameters();
}

/// Applies the parameters of the point to the model.
void MotionFit::apply_parameters() {
  if (!models_.empty() && problem_->parameters.empty()) return;
  models_.clear();
  model_ = problem_->model;
  std::vector<StepParameter> parameters = problem_->parameters;
  const auto count = static_cast<Eigen::Index>(parameters.size());
  if (problem_->named.empty()) {
    for (std::size_t k = 0; k < parameters.size(); ++k)
      change_parameter(parameters[k], point_.parameters[static_cast<int>(k)], model_, options_);
  } else {
    const VectorX values = problem_->named_values + point_.parameters.head(count);
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      parameters[k] = step_parameter(problem_->named, k, values, problem_->model);
      set_parameter(problem_->named[k], values[static_cast<Eigen::Index>(k)], model_, options_);
    }
  }
  for (int i = 0; i < pool_.size(); ++i)
    models_.push_back(std::make_unique<InstantModel>(*problem_, model_, parameters));
}

void MotionFit::begin(const SimulationOptions& options, const MotionPoint& point) {
  options_ = options;
  point_ = point;
  damping_.begin();
  apply_parameters();
  cost_ = evaluate();
}

// The sum runs in the order of instants, so that the result does not depend on the threads.
double MotionFit::evaluate() {
  pool_.run(problem_->frames(), [&](int t, int thread) {
    models_[size(thread)]->evaluate(point_, options_, t, instants_[size(t)]);
  });
  double sum = 0.0;
  for (int t = 0; t < problem_->frames(); ++t)
    sum += instants_[size(t)].cost + change_cost(*problem_, instants_, t);
  sum += 0.5 * point_.parameters.cwiseProduct(problem_->parameter_weight).squaredNorm();
  return std::isfinite(sum) ? sum : kInfinity;
}

void MotionFit::linearize() {
  pool_.run(problem_->frames(), [&](int t, int thread) {
    models_[size(thread)]->differentiate(point_, options_, t, parameters_free_, instants_[size(t)]);
  });
  system_.set_zero();
  for (int first = 0; first < problem_->frames(); first += kBatch) {
    const int count = std::min(kBatch, problem_->frames() - first);
    pool_.run(count, [&](int i, int thread) {
      models_[size(thread)]->assemble(point_, instants_, first + i, equations_[size(i)]);
    });
    for (int i = 0; i < count; ++i) system_.add(first + i, equations_[size(i)]);
  }
  for (int k = 0; k < point_.parameters.size(); ++k)
    system_.add_prior(k, std::pow(problem_->parameter_weight[k], 2), point_.parameters[k]);
}

MotionSystem& MotionFit::linearized() {
  linearize();
  for (double mu = 0.0; !system_.factor(mu, pool_); mu = optimization::Damping::stronger(mu))
    if (optimization::Damping::exhausted(mu))
      throw std::runtime_error("the recorded motion has no finite forces in this scene");
  return system_;
}

/// Takes the step if it lowers the cost, and adapts the damping.
bool MotionFit::try_step(const MatrixX& frames, const VectorX& parameters) {
  const double expected = system_.expected_decrease(damping_.value(), frames, parameters);
  const double longest = frames.cwiseAbs().maxCoeff();
  const double share = longest > kMaxStep ? kMaxStep / longest : 1.0;
  const double before = cost_, decrease = before - move(frames, parameters, share);
  if (!(decrease > 0.0)) {
    withdraw();
    damping_.reject();
    return false;
  }
  damping_.accept(decrease, expected);
  return true;
}

double MotionFit::move(const MatrixX& frames, const VectorX& parameters, double share) {
  before_ = point_;
  cost_before_ = cost_;
  for (int t = 0; t < problem_->frames(); ++t) {
    VectorX& q = point_.q[size(t)];
    integrate_configuration(model_, before_.q[size(t)], frames.col(t), share, q);
  }
  point_.parameters += share * parameters;
  if (parameters_free_) apply_parameters();
  return cost_ = evaluate();
}

void MotionFit::withdraw() {
  point_ = before_;
  cost_ = cost_before_;
  if (parameters_free_) apply_parameters();
}

double MotionFit::measurement_ratio(int t, SensorRows& sensors) const {
  VectorX difference(model_.nv());
  configuration_difference(model_, point_.q[size(t)], problem_->measured[size(t)], difference);
  const auto weight = problem_->position_weight.col(t);
  auto count = static_cast<double>((weight.array() > 0.0).count());
  double sum = difference.cwiseProduct(weight).squaredNorm();
  sensors.evaluate(model_, problem_->sensor_frames(point_.q, point_.parameters), t, false);
  for (const WeightedRows* rows : {&sensors.of_frame(), &sensors.of_motion()}) {
    sum += rows->residual.head(rows->size).squaredNorm();
    count += rows->size;
  }
  return count > 0.0 ? sum / count : -1.0;
}

double MotionFit::measurement_ratio(int t) const {
  SensorRows sensors(model_, problem_->sensors, static_cast<int>(problem_->constants.size()));
  return std::max(0.0, measurement_ratio(t, sensors));
}

double MotionFit::measurement_ratio() const {
  SensorRows sensors(model_, problem_->sensors, static_cast<int>(problem_->constants.size()));
  double sum = 0.0;
  int measured = 0;
  for (int t = 0; t < problem_->frames(); ++t) {
    const double ratio = measurement_ratio(t, sensors);
    if (ratio < 0.0) continue;
    sum += ratio;
    ++measured;
  }
  return measured > 0 ? sum / measured : 0.0;
}

int MotionFit::minimize(int most, double tolerance, const std::function<bool()>& stop) {
  MatrixX frames;
  VectorX parameters;
  Descent descent(tolerance);
  for (int steps = 0; steps < most; ++steps) {
    if (stop && stop()) return steps;
    const double before = cost_;
    linearize();
    bool accepted = false;
    for (int trial = 0; damping_.allows(trial) && !accepted; ++trial) {
      if (system_.factor(damping_.value(), pool_)) {
        system_.solve(frames, parameters);
        if (frames.allFinite() && parameters.allFinite()) {
          if (!parameters_free_)
            parameters.head(static_cast<Eigen::Index>(problem_->parameters.size())).setZero();
          accepted = try_step(frames, parameters);
          continue;
        }
      }
      damping_.strengthen();
    }
    if (accepted && watch_) watch_();
    if (!accepted || descent.ends(before, cost_)) return steps + 1;
  }
  return most;
}

}  // namespace counterpoint::estimation
