#include "counterpoint/engine/estimate/motion/force_scales.h"

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
  constexpr double kStep = 1e-4;  // scales are of second degree in the inertias: any step is exact
  MatrixX out = MatrixX::Zero(model.nv(), static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k].kind != StepParameterKind::kInertia) continue;
    Model ahead = model, back = model;
    SimulationOptions unused;
    change_parameter(parameters[k], kStep, ahead, unused);
    change_parameter(parameters[k], -kStep, back, unused);
    out.col(static_cast<Eigen::Index>(k)) =
        (force_scales(ahead) - force_scales(back)).cwiseQuotient(scales) / (2.0 * kStep);
  }
  return out;
}

}  // namespace counterpoint::estimation
