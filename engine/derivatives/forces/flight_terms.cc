#include "counterpoint/engine/derivatives/forces/flight_terms.h"

#include <algorithm>

namespace counterpoint {

void add_flight_derivatives(const Model& model, double h, const VectorRef& v,
                            const Vector3& gravity, const FreeFlight& flight,
                            const Kinematics& data, InverseDerivatives& d) {
  for (int n = 0; n < flight.num_flyers(); ++n) {
    const int i = flight.body(n);
    const Body& body = model.body(i);
    const int linear = joint_num_linear(body.joint_type), k = body.v_index + linear;
    const Matrix3& R = data.X_WB[i].rotation;
    const Vector3 omega = v.segment<3>(k), g = R.transpose() * gravity;
    // Rows of the joint: linear along the axes of its frame, angular about axes of the body.
    const auto force = [&](const Vector3& w, const Vector3& down) {
      const Force f = flight.mean_force(model, n, h, w, down);
      Vector6 out;
      out << (linear > 0 ? Vector3(body.X_PJ.rotation.transpose() * (R * f.force))
                         : Vector3(Vector3::Zero())),
          f.torque;
      return out;
    };
    const auto slope = [&](const Vector3& dw, const Vector3& dg, double s) -> Vector6 {
      return (force(omega + s * dw, g + s * dg) - force(omega - s * dw, g - s * dg)) / (2.0 * s);
    };
    const double step = 1e-3 * std::min(1.0 / h, 1.0 + omega.norm());
    for (int j = 0; j < 3; ++j) {
      const Vector3 unit = Vector3::Unit(j), none = Vector3::Zero();
      const Vector6 by_v = (4.0 * slope(unit, none, step) - slope(unit, none, 2.0 * step)) / 3.0;
      d.dv.block(body.v_index, k + j, linear + 3, 1) += by_v.tail(linear + 3);
      if (linear > 0 || gravity.isZero(0.0)) continue;
      const Vector3 turned = g.cross(unit);
      const Vector6 by_q = (4.0 * slope(none, turned, 1e-2) - slope(none, turned, 2e-2)) / 3.0;
      d.dq.block<3, 1>(k, k + j) += by_q.tail<3>();
    }
  }
}

}  // namespace counterpoint
