#include "counterpoint/model/mjcf/forces/damping_ratio.h"

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
    const double inertia = diagonal[built.body(built.find_joint(joint.name) + 1).v_index];
    const double lever2 = r.lever * r.lever;
    const double damping =
        2.0 * r.ratio * std::sqrt(std::max(r.stiffness, 0.0) * inertia / lever2) * lever2;
    joint.servo.damping += damping;
    model.actuators[r.actuator].damping += damping;
  }
}

}  // namespace counterpoint::mjcf
