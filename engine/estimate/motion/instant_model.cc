#include "counterpoint/engine/estimate/motion/instant_model.h"

#include <algorithm>
#include <array>
#include <optional>

#include "counterpoint/engine/estimate/motion/force_scales.h"
#include "counterpoint/engine/estimate/sensors/robust_loss.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

using optimization::TangentMap;

/// Step of finite differences: this fraction of the smoothing, within bounds [m, rad].
constexpr double kStepShare = 1e-3, kLeastStep = 1e-10, kMostStep = 1e-6;

/// Adds a' diag(weight) b to out.
void add_map_product(const TangentMap& a, const VectorX& weight, const TangentMap& b,
                     const std::vector<int>& rotations, Eigen::Ref<MatrixX> out) {
  std::size_t next = 0;
  for (int i = 0; i < weight.size();) {
    if (next < rotations.size() && rotations[next] == i) {
      out.block<3, 3>(i, i) +=
          a.blocks[next].transpose() * weight.segment<3>(i).asDiagonal() * b.blocks[next];
      i += 3;
      ++next;
    } else {
      out(i, i) += a.diagonal[i] * weight[i] * b.diagonal[i];
      ++i;
    }
  }
}

/// Adds map' x to out.
void add_transposed(const TangentMap& map, const VectorX& x, const std::vector<int>& rotations,
                    Eigen::Ref<VectorX> out) {
  std::size_t next = 0;
  for (int i = 0; i < x.size();) {
    if (next < rotations.size() && rotations[next] == i) {
      out.segment<3>(i) += map.blocks[next].transpose() * x.segment<3>(i);
      i += 3;
      ++next;
    } else {
      out[i] += map.diagonal[i] * x[i];
      ++i;
    }
  }
}

bool any(const VectorX& weight) { return weight.size() > 0 && weight.maxCoeff() > 0.0; }

}  // namespace

struct InstantModel::Impl {
  Impl(const MotionProblem& of, const Model& changed, const std::vector<StepParameter>& parameters)
      : problem(of),
        model(changed),
        rotations(optimization::rotation_starts(changed)),
        workspace(changed),
        sensors(changed, of.sensors, static_cast<int>(of.constants.size())),
        force_sensors(of.sensors) {
    for (VectorX* x : {&v, &w, &difference}) x->resize(model.nv());
    if (!parameters.empty()) {
      derivator.emplace(model, parameters);
      const VectorX scales = force_scales(model);
      scale_ratio = force_scales(problem.model).cwiseQuotient(scales);
      slopes = force_scale_slopes(parameters, model, scales);
    }
  }

  int last() const { return problem.frames() - 1; }

  /// Sets the velocities before and after frame t; `maps`: also their derivatives with respect to
  /// frames.
  void set_velocities(const MotionPoint& point, int t, bool maps) {
    const auto i = static_cast<std::size_t>(t);
    configuration_difference(model, point.q[i - 1], point.q[i], difference);
    v = difference / problem.h();
    if (maps) optimization::differentiate_difference(difference, rotations, v_by[0], v_by[1]);
    configuration_difference(model, point.q[i], point.q[i + 1], difference);
    w = difference / problem.h();
    if (!maps) return;
    optimization::differentiate_difference(difference, rotations, w_by[0], w_by[1]);
    for (TangentMap* map : {&v_by[0], &v_by[1], &w_by[0], &w_by[1]}) *map *= 1.0 / problem.h();
  }

  /// Sets the derivatives of the acceleration (w - v) / h with respect to the three frames. Needs
  /// the maps of velocities.
  void set_acceleration_maps() {
    a_by[0] = v_by[0];
    a_by[0] *= -1.0;
    a_by[1] = v_by[1];
    a_by[1] *= -1.0;
    a_by[1] += w_by[0];
    a_by[2] = w_by[1];
    for (TangentMap& map : a_by) map *= 1.0 / problem.h();
  }

  VectorX acceleration_residual(int t) const {
    return (w - v) / problem.h() - problem.acceleration.col(t);
  }

  double measurement_cost(const MotionPoint& point, int t) {
    const auto i = static_cast<std::size_t>(t);
    configuration_difference(model, problem.measured[i], point.q[i], difference);
    return RobustLoss{problem.loss_scale}.cost(
        difference.cwiseProduct(problem.position_weight.col(t)));
  }

  double sensor_cost(const MotionPoint& point, int t) {
    if (problem.sensors.empty()) return 0.0;
    sensors.evaluate(model, problem.sensor_frames(point.q, point.parameters), t, false);
    const WeightedRows &frame = sensors.of_frame(), &motion = sensors.of_motion();
    return RobustLoss{problem.loss_scale}.cost(frame.residual.head(frame.size)) +
           problem.sensor_loss().cost(motion.residual.head(motion.size));
  }

