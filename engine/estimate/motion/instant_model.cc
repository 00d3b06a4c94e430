#include "counterpoint/engine/estimate/motion/instant_model.h"

#include <array>
#include <optional>

#include "counterpoint/model/special_values.h"

namespace counterpoint::estimation {
namespace {

using optimization::TangentMap;

/// rho of residuals r over their deviations, and the weights that it gives their squares.
double loss(const VectorX& r, double scale) {
  if (scale <= 0.0) return 0.5 * r.squaredNorm();
  return 0.5 * scale * scale * (r.array() / scale).square().log1p().sum();
}
VectorX loss_weight(const VectorX& r, double scale) {
  if (scale <= 0.0) return VectorX::Ones(r.size());
  return (1.0 + (r.array() / scale).square()).inverse();
}

/// out += a' diag(weight) b.
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

/// out += map' x.
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

/// What unexplained forces of free links are in proportion to, by coordinate: mass of the tree, and
/// its bodies' rotational inertia; 1 for all others. Else a lighter body would explain everything.
VectorX force_scales(const Model& model) {
  VectorX out = VectorX::Ones(model.nv());
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (body.joint_type != JointType::kFloating) continue;
    const Tree& tree = model.trees()[static_cast<std::size_t>(body.tree)];
    double mass = 0.0, trace = 0.0;
    for (int b = tree.body_begin; b < tree.body_end; ++b) {
      mass += model.body(b).inertia.mass;
      trace += model.body(b).inertia.rotational.trace();
    }
    out.segment<3>(body.v_index).setConstant(mass);
    out.segment<3>(body.v_index + 3).setConstant(trace);
  }
  return out;
}

/// nv x parameters: derivatives of their logarithms. Scales are linear in inertias.
MatrixX scale_slopes(const MotionProblem& problem, const Model& model, const VectorX& scales) {
  constexpr double kStep = 1e-4;
  MatrixX out = MatrixX::Zero(model.nv(), static_cast<Eigen::Index>(problem.parameters.size()));
  for (std::size_t k = 0; k < problem.parameters.size(); ++k) {
    if (problem.parameters[k].kind != StepParameterKind::kInertia) continue;
    Model moved = model;
    SimulationOptions unused = problem.options;
    change_parameter(problem.parameters[k], kStep, moved, unused);
    out.col(static_cast<Eigen::Index>(k)) =
        (force_scales(moved) - scales).cwiseQuotient(scales) / kStep;
  }
  return out;
}

bool any(const VectorX& weight) { return weight.size() > 0 && weight.maxCoeff() > 0.0; }

}  // namespace

struct InstantModel::Impl {
  Impl(const MotionProblem& of, const Model& changed)
      : problem(of),
        model(changed),
        rotations(optimization::rotation_starts(changed)),
        workspace(changed) {
    for (VectorX* x : {&v, &w, &difference}) x->resize(model.nv());
    if (!problem.parameters.empty()) derivator.emplace(model, problem.parameters);
    size_weight = problem.size_weight;
    if (!problem.parameters.empty()) {
      const VectorX scales = force_scales(model);
      size_weight = size_weight.cwiseProduct(force_scales(problem.model)).cwiseQuotient(scales);
      slopes = scale_slopes(problem, model, scales);
    }
    force_weight2 = problem.force_weight.cwiseAbs2();
  }

  int last() const { return problem.frames() - 1; }

  /// Velocities before and after frame t; `maps`: also how they go with the frames.
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

