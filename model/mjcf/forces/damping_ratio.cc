#include "counterpoint/model/mjcf/forces/damping_ratio.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "counterpoint/model/mjcf/bodies/reference_model.h"

namespace counterpoint::mjcf {

void apply_damping_ratios(const std::vector<DampingRatio>& ratios, MjcfModel& model) {
  if (ratios.empty()) return;
  const Model built = reference_model(model);
  VectorX diagonal = VectorX::Zero(built.nv());
  for (int t = 0; t < built.num_trees(); ++t) {
    const Tree& tree = built.trees()[t];
    diagonal.segment(tree.v_begin, tree.v_end - tree.v_begin) =
        reference_mass_matrix(built, t, built.default_q()).diagonal();
  }
  for (const DampingRatio& r : ratios) {
    JointSpec& joint = model.robot.joints[r.joint];
    const std::string& driven = model.robot.joints[r.driven].name;
    const double inertia = diagonal[built.body(built.find_joint(driven) + 1).v_index];
    const double damping = 2.0 * r.ratio * std::sqrt(std::max(r.stiffness, 0.0) * inertia) /
                           std::abs(r.gear) * r.lever * r.lever;
    joint.servo.damping += damping;
    model.actuators[r.actuator].damping += damping;
  }
}

void apply_spring_dampers(const Bodies& bodies, MjcfModel& model) {
  const auto given = [](const Joint& joint) { return joint.spring_damper.has_value(); };
  if (std::none_of(bodies.joints.begin(), bodies.joints.end(), given)) return;
  const Model built = reference_model(model);
  for (const Joint& joint : bodies.joints) {
    if (!joint.spring_damper) continue;
    JointSpec& spec = model.robot.joints[static_cast<std::size_t>(joint.spec)];
    if (joint_nv(spec.type) != 1) continue;
    const Body& body = built.body(built.find_joint(spec.name) + 1);
    const MatrixX M = reference_mass_matrix(built, body.tree, built.default_q());
    const auto k = body.v_index - built.trees()[static_cast<std::size_t>(body.tree)].v_begin;
    const double inertia = 1.0 / M.llt().solve(VectorX::Unit(M.rows(), k))[k];
    const auto& [time, ratio] = *joint.spring_damper;
    spec.stiffness = inertia / (time * time * ratio * ratio);
    spec.damping = 2.0 * inertia / time;
  }
}

}  // namespace counterpoint::mjcf
