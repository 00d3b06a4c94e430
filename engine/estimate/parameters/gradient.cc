#include "counterpoint/engine/estimate/parameters/gradient.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/bounce.h"
#include "counterpoint/engine/derivatives/dynamics/right_jacobian.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/parameters/step_parameters.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::estimation {
namespace {

using K = ParameterKind;
using S = StepParameterKind;

bool any_floating(const Model& model) {
  return std::any_of(model.bodies().begin(), model.bodies().end(), [](const Body& body) {
    return body.tree >= 0 && body.joint_type == JointType::kFloating;
  });
}

/// The parameters that steps can differentiate, and their columns in the full Jacobian.
struct Known {
  std::vector<StepParameter> parameters;
  std::vector<Eigen::Index> column;
};

Known known_parameters(const Experiment& experiment, const std::vector<Parameter>& parameters,
                       const VectorX& values, bool by_force) {
  const std::vector<char> exact = exact_parameters(experiment, parameters, by_force);
  Known out;
  for (size_t i = 0; i < parameters.size(); ++i) {
    if (!exact[i]) continue;
    out.parameters.push_back(step_parameter(parameters, i, values, experiment.scene.model));
    out.column.push_back(static_cast<Eigen::Index>(i));
  }
  return out;
}

/// Propagates the derivatives of the predicted state with respect to the parameters, step by step.
class Sensitivity final : public PredictionWatch {
 public:
  Sensitivity(const Experiment& experiment, const Model& model, const Known& known)
      : experiment_(experiment),
        model_(model),
        known_(known),
        workspace_(model),
        derivator_(model, known.parameters),
        by_row_(row_weights(experiment)) {}

  /// Writes into J from now on; the recording to be predicted has `rows` rows.
  void begin(int rows, MatrixX& J) {
    J_ = &J;
    rows_ = rows;
  }

  void start(const Recording& recording, int row) override {
    const auto count = static_cast<Eigen::Index>(known_.parameters.size());
    dq_ = dv_ = MatrixX::Zero(model_.nv(), count);
    if (!experiment_.map.backward_difference) return;
    // recorded_state adds g interval / 2 to the velocity of floating links.
    const double interval = row_interval(experiment_.map, recording, std::max(row - 1, 0));
    const std::vector<Vector3> fall = free_fall(model_);
    for (Eigen::Index k = 0; k < count; ++k) {
      if (known_.parameters[static_cast<size_t>(k)].kind != S::kGravity) continue;
      for (int b = 1; b < model_.num_bodies(); ++b)
        if (model_.body(b).joint_type == JointType::kFloating)
          dv_.col(k).segment<3>(model_.body(b).v_index) =
              0.5 * interval * fall[static_cast<size_t>(b)] / model_.gravity().norm();
    }
  }

  void step(const SimulationOptions& options, const State& before, const Input& input,
            const State& after) override {
    const bool regular =
        step_forward_derivatives(model_, options, before.q, before.v, after.q, after.v, input,
                                 workspace_, inverse_, exact_, forward_);
    if (!regular) return;  // keep the derivatives of the last state: nothing better is known
    derivator_.inverse(model_, options, before.q, before.v, after.v, input, workspace_, inverse_,
                       by_parameter_);
    forward_parameter_derivatives(forward_, by_parameter_.du, v_next_, q_next_);
    q_next_ += forward_.dq_dq * dq_ + forward_.dq_dv * dv_;
    v_next_ += forward_.dv_dq * dq_ + forward_.dv_dv * dv_;
    dq_.swap(q_next_);
    dv_.swap(v_next_);
  }

  void row(const Recording& recording, int row, const State& state) override {
    VectorX difference(model_.nv());
    recorded_difference(model_, recording.q.col(row), state.q, difference);
    turned_ = dq_;
    for (int i = 1; i < model_.num_bodies(); ++i) {
      const Body& body = model_.body(i);
      if (joint_nq(body.joint_type) == joint_nv(body.joint_type)) continue;
      const int k = body.v_index + joint_num_linear(body.joint_type);
      turned_.middleRows<3>(k) =
          right_jacobian(difference.segment<3>(k)).inverse() * dq_.middleRows<3>(k);
    }
    if (experiment_.by_score) {
      add_score(difference);
    } else {
      add_row(row - 1);
    }
  }

 private:
  void put(Eigen::Index row, const Eigen::RowVectorXd& values) {
    for (size_t k = 0; k < known_.column.size(); ++k)
      (*J_)(row, known_.column[k]) += values[static_cast<Eigen::Index>(k)];
  }

  /// Adds a row's weighted deviations, over the root of the number of rows.
  void add_row(int row) {
    const auto used = static_cast<Eigen::Index>(by_row_.used.size());
    const double share = 1.0 / std::sqrt(static_cast<double>(rows_));
    for (Eigen::Index i = 0; i < used; ++i) {
      const Eigen::Index k = by_row_.used[static_cast<size_t>(i)];
      put(row * used + i, share * by_row_.by_coordinate[k] * turned_.row(k));
    }
  }