  /// How the acceleration (w - v) / h goes with the three frames; needs the maps of velocities.
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
    return loss(difference.cwiseProduct(problem.position_weight.col(t)), problem.loss_scale);
  }

  double step_cost(int t, const VectorX& u) const {
    double sum = loss(u.cwiseProduct(size_weight), problem.force_loss_scale);
    if (any(force_weight2)) sum += 0.5 * force_weight2.dot((u - problem.force.col(t)).cwiseAbs2());
    if (any(problem.acceleration_weight))
      sum += loss(acceleration_residual(t).cwiseProduct(problem.acceleration_weight),
                  problem.loss_scale);
    return sum;
  }

  void add_measurement(const MotionPoint& point, int t, InstantEquations& out) {
    const int nv = model.nv();
    const auto i = static_cast<std::size_t>(t);
    configuration_difference(model, problem.measured[i], point.q[i], difference);
    optimization::differentiate_difference(difference, rotations, v_by[0], v_by[1]);
    const VectorX own = problem.position_weight.col(t);
    const VectorX weight = own.cwiseAbs2().cwiseProduct(
        loss_weight(difference.cwiseProduct(own), problem.loss_scale));
    add_map_product(v_by[1], weight, v_by[1], rotations,
                    out.gram.block(2 * nv, 2 * nv, nv, nv));
    add_transposed(v_by[1], weight.cwiseProduct(difference), rotations,
                   out.gradient.segment(2 * nv, nv));
  }

  void add_acceleration(int t, InstantEquations& out) {
    const int nv = model.nv();
    set_acceleration_maps();
    const VectorX residual = acceleration_residual(t), own = problem.acceleration_weight;
    const VectorX weight2 = own.cwiseAbs2().cwiseProduct(
        loss_weight(residual.cwiseProduct(own), problem.loss_scale));
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

  /// Rows J (by the frames from `first` of four on) and P (by parameters), and residuals, weighted.
  void add_rows(int first, const MatrixX& J, const VectorX& residual, const MatrixX& P,
                InstantEquations& out) const {
    const int at = first * model.nv();
    const Eigen::Index size = J.cols();
    out.gram.block(at, at, size, size)
        .selfadjointView<Eigen::Lower>()
        .rankUpdate(J.transpose());
    out.gradient.segment(at, size).noalias() += J.transpose() * residual;
    if (P.cols() == 0) return;
    out.border.middleRows(at, size).noalias() += J.transpose() * P;
    out.corner.noalias() += P.transpose() * P;
    out.corner_gradient.noalias() += P.transpose() * residual;
  }

  /// Sizes of the force.
  void add_size(const Instant& instant, InstantEquations& out) {
    const VectorX size = instant.force.cwiseProduct(size_weight);
    const VectorX share = loss_weight(size, problem.force_loss_scale).cwiseSqrt();
    const VectorX weight = size_weight.cwiseProduct(share), residual = size.cwiseProduct(share);
    rows.noalias() = weight.asDiagonal() * instant.by_frames;
    by_parameters.noalias() = weight.asDiagonal() * instant.by_parameters;
    if (slopes.size() > 0) by_parameters -= residual.asDiagonal() * slopes;
    add_rows(1, rows, residual, by_parameters, out);
  }

  /// How far the force is from a measured one.
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
    add_rows(0, change, problem.change_weight.cwiseProduct(at.force - before.force),
             by_parameters, out);
  }

  const MotionProblem& problem;
  const Model& model;
  std::vector<int> rotations;
  Workspace workspace;
  std::optional<ParameterDerivator> derivator;
  Inverse inverse;
  InverseDerivatives d;
  InverseParameterDerivatives d_parameters;
  VectorX v, w, difference, size_weight, force_weight2;
  MatrixX slopes;  ///< nv x parameters: of the logarithms of what size_weight goes with
  std::array<TangentMap, 2> v_by, w_by;  ///< velocities by the frames before and behind them
  std::array<TangentMap, 3> a_by;        ///< acceleration by its three frames
  MatrixX rows, change, by_parameters;
};

InstantModel::InstantModel(const MotionProblem& problem, const Model& model)
    : impl_(std::make_unique<Impl>(problem, model)) {}
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
  out.cost = p.measurement_cost(point, t);
  if (t == 0 || t == p.last()) return;
  const Inverse& inverse = invert(point, options, t);
  out.force = inverse.applied_force;
  out.cost = inverse.fault.any() ? kInfinity : out.cost + p.step_cost(t, out.force);
}

void InstantModel::differentiate(const MotionPoint& point, const SimulationOptions& options, int t,
                                 bool parameters, Instant& out) {
  Impl& p = *impl_;
  if (t == 0 || t == p.last()) return;
  const int nv = p.model.nv();
  const VectorX& q = point.q[static_cast<std::size_t>(t)];
  p.set_velocities(point, t, true);
  if (parameters && p.derivator) {
    p.derivator->inverse(p.model, options, q, p.v, p.w, Input(), p.workspace, p.inverse,
                         p.d_parameters);
    out.by_parameters = p.d_parameters.du;
  } else {
    out.by_parameters.setZero(nv, static_cast<Eigen::Index>(p.problem.parameters.size()));
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
}

void InstantModel::assemble(const MotionPoint& point, const std::vector<Instant>& instants, int t,
                            InstantEquations& out) {
  Impl& p = *impl_;
  const Instant& at = instants[static_cast<std::size_t>(t)];
  out.set_zero(p.model.nv(), static_cast<int>(p.problem.parameters.size()));
  p.add_measurement(point, t, out);
  if (t == 0 || t == p.last()) return;
  if (any(p.problem.acceleration_weight)) {
    p.set_velocities(point, t, true);
    p.add_acceleration(t, out);
  }
  p.add_size(at, out);
  if (any(p.force_weight2)) p.add_measured_force(at, t, out);
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
