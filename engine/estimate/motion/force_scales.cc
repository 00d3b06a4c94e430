#include "counterpoint/engine/estimate/motion/force_scales.h"

#include <algorithm>
#include <cmath>

namespace counterpoint::estimation {

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

MatrixX force_scale_slopes(const std::vector<StepParameter>& parameters, const Model& model,
                           const VectorX& scales) {
  // Scales are of second degree in the inertias, so that any step is exact; masses stay positive.
  constexpr double kStep = 1e-4, kShare = 1e-3;
  MatrixX out = MatrixX::Zero(model.nv(), static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k].kind != StepParameterKind::kInertia) continue;
    double step = kStep;
    for (std::size_t i = 0; i < parameters[k].targets.size(); ++i)
      if (const double by = std::abs(parameters[k].changes[i][0]); by > 0.0)
        step = std::min(step, kShare * model.body(parameters[k].targets[i]).inertia.mass / by);
    Model ahead = model, back = model;
    SimulationOptions unused;
    change_parameter(parameters[k], step, ahead, unused);
    change_parameter(parameters[k], -step, back, unused);
    out.col(static_cast<Eigen::Index>(k)) =
        (force_scales(ahead) - force_scales(back)).cwiseQuotient(scales) / (2.0 * step);
  }
  return out;
}

}  // namespace counterpoint::estimation