  void add_sensors(const MotionPoint& point, int t, InstantEquations& out) {
    if (problem.sensors.empty()) return;
    sensors.evaluate(model, problem.sensor_frames(point.q, point.parameters), t, true);
    const auto first_constant = static_cast<Eigen::Index>(problem.parameters.size());
    for (const WeightedRows* one : {&sensors.of_frame(), &sensors.of_motion()}) {
      if (one->size == 0) continue;
      const VectorX residual = one->residual.head(one->size);
      const bool alone = one == &sensors.of_frame();
      const RobustLoss robust = alone ? RobustLoss{problem.loss_scale} : problem.sensor_loss();
      const VectorX weight = robust.weight(residual).cwiseSqrt();
      rows.noalias() = weight.asDiagonal() * one->by_frames.topRows(one->size);
      by_parameters.setZero(one->size, problem.num_parameters());
      by_parameters.rightCols(by_parameters.cols() - first_constant) =
          weight.asDiagonal() * one->by_constants.topRows(one->size);
      add_rows(alone ? 2 : 1, rows, weight.cwiseProduct(residual), by_parameters, out);
    }
  }

  void add_force_sensors(const Instant& at, InstantEquations& out) {
    if (!force_sensors.any()) return;
    const VectorX weight = problem.sensor_loss().weight(at.sensed).cwiseSqrt();
    rows.noalias() = weight.asDiagonal() * at.sensed_by_frames;
    by_parameters.noalias() = weight.asDiagonal() * at.sensed_by_parameters;
    add_rows(1, rows, weight.cwiseProduct(at.sensed), by_parameters, out);
  }

  double step_cost(int t, const VectorX& u) const {
    double sum = RobustLoss{problem.force_loss_scale}.cost(u.cwiseProduct(size_weight()));
    if (any(problem.force_weight))
      sum += 0.5 * problem.force_weight.cwiseProduct(u - problem.force.col(t)).squaredNorm();
    if (any(problem.acceleration_weight))
      sum += RobustLoss{problem.loss_scale}.cost(
          acceleration_residual(t).cwiseProduct(problem.acceleration_weight));
    return sum;
  }

  void add_measurement(const MotionPoint& point, int t, InstantEquations& out) {
    const int nv = model.nv();
    const auto i = static_cast<std::size_t>(t);
    configuration_difference(model, problem.measured[i], point.q[i], difference);
    optimization::differentiate_difference(difference, rotations, v_by[0], v_by[1]);
    const VectorX own = problem.position_weight.col(t);
    const VectorX weight = own.cwiseAbs2().cwiseProduct(
        RobustLoss{problem.loss_scale}.weight(difference.cwiseProduct(own)));
    add_map_product(v_by[1], weight, v_by[1], rotations, out.gram.block(2 * nv, 2 * nv, nv, nv));
    add_transposed(v_by[1], weight.cwiseProduct(difference), rotations,
                   out.gradient.segment(2 * nv, nv));
  }

  void add_acceleration(int t, InstantEquations& out) {
    const int nv = model.nv();
    set_acceleration_maps();
    const VectorX residual = acceleration_residual(t), own = problem.acceleration_weight;
    const VectorX weight2 = own.cwiseAbs2().cwiseProduct(
        RobustLoss{problem.loss_scale}.weight(residual.cwiseProduct(own)));
    const VectorX pull = weight2.cwiseProduct(residual);
    for (int a = 0; a < 3; ++a) {
      add_transposed(a_by[static_cast<std::size_t>(a)], pull, rotations,
                     out.gradient.segment((1 + a) * nv, nv));
      for (int b = 0; b <= a; ++b)
        add_map_product(a_by[static_cast<std::size_t>(a)], weight2,
                        a_by[static_cast<std::size_t>(b)], rotations,
                        out.gram.block((1 + a) * nv, (1 + b) * nv, nv, nv));
    }
  }

  /// Adds weighted rows: J (by the frames from `first` of the four on), residual, and P (by
  /// parameters).
  void add_rows(int first, const MatrixX& J, const VectorX& residual, const MatrixX& P,
                InstantEquations& out) const {
    const int at = first * model.nv();
    const Eigen::Index size = J.cols();
    out.gram.block(at, at, size, size).selfadjointView<Eigen::Lower>().rankUpdate(J.transpose());
    out.gradient.segment(at, size).noalias() += J.transpose() * residual;
    if (P.cols() == 0) return;
    out.border.middleRows(at, size).noalias() += J.transpose() * P;
    out.corner.noalias() += P.transpose() * P;
    out.corner_gradient.noalias() += P.transpose() * residual;
  }

  /// Weights of the force magnitude, which depend on the inertial parameters.
  VectorX size_weight() const {
    return scale_ratio.size() > 0 ? VectorX(problem.size_weight.cwiseProduct(scale_ratio))
                                  : problem.size_weight;
  }

