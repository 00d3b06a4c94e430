#include <algorithm>
#include <cmath>
#include <numbers>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/engine/estimate/parameters/gradient.h"

namespace counterpoint::estimation {
namespace {

/// Upper bound of the distance from a body's origin to the farthest point of its geometry [m].
double reach(const Model& model, int body) {
  double farthest = 0.0;
  for (const Geometry& g : model.geometries()) {
    if (g.body != body) continue;
    const Shape& shape = g.shape;
    double radius = 0.0;
    switch (shape.type) {
      case ShapeType::kSphere:
        radius = shape.size[0];
        break;
      case ShapeType::kBox:
        radius = shape.size.norm();
        break;
      case ShapeType::kCapsule:
        radius = shape.size[0] + shape.size[1];
        break;
      case ShapeType::kCylinder:
        radius = std::hypot(shape.size[0], shape.size[1]);
        break;
      case ShapeType::kConvexMesh:
        radius = shape.mesh->interior_point.norm() + shape.mesh->radius;
        break;
      case ShapeType::kPlane:
      case ShapeType::kTerrain:
        break;
    }
    farthest = std::max(farthest, g.X_BG.translation.norm() + radius);
  }
  return farthest;
}

/// Score of a recording as residuals [m] or [rad]; missing rows count one unit. turning: lever arm
/// of rotations [m].
VectorX score_residual(const Prediction& p, int rows, double turning) {
  Deviation sum;
  for (const Deviation& d : p.deviations) sum += d;
  const auto left_out = static_cast<double>(rows) - static_cast<double>(p.deviations.size());
  constexpr double kDegree = std::numbers::pi / 180.0;
  return Eigen::Vector3d(sum.position + left_out, turning * kDegree * sum.rotation + left_out,
                         sum.joints + left_out) /
         rows;
}

}  // namespace

std::vector<Prediction> predict_all(const Experiment& experiment, const Scene& scene,
                                    const std::vector<int>& which) {
  Predictor predictor(scene, experiment.map, experiment.prediction);
  std::vector<Prediction> out;
  for (const int i : which) out.push_back(predictor.predict(experiment.recordings[i]));
  return out;
}

VectorX deviation_weights(const Model& model, const ColumnMap& map) {
  VectorX weights = VectorX::Zero(model.nv());
  if (map.free_body >= 0) {
    const Body& body = model.body(map.free_body);
    const double length = reach(model, map.free_body);
    weights.segment<3>(body.v_index).setOnes();
    weights.segment<3>(body.v_index + 3).setConstant(length > 0.0 ? length : 1.0);
    return weights;
  }
  for (const ColumnMap::Entry& entry : map.entries) {
    if (entry.kind != ColumnMap::Entry::Kind::kPosition) continue;
    for (int i = 1; i < model.num_bodies(); ++i) {
      const Body& body = model.body(i);
      const int k = entry.index - body.q_index;
      if (k < 0 || k >= joint_nq(body.joint_type)) continue;
      // A mapped quaternion component selects all three rotational coordinates.
      const int turns = joint_nv(body.joint_type);
      weights[body.v_index + std::min(k, turns - 1)] = 1.0;
      if (joint_nq(body.joint_type) > turns) weights.segment<3>(body.v_index + turns - 3).setOnes();
    }
  }
  return weights;
}

RowWeights row_weights(const Experiment& experiment) {
  RowWeights out;
  const Model& model = experiment.scene.model;
  out.by_coordinate = deviation_weights(model, experiment.map);
  for (Eigen::Index i = 0; i < out.by_coordinate.size(); ++i)
    if (out.by_coordinate[i] > 0.0) out.used.push_back(i);
  if (experiment.map.free_body >= 0)
    out.turning = out.by_coordinate[model.body(experiment.map.free_body).v_index + 3];
  return out;
}

VectorX prediction_residual(const Experiment& experiment, const Model& model,
                            const Recording& recording, const Prediction& p,
                            const RowWeights& by_row) {
  if (p.impact)
    return experiment.by_score ? VectorX(VectorX::Constant(1, p.impact->speed))
                               : p.impact->weighted;
  const int rows = recording.num_rows() - 1;
  if (experiment.by_score) return score_residual(p, rows, by_row.turning);
  const auto used = static_cast<Eigen::Index>(by_row.used.size());
  const double share = 1.0 / std::sqrt(static_cast<double>(rows));
  const auto predicted = static_cast<int>(p.deviations.size());
  VectorX difference(model.nv()), r(rows * used);
  for (int row = 0; row < rows; ++row) {
    if (row < predicted)
      recorded_difference(model, recording.q.col(row + 1), p.q.col(row + 1), difference);
    for (Eigen::Index i = 0; i < used; ++i) {
      const Eigen::Index k = by_row.used[static_cast<size_t>(i)];
      r[row * used + i] = share * (row < predicted ? by_row.by_coordinate[k] * difference[k] : 1.0);
    }
  }
  return r;
}

GroupedResiduals prediction_residuals(const Experiment& experiment,
                                      const std::vector<Parameter>& parameters,
                                      const VectorX& values, const std::vector<int>& which) {
  const RowWeights by_row = row_weights(experiment);
  Predictor predictor(with_parameters(experiment.scene, parameters, values), experiment.map,
                      experiment.prediction);
  GroupedResiduals out;
  for (const int i : which) {
    const Recording& recording = experiment.recordings[i];
    out.push_back(prediction_residual(experiment, predictor.model(), recording,
                                      predictor.predict(recording), by_row));
  }
  return out;
}

GroupedResiduals force_residuals(const Experiment& experiment,
                                 const std::vector<Parameter>& parameters, const VectorX& values,
                                 const std::vector<int>& which) {
  Explainer explainer(with_parameters(experiment.scene, parameters, values), experiment.map,
                      experiment.reach);
  const VectorX scales = explainer.scales();
  GroupedResiduals out;
  const auto& stop = experiment.prediction.stop;
  for (const int i : which) {
    const Recording& recording = experiment.recordings[i];
    const int steps = recording.num_rows() - 1;
    VectorX& r = out.emplace_back(VectorX::Zero(steps * scales.size()));
    for (int row = 0; row < steps && !(stop && stop()); ++row) {
      const Explanation step =
          explainer.explain(recording, row, row_interval(experiment.map, recording, row));
      r.segment(row * scales.size(), scales.size()) =
          step.force.cwiseProduct(scales) / std::sqrt(static_cast<double>(steps));
    }
  }
  return out;
}

FitProblem fit_problem(const Experiment& experiment, const std::vector<Parameter>& parameters,
                       const std::vector<int>& which, bool by_force) {
  FitProblem problem;
  const auto count = static_cast<Eigen::Index>(parameters.size());
  problem.start = parameter_values(parameters, experiment.scene);
  problem.lower.resize(count);
  problem.upper.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Parameter& p = parameters[static_cast<size_t>(i)];
    if (p.kind == ParameterKind::kForceOffset || p.kind == ParameterKind::kForceGain ||
        p.kind == ParameterKind::kForceDelay)
      throw InputError("parameter '" + p.name +
                       "': it belongs to a recorded force; use the objective torque");
    if (p.deviation)
      throw InputError("parameter '" + p.name +
                       "': this objective has no model of the noise to weigh a prior against; use "
                       "the objective torque or explain");
    problem.lower[i] = parameters[i].lower;
    problem.upper[i] = parameters[i].upper;
    problem.logarithmic.push_back(parameters[i].logarithmic);
  }
  problem.residuals = [&experiment, &parameters, &which, by_force](const VectorX& values) {
    return by_force ? force_residuals(experiment, parameters, values, which)
                    : prediction_residuals(experiment, parameters, values, which);
  };
  problem.rough = !by_force;
  problem.exact = exact_parameters(experiment, parameters, by_force);
  if (std::find(problem.exact.begin(), problem.exact.end(), 1) != problem.exact.end()) {
    problem.linearize = [&experiment, &parameters, &which, by_force](const VectorX& values) {
      return linearize(experiment, parameters, values, which, by_force);
    };
  }
  return problem;
}

std::vector<CoordinateMetrics> unexplained_metrics(const Experiment& experiment, const Scene& scene,
                                                   const std::vector<int>& which) {
  Explainer explainer(scene, experiment.map, experiment.reach);
  std::vector<const Recording*> recordings;
  std::vector<ExplainedRecording> explained;
  for (const int i : which) {
    recordings.push_back(&experiment.recordings[i]);
    explained.push_back(explain_recording(explainer, experiment.map, *recordings.back(),
                                          experiment.prediction.stop));
  }
  return force_metrics(explainer, scene.model, recordings, explained);
}

}  // namespace counterpoint::estimation
