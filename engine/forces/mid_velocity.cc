#include "counterpoint/engine/forces/mid_velocity.h"

#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {

// Every term of the RNEA at zero acceleration is quadratic in w; the terms below are their bilinear
// forms.
void MidVelocity::add_force(const Model& model, const VectorRef& w, const VectorRef& other,
                            const Tree& tree, Data& data) {
  for (int i = tree.body_begin; i < tree.body_end; ++i) {
    const Body& body = model.body(i);
    const Motion* axis = &data.axis[body.v_index];
    const Motion V_J = joint_motion(body.joint_type, axis, w.data() + body.v_index);
    const Motion other_J = joint_motion(body.joint_type, axis, other.data() + body.v_index);
    const Motion& V = data.V[i];
    Motion V_other = other_J, A;
    if (body.parent != 0) {
      V_other += shift(V_[body.parent], data.arm[i]);
      A = shift(data.A[body.parent], data.arm[i]) + (cross(V, other_J) + cross(V_other, V_J)) * 0.5;
    }
    if (joint_axes_turn(body.joint_type))
      A.linear -= 0.5 * (V_J.angular.cross(other_J.linear) + other_J.angular.cross(V_J.linear));
    V_[i] = V_other;
    data.A[i] = A;
    const SpatialInertia& I = data.inertia[i];
    const Force force = I * A + (cross(V, I * V_other) + cross(V_other, I * V)) * 0.5;
    if (!data.has_mean_force[i]) data.mean_force[i] = Force();
    data.mean_force[i] += force;
    data.has_mean_force[i] = 1;
  }
}

}  // namespace counterpoint