  /// Adds the rows of the force magnitude.
  void add_size(const Instant& instant, InstantEquations& out) {
    const VectorX size = instant.force.cwiseProduct(size_weight());
    const VectorX share = RobustLoss{problem.force_loss_scale}.weight(size).cwiseSqrt();
    const VectorX weight = size_weight().cwiseProduct(share), residual = size.cwiseProduct(share);
    rows.noalias() = weight.asDiagonal() * instant.by_frames;
    by_parameters.noalias() = weight.asDiagonal() * instant.by_parameters;
    if (slopes.size() > 0) by_parameters.leftCols(slopes.cols()) -= residual.asDiagonal() * slopes;
    add_rows(1, rows, residual, by_parameters, out);
  }

  /// Adds the rows of the difference from a measured force.
  void add_measured_force(const Instant& instant, int t, InstantEquations& out) {
    rows.noalias() = problem.force_weight.asDiagonal() * instant.by_frames;
    by_parameters.noalias() = problem.force_weight.asDiagonal() * instant.by_parameters;
    add_rows(1, rows, problem.force_weight.cwiseProduct(instant.force - problem.force.col(t)),
             by_parameters, out);
  }

  void add_change(const Instant& before, const Instant& at, InstantEquations& out) {
    const int nv = model.nv();
    change.setZero(nv, 4 * nv);
    change.leftCols(3 * nv) = -before.by_frames;
    change.rightCols(3 * nv) += at.by_frames;
    change = problem.change_weight.asDiagonal() * change;
    by_parameters.noalias() =
        problem.change_weight.asDiagonal() * (at.by_parameters - before.by_parameters);
    add_rows(0, change, problem.change_weight.cwiseProduct(at.force - before.force), by_parameters,
             out);
  }

  const MotionProblem& problem;
  const Model& model;
  std::vector<int> rotations;
  Workspace workspace;
  SensorRows sensors;
  ForceSensors force_sensors;
  MotionPoint scratch;  ///< frames for the differences of force_sensors
  std::optional<ParameterDerivator> derivator;
  Inverse inverse;
  InverseDerivatives d;
  InverseParameterDerivatives d_parameters;
  VectorX v, w, difference;
  VectorX scale_ratio;  ///< nv: size_weight() over that of the problem; empty: 1
  MatrixX slopes;       ///< nv x parameters: derivatives of the logarithms of force_scales
  std::array<TangentMap, 2> v_by, w_by;  ///< derivatives of velocities with respect to the frames
                                         ///< before and after
  std::array<TangentMap, 3> a_by;  ///< derivatives of the acceleration with respect to its three
                                   ///< frames
  MatrixX rows, change, by_parameters;
};

InstantModel::InstantModel(const MotionProblem& problem, const Model& model,
                           const std::vector<StepParameter>& parameters)
    : impl_(std::make_unique<Impl>(problem, model, parameters)) {}
InstantModel::~InstantModel() = default;

const Inverse& InstantModel::invert(const MotionPoint& point, const SimulationOptions& options,
                                    int t) {
  Impl& p = *impl_;
  p.set_velocities(point, t, false);
  step_inverse(p.model, options, point.q[static_cast<std::size_t>(t)], p.v, p.w, p.workspace,
               p.inverse);
  return p.inverse;
}

void InstantModel::evaluate(const MotionPoint& point, const SimulationOptions& options, int t,
                            Instant& out) {
  Impl& p = *impl_;
  out.cost = p.measurement_cost(point, t) + p.sensor_cost(point, t);
  if (t == 0 || t == p.last()) return;
  const Inverse& inverse = invert(point, options, t);
  out.force = inverse.applied_force;
  out.cost = inverse.fault.any() ? kInfinity : out.cost + p.step_cost(t, out.force);
  if (!p.force_sensors.any()) return;
  p.force_sensors.evaluate(p.model, p.problem.sensor_frames(point.q, point.parameters), t, inverse,
                           out.sensed);
  out.cost += p.problem.sensor_loss().cost(out.sensed);
}

/// Differentiates measured contact forces and wrenches by central differences, since they have no
/// closed form here. Needs the derivatives of the applied force.
void InstantModel::differentiate_sensed(const MotionPoint& point, const SimulationOptions& options,
                                        int t, Instant& out) {
  Impl& p = *impl_;
  if (!p.force_sensors.any()) return;
  const int nv = p.model.nv();
  const SensorFrames frames = p.problem.sensor_frames(point.q, point.parameters);
  p.force_sensors.evaluate(p.model, frames, t, p.inverse, out.sensed);
  out.sensed_by_parameters.setZero(out.sensed.size(), p.problem.num_parameters());
  p.force_sensors.differentiate_constants(
      p.model, frames, t, p.inverse, out.sensed_by_parameters.rightCols(frames.constants.size()));
  p.force_sensors.add_joints(frames, out.by_parameters, out.sensed_by_parameters);
  out.sensed_by_frames.setZero(out.sensed.size(), 3 * nv);
  if (p.force_sensors.any_differences()) difference_sensed(point, options, t, out);
  p.force_sensors.add_joints(frames, out.by_frames, out.sensed_by_frames);
}

