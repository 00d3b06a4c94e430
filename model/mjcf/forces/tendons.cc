#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>

#include "counterpoint/model/mjcf/forces/equality.h"

namespace counterpoint::mjcf {
namespace {

/// Passive forces of a tendon as functions of its length.
struct Forces {
  double stiffness = 0.0, damping = 0.0, friction = 0.0, rest = 0.0;
  bool limited = false;
  double lower = 0.0, upper = 0.0;
  bool any() const { return stiffness > 0.0 || damping > 0.0 || friction > 0.0 || limited; }
};

Forces read_forces(Document& document, const Values& v, const Tendon& tendon) {
  Forces f;
  f.stiffness = v.number("stiffness", 0.0);
  f.damping = v.number("damping", 0.0);
  f.friction = v.number("frictionloss", 0.0);
  const std::vector<double> rest = v.numbers("springlength", 1, 2);
  f.rest = rest.empty() || rest[0] < 0.0 ? tendon.reference : rest[0];
  if (rest.size() == 2 && rest[0] != rest[1] && f.stiffness > 0.0)
    document.refuse(v.element(), LeaveOut::kTendons,
                    "springlength: a slack range is not supported");
  if (v.number("armature", 0.0) > 0.0)
    document.refuse(v.element(), LeaveOut::kTendons, "armature of a tendon is not supported");
  const std::string limited = v.word("limited", {"true", "false", "auto"}, "auto");
  f.limited = limited == "auto" ? document.compiler(v.element()).auto_limits && v.has("range")
                                : limited == "true";
  if (!f.limited) return f;
  const std::vector<double> range = v.numbers("range", 2, 2);
  if (range.empty() || !(range[0] < range[1]))
    document.fail(v.element(), "range: two numbers are expected, the first less");
  f.lower = range[0];
  f.upper = range[1];
  return f;
}

/// Adds the forces of a tendon to a joint; the length of the tendon is c q + constant.
void apply(const Forces& f, double c, double constant, JointSpec& joint) {
  if (f.stiffness > 0.0) {
    const double stiffness = c * c * f.stiffness, rest = (f.rest - constant) / c;
    const double sum = joint.stiffness + stiffness;
    joint.reference = (joint.stiffness * joint.reference + stiffness * rest) / sum;
    joint.stiffness = sum;
  }
  joint.damping += c * c * f.damping;
  joint.dry_friction += std::abs(c) * f.friction;
  if (!f.limited) return;
  double lower = (f.lower - constant) / c, upper = (f.upper - constant) / c;
  if (c < 0.0) std::swap(lower, upper);
  joint.lower = std::max(joint.lower, lower);
  joint.upper = std::min(joint.upper, upper);
}

void apply_one(Document& document, const Defaults& defaults, const Tendon& tendon,
               const Couplings& couplings, MjcfModel& model) {
  const Forces forces =
      read_forces(document, defaults.values(*tendon.element, "", "tendon"), tendon);
  if (!forces.any()) return;
  const Couplings::Reduced length = couplings.reduce(tendon.sum);
  if (tendon.fixed && length.sum.size() == 1) {
    const auto& [joint, c] = length.sum[0];
    return apply(forces, c, length.constant, model.robot.joints[joint]);
  }
  document.refuse(
      *tendon.element, LeaveOut::kTendons,
      tendon.fixed
          ? "a spring, damper, friction or limit of a tendon over several joints that are not "
            "coupled is not supported"
          : "a spring, damper, friction or limit of a tendon through space is not supported");
}

}  // namespace

Tendons read_tendons(Document& document, const Bodies& bodies) {
  Tendons out;
  document.each(document.section_children("tendon"), [&](const Element& e) {
    Tendon tendon;
    tendon.element = &e;
    const std::string kind = e.Name(), name = name_of(e);
    if (kind != "fixed" && kind != "spatial")
      document.fail(e, "a <fixed> or <spatial> tendon is expected");
    tendon.fixed = kind == "fixed";
    for (const Element* part : document.children(e)) {
      if (!tendon.fixed) break;
      const auto joint = bodies.joint_names.find(Values(document, *part).text("joint"));
      if (joint == bodies.joint_names.end()) document.fail(*part, "there is no such joint");
      const Joint& found = bodies.joints[joint->second];
      const double coefficient = Values(document, *part).number("coef", 0.0);
      tendon.sum.emplace_back(found.spec, coefficient);
      tendon.reference += coefficient * found.reference;
    }
    const std::string key = name.empty() ? fmt::format("tendon {}", out.size()) : name;
    if (!out.emplace(key, tendon).second)
      document.fail(e, "there is already a tendon of this name");
  });
  return out;
}

void apply_tendon_forces(Document& document, const Defaults& defaults, const Tendons& tendons,
                         const Couplings& couplings, MjcfModel& model) {
  for (const auto& [name, tendon] : tendons)
    document.faults.collect(
        [&, &one = tendon] { apply_one(document, defaults, one, couplings, model); });
}

}  // namespace counterpoint::mjcf
