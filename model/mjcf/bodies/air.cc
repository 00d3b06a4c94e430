#include <fmt/format.h>
#include <tinyxml2.h>

#include <cmath>
#include <numbers>

#include "counterpoint/model/mjcf/bodies/bodies.h"
#include "counterpoint/model/model.h"

namespace counterpoint::mjcf {
namespace {

constexpr double kLeastMass = 1e-15;  // [kg]; lighter bodies feel no air in MuJoCo either

/// Side lengths [m] of the box of uniform density with this mass [kg] and these principal moments
/// [kg m^2].
Vector3 equivalent_box(double mass, const Vector3& moments) {
  const double sum = moments.sum();
  return (6.0 / mass * (Vector3::Constant(sum) - 2.0 * moments).cwiseMax(0.0)).cwiseSqrt();
}

/// Drag of the box in air (MuJoCo, Computation, "Inertia model"). Viscosity: that of a sphere
/// whose diameter d is the mean side length, force -3 pi d mu v, torque -pi d^3 mu omega. Density,
/// along each principal axis i: force -rho/2 b_j b_k |v_i| v_i, torque -rho/64 b_i (b_j^4 + b_k^4)
/// |omega_i| omega_i. `Drag` has one coefficient c for all directions: the least-squares fit to the
/// c_i over all directions n, c = sum c_i mean(|n_i|^3) = sum c_i / 4.
Drag drag_in_air(const Vector3& box, double density, double viscosity) {
  const double d = box.mean(), pi = std::numbers::pi;
  const Vector3 fourth = box.array().square().square();
  Drag drag;
  drag.linear = 3.0 * pi * d * viscosity;
  drag.angular = pi * d * d * d * viscosity;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    drag.quadratic += density / 8.0 * box[j] * box[k];
    drag.angular_quadratic += density / 256.0 * box[i] * (fourth[j] + fourth[k]);
  }
  return drag;
}

}  // namespace

void read_air(Document& document, const Bodies& bodies, MjcfModel& model) {
  if (!(model.air_density > 0.0) && !(model.air_viscosity > 0.0)) return;
  for (const Geom& geom : bodies.geoms) {
    if (geom.ellipsoid_in_fluid)
      document.refuse(*geom.element, LeaveOut::kFluid,
                      "fluidshape=\"ellipsoid\" is not supported: lift and added mass");
  }
  for (std::size_t i = 1; i < bodies.bodies.size(); ++i) {
    const BodyNode& node = bodies.bodies[i];
    LinkSpec& link = model.robot.links[node.link_index];
    if (node.weld == 0 || link.inertia.mass < kLeastMass) continue;
    const Vector3 moments = principal_axes(link.inertia.rotational).moments;
    link.drag = drag_in_air(equivalent_box(link.inertia.mass, moments), model.air_density,
                            model.air_viscosity);
  }
  if (model.air_density > 0.0)
    document.notes.push_back(
        {document.file().string(),
         fmt::format("<option density=\"{}\">: the air's drag is the same in all directions; the "
                     "nearest, in the mean square, to that of MuJoCo's box of each body",
                     model.air_density)});
}

}  // namespace counterpoint::mjcf