void InstantModel::difference_sensed(const MotionPoint& point, const SimulationOptions& options,
                                     int t, Instant& out) {
  Impl& p = *impl_;
  const int nv = p.model.nv();
  const double step = difference_step(options);
  p.scratch.q.resize(point.q.size());
  const SensorFrames frames = p.problem.sensor_frames(p.scratch.q, point.parameters);
  for (int i = t - 1; i <= t + 1; ++i)
    p.scratch.q[static_cast<std::size_t>(i)] = point.q[static_cast<std::size_t>(i)];
  VectorX ahead, back, unit = VectorX::Zero(nv);
  for (int column = 0; column < 3 * nv; ++column) {
    const auto frame = static_cast<std::size_t>(t - 1 + column / nv);
    unit[column % nv] = 1.0;
    integrate_configuration(p.model, point.q[frame], unit, step, p.scratch.q[frame]);
    p.force_sensors.evaluate(p.model, frames, t, invert(p.scratch, options, t), ahead);
    integrate_configuration(p.model, point.q[frame], unit, -step, p.scratch.q[frame]);
    p.force_sensors.evaluate(p.model, frames, t, invert(p.scratch, options, t), back);
    out.sensed_by_frames.col(column) = (ahead - back) / (2.0 * step);
    p.scratch.q[frame] = point.q[frame];
    unit[column % nv] = 0.0;
  }
}

double difference_step(const SimulationOptions& options) {
  return std::clamp(kStepShare * options.contact.smoothing, kLeastStep, kMostStep);
}

void InstantModel::differentiate(const MotionPoint& point, const SimulationOptions& options, int t,
                                 bool parameters, Instant& out) {
  Impl& p = *impl_;
  if (t == 0 || t == p.last()) return;
  const int nv = p.model.nv();
  const VectorX& q = point.q[static_cast<std::size_t>(t)];
  p.set_velocities(point, t, true);
  out.by_parameters.setZero(nv, p.problem.num_parameters());
  if (parameters && p.derivator) {
    p.derivator->inverse(p.model, options, q, p.v, p.w, Input(), p.workspace, p.inverse,
                         p.d_parameters);
    out.by_parameters.leftCols(p.d_parameters.du.cols()) = p.d_parameters.du;
  }
  step_inverse_derivatives(p.model, options, q, p.v, p.w, Input(), p.workspace, p.inverse, p.d);
  out.force = p.inverse.applied_force;
  MatrixX& J = out.by_frames;
  J.setZero(nv, 3 * nv);
  J.middleCols(nv, nv) = p.d.dq;
  optimization::add_product(p.d.dv, p.v_by[0], p.rotations, J.leftCols(nv));
  optimization::add_product(p.d.dv, p.v_by[1], p.rotations, J.middleCols(nv, nv));
  optimization::add_product(p.d.dv_next, p.w_by[0], p.rotations, J.middleCols(nv, nv));
  optimization::add_product(p.d.dv_next, p.w_by[1], p.rotations, J.rightCols(nv));
  differentiate_sensed(point, options, t, out);
}

void InstantModel::assemble(const MotionPoint& point, const std::vector<Instant>& instants, int t,
                            InstantEquations& out) {
  Impl& p = *impl_;
  const Instant& at = instants[static_cast<std::size_t>(t)];
  out.set_zero(p.model.nv(), p.problem.num_parameters());
  p.add_measurement(point, t, out);
  p.add_sensors(point, t, out);
  if (t == 0 || t == p.last()) return;
  if (any(p.problem.acceleration_weight)) {
    p.set_velocities(point, t, true);
    p.add_acceleration(t, out);
  }
  p.add_force_sensors(at, out);
  p.add_size(at, out);
  if (any(p.problem.force_weight)) p.add_measured_force(at, t, out);
  if (t > 1 && any(p.problem.change_weight))
    p.add_change(instants[static_cast<std::size_t>(t - 1)], at, out);
}

double change_cost(const MotionProblem& problem, const std::vector<Instant>& instants, int t) {
  if (t < 2 || t >= static_cast<int>(instants.size()) - 1) return 0.0;
  const auto i = static_cast<std::size_t>(t);
  return 0.5 * problem.change_weight.cwiseProduct(instants[i].force - instants[i - 1].force)
                   .squaredNorm();
}

}  // namespace counterpoint::estimation
