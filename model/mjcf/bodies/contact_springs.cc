#include "counterpoint/model/mjcf/bodies/contact_springs.h"

#include <algorithm>
#include <cmath>

namespace counterpoint::mjcf {
namespace {

constexpr double kLeastNumber = 1e-15;    // below it MuJoCo takes a number for zero
constexpr double kLeastFriction = 1e-5;   // MuJoCo's least coefficient of a contact [-]
constexpr double kLeastImpedance = 1e-4;  // bounds of MuJoCo's impedances [-]
constexpr double kMostImpedance = 0.9999;

/// Returns the normal stiffness of a friction pyramid over that of a cone: the 2 (condim - 1)
/// edges of a pyramid carry the normal force together, each with the regularizer 2 mu^2 (1 +
/// friction^2) of the cone's, mu^2 = friction^2 / impratio.
double pyramid_share(double friction, double impratio, int dimensions) {
  const double f2 = std::pow(std::max(friction, kLeastFriction), 2);
  return (dimensions - 1) * impratio / (f2 * (1.0 + f2));
}

}  // namespace

ContactParameters combined(const ContactParameters& a, const ContactParameters& b) {
  const bool has_a = a.solmix >= kLeastNumber, has_b = b.solmix >= kLeastNumber;
  const double share = has_a && has_b   ? a.solmix / (a.solmix + b.solmix)
                       : has_a == has_b ? 0.5
                       : has_a          ? 1.0
                                        : 0.0;
  ContactParameters both;
  both.condim = std::max(a.condim, b.condim);
  both.slide = std::max(a.slide, b.slide);
  both.spin = std::max(a.spin, b.spin);
  both.roll = std::max(a.roll, b.roll);
  both.solref = a.solref[0] > 0.0 && b.solref[0] > 0.0
                    ? Eigen::Vector2d(share * a.solref + (1.0 - share) * b.solref)
                    : Eigen::Vector2d(a.solref.cwiseMin(b.solref));
  both.solimp = share * a.solimp + (1.0 - share) * b.solimp;
  return both;
}

// MuJoCo's force of a contact with the gap r and its velocity v is f = (-b v - k d r - a) / R with
// R = (1 - d) w / d. For solref = (-s, -c) it has k = s / D^2 and b = c / D; d is the impedance at
// r, D that at the width of solimp and w the sum of the bodies' inverse masses (MuJoCo
// documentation, "Computation", Constraint model). Without the acceleration a this is a spring and
// a damper.
Material ContactSprings::between(int body_a, int body_b, const ContactParameters& contact) {
  Material surface = contact.hard();
  if (!contact.is_spring()) return surface;
  const auto bounded = [](double x) { return std::clamp(x, kLeastImpedance, kMostImpedance); };
  const double at_surface = bounded(contact.solimp[0]), at_width = bounded(contact.solimp[1]);
  const double d = contact.solimp[2] > kLeastNumber ? at_width : 0.5 * (at_surface + at_width);
  const double ratio = d / at_width;
  const double share = contact.condim == 1 || switches_.elliptic
                           ? 1.0
                           : pyramid_share(contact.slide, switches_.impratio, contact.condim);
  const double mobility = (1.0 - d) * (inverse_mass_of(body_a) + inverse_mass_of(body_b)) / share;
  const double stiffness = -contact.solref[0] * ratio * ratio / mobility;
  if (!is_spring(stiffness)) return surface;
  surface.stiffness = stiffness;
  surface.damping = -contact.solref[1] * ratio / mobility;
  return surface;
}

double ContactSprings::inverse_mass_of(int body) {
  const BodyNode& node = bodies_.bodies[body];
  if (node.weld == 0) return 0.0;
  double& known = known_[body];
  if (known >= 0.0) return known;
  if (!inverse_masses_) inverse_masses_.emplace(model_);
  known = std::max(0.0, inverse_masses_->of(model_.robot.links[node.link_index]));
  return known;
}

}  // namespace counterpoint::mjcf