  /// Adds a row's contribution to the mean deviations (Deviation).
  void add_score(const VectorX& difference) {
    const double share = 1.0 / rows_;
    if (experiment_.map.free_body >= 0) {
      const int k = model_.body(experiment_.map.free_body).v_index;
      for (int part = 0; part < 2; ++part) {
        const Vector3 d = difference.segment<3>(k + 3 * part);
        const double length = d.norm(), scale = part == 0 ? share : share * by_row_.turning;
        if (length > 0.0)
          put(part, scale / length * d.transpose() * turned_.middleRows<3>(k + 3 * part));
      }
      return;
    }
    const auto joints = static_cast<double>(by_row_.used.size());
    for (const Eigen::Index k : by_row_.used)
      put(2, (difference[k] < 0.0 ? -share : share) / joints * turned_.row(k));
  }

  const Experiment& experiment_;
  const Model& model_;
  const Known& known_;
  Workspace workspace_;
  ParameterDerivator derivator_;
  RowWeights by_row_;
  Inverse inverse_;
  InverseDerivatives exact_;
  ForwardDerivatives forward_;
  InverseParameterDerivatives by_parameter_;
  MatrixX dq_, dv_, q_next_, v_next_, turned_;
  MatrixX* J_ = nullptr;
  int rows_ = 0;
};

LinearizedResiduals of_predictions(const Experiment& experiment,
                                   const std::vector<Parameter>& parameters, const VectorX& values,
                                   const std::vector<int>& which) {
  LinearizedResiduals out;
  const RowWeights by_row = row_weights(experiment);
  const Scene scene = with_parameters(experiment.scene, parameters, values);
  Predictor predictor(scene, experiment.map, experiment.prediction);
  const Known known = known_parameters(experiment, parameters, values, false);
  Sensitivity watch(experiment, predictor.model(), known);
  for (const int i : which) {
    const Recording& recording = experiment.recordings[static_cast<size_t>(i)];
    const int rows = recording.num_rows() - 1;
    const Eigen::Index size =
        experiment.by_score ? 3 : rows * static_cast<Eigen::Index>(by_row.used.size());
    MatrixX& J = out.jacobians.emplace_back(
        MatrixX::Zero(size, static_cast<Eigen::Index>(parameters.size())));
    watch.begin(rows, J);
    out.residuals.push_back(prediction_residual(experiment, predictor.model(), recording,
                                                predictor.predict(recording, &watch), by_row));
  }
  return out;
}

std::optional<LinearizedResiduals> of_forces(const Experiment& experiment,
                                             const std::vector<Parameter>& parameters,
                                             const VectorX& values, const std::vector<int>& which) {
  const Scene scene = with_parameters(experiment.scene, parameters, values);
  Explainer explainer(scene, experiment.map, experiment.reach);
  const VectorX scales = explainer.scales();
  const Known known = known_parameters(experiment, parameters, values, true);
  ParameterDerivator derivator(scene.model, known.parameters);
  InverseParameterDerivatives d;
  LinearizedResiduals out;
  const auto& stop = experiment.prediction.stop;
  for (const int i : which) {
    const Recording& recording = experiment.recordings[static_cast<size_t>(i)];
    const int steps = recording.num_rows() - 1;
    const double share = 1.0 / std::sqrt(static_cast<double>(steps));
    VectorX& r = out.residuals.emplace_back(steps * scales.size());
    MatrixX& J = out.jacobians.emplace_back(
        MatrixX::Zero(r.size(), static_cast<Eigen::Index>(parameters.size())));
    for (int row = 0; row < steps; ++row) {
      if (stop && stop()) return std::nullopt;
      const Explanation step =
          explainer.explain(recording, row, row_interval(experiment.map, recording, row));
      if (!explainer.derive(derivator, d)) return std::nullopt;
      const Eigen::Index at = row * scales.size();
      r.segment(at, scales.size()) =
          step.force.cwiseProduct(scales) / std::sqrt(static_cast<double>(steps));
      for (size_t k = 0; k < known.column.size(); ++k)
        J.col(known.column[k]).segment(at, scales.size()) =
            share * d.du.col(static_cast<Eigen::Index>(k)).cwiseProduct(scales);
    }
  }
  return out;
}

}  // namespace

std::vector<char> exact_parameters(const Experiment& experiment,
                                   const std::vector<Parameter>& parameters, bool by_force) {
  std::vector<char> exact(parameters.size(), 0);
  const Model& model = experiment.scene.model;
  if (compared(experiment.map) == Compared::kImpacts) return exact;
  if (experiment.scene.options.integrator != Integrator::kSemiImplicitEuler) return exact;
  // Joint scores compare raw q, so quaternion joints have no exact derivative.
  if (!by_force && experiment.by_score && experiment.map.free_body < 0)
    for (const Body& body : model.bodies())
      if (body.tree >= 0 && joint_nq(body.joint_type) != joint_nv(body.joint_type)) return exact;
  for (size_t i = 0; i < parameters.size(); ++i) {
    const K kind = parameters[i].kind;
    // Forces on floating links are divided by their weight, which depends on these parameters.
    const bool weighs = by_force && (kind == K::kMass || kind == K::kGravity);
    exact[i] = step_kind(kind) && !(weighs && any_floating(model));
  }
  return exact;
}

std::optional<LinearizedResiduals> linearize(const Experiment& experiment,
                                             const std::vector<Parameter>& parameters,
                                             const VectorX& values, const std::vector<int>& which,
                                             bool by_force) {
  if (by_force) return of_forces(experiment, parameters, values, which);
  return of_predictions(experiment, parameters, values, which);
}

}  // namespace counterpoint::estimation
