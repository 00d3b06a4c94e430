#include "counterpoint/model/sdf/joints.h"

#include <fmt/format.h>

#include <sdf/JointAxis.hh>

namespace counterpoint::sdf_file {
namespace {

/// Limits of this magnitude or more are infinite (SDF specification).
constexpr double kNoLimit = 1e16;

/// Effort or velocity limit, infinite if not positive. Many files give 0 because the value is
/// unknown; enforced, it would leave the joint limp, or locked.
double bound(Document& document, double value, const char* what, const sdf::ElementPtr& element) {
  if (value > 0.0) return value;
  if (value == 0.0)
    document.note(element,
                  fmt::format("{0} limit 0 counts as not given; a scene may give {0}_limit", what));
  return std::numeric_limits<double>::infinity();
}

JointSpec read_axis(Document& document, const sdf::Joint& joint, unsigned number, JointType type,
                    bool limited) {
  const sdf::ElementPtr element = joint.Element();
  const sdf::JointAxis* axis = joint.Axis(number);
  if (axis == nullptr)
    document.fail(element, fmt::format("<{}> is expected", number == 0 ? "axis" : "axis2"));
  JointSpec spec;
  spec.type = type;
  ignition::math::Vector3d direction;
  document.check(axis->ResolveXyz(direction), element);
  spec.axis = to_vector(direction);
  if (!(spec.axis.norm() > 1e-10) || !spec.axis.allFinite())
    document.fail(element, "xyz: a direction cannot be zero");
  spec.axis.normalize();
  if (limited && axis->Lower() > -kNoLimit) spec.lower = axis->Lower();
  if (limited && axis->Upper() < kNoLimit) spec.upper = axis->Upper();
  spec.effort_limit = bound(document, axis->Effort(), "effort", element);
  spec.velocity_limit = bound(document, axis->MaxVelocity(), "velocity", element);
  spec.damping = axis->Damping();
  spec.dry_friction = axis->Friction();
  spec.stiffness = axis->SpringStiffness();
  spec.reference = spec.stiffness > 0.0 ? axis->SpringReference() : 0.0;
  return spec;
}

/// Refuses ODE settings without a counterpart here: motors and bouncing limits.
void check_physics(Document& document, const sdf::ElementPtr& element) {
  const sdf::ElementPtr ode = Document::child(Document::child(element, "physics"), "ode");
  if (Document::number(ode, "velocity", 0.0) != 0.0 &&
      Document::number(ode, "max_force", 0.0) > 0.0)
    document.refuse(
        ode, LeaveOut::kActuators,
        "<velocity>, a motor in the file, is not supported; a scene may give the joint a servo");
  if (Document::number(ode, "bounce", 0.0) > 0.0)
    document.fail(ode, "<bounce>: limits do not bounce here");
}

}  // namespace

std::vector<JointSpec> read_motions(Document& document, const sdf::Joint& joint,
                                    const std::string& name) {
  const sdf::ElementPtr element = joint.Element();
  document.pass_over_all_but(
      element, {"parent", "child", "axis", "axis2", "pose", "physics", "sensor", "thread_pitch",
                "gearbox_ratio", "gearbox_reference_body"});
  check_physics(document, element);
  std::vector<JointSpec> motions;
  switch (joint.Type()) {
    case sdf::JointType::FIXED:
      break;
    case sdf::JointType::BALL:
      motions.emplace_back().type = JointType::kSpherical;
      break;
    case sdf::JointType::CONTINUOUS:
    case sdf::JointType::REVOLUTE: {
      const bool limited = joint.Type() == sdf::JointType::REVOLUTE;
      motions.push_back(read_axis(document, joint, 0, JointType::kRevolute, limited));
      break;
    }
    case sdf::JointType::PRISMATIC:
      motions.push_back(read_axis(document, joint, 0, JointType::kPrismatic, true));
      break;
    case sdf::JointType::UNIVERSAL:
    case sdf::JointType::REVOLUTE2:
      for (const unsigned number : {0U, 1U})
        motions.push_back(read_axis(document, joint, number, JointType::kRevolute, true));
      break;
    default:
      document.fail(
          element, fmt::format("type '{}' is not supported; revolute, continuous, prismatic, ball, "
                               "universal, revolute2 or fixed is expected",
                               element->Get<std::string>("type")));
  }
  for (std::size_t i = 0; i < motions.size(); ++i) {
    motions[i].name = i == 0 ? name : name + ".2";
    motions[i].where = document.where(element);
  }
  return motions;
}

}  // namespace counterpoint::sdf_file
