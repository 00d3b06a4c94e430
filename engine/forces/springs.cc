#include <algorithm>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/forces/tendons.h"

namespace counterpoint {

void add_springs(const Model& model, double h, const VectorRef& q, const VectorRef& w,
                 VectorOut diagonal, VectorOut tau) {
  for (const JointSpring& spring : model.springs()) {
    const Body& body = model.body(spring.joint + 1);
    const int k = body.v_index;
    diagonal[k] += h * h * spring.stiffness;
    tau[k] -= spring.stiffness * (q[body.q_index] + h * w[k] - spring.reference);
  }
}

void add_springs_inverse(const Model& model, double h, const VectorRef& q, const VectorRef& w_next,
                         VectorOut tau) {
  for (const JointSpring& spring : model.springs()) {
    const Body& body = model.body(spring.joint + 1);
    const int k = body.v_index;
    tau[k] += spring.stiffness * (q[body.q_index] + h * w_next[k] - spring.reference);
  }
}

double spring_energy(const Model& model, const VectorRef& q, const VectorRef& given) {
  double energy = 0.0;
  for (const JointSpring& spring : model.springs()) {
    const double stretch = q[model.body(spring.joint + 1).q_index] - spring.reference;
    energy += 0.5 * spring.stiffness * stretch * stretch;
  }
  const auto has_spring = [](const Closure& c) { return c.linear.acts || c.angular.acts; };
  if (model.tendons().empty() &&
      std::none_of(model.closures().begin(), model.closures().end(), has_spring))
    return energy;
  const std::vector<Pose> X_WB = body_poses(model, q);
  energy += tendon_energy(model, q, X_WB);
  const VectorRef z = given.size() > 0 ? given : VectorRef(model.default_z());
  for (const Closure& closure : model.closures()) energy += spring_energy(closure, X_WB, z);
  return energy;
}

}  // namespace counterpoint
