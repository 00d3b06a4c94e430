#include "counterpoint/model/mjcf/bodies/joints.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <cmath>
#include <cstring>

#include "counterpoint/model/special_values.h"

namespace counterpoint::mjcf {
namespace {

/// Whether a range is in force. `key`: for example "limited".
bool is_limited(const Values& v, const char* key, const char* range, const Compiler& compiler) {
  const std::string word = v.word(key, {"true", "false", "auto"}, "auto");
  return word == "auto" ? compiler.auto_limits && v.has(range) : word == "true";
}

void read_range(const Values& v, const Compiler& compiler, double unit, JointSpec& spec) {
  if (!is_limited(v, "limited", "range", compiler)) return;
  const std::vector<double> range = v.numbers("range", 2, 2);
  if (range.empty()) v.document().fail(v.element(), "limited, but there is no range");
  if (!(range[0] < range[1]))
    v.document().fail(*v.level_of("range"), "range: the first number must be less");
  spec.lower = unit * range[0];
  spec.upper = unit * range[1];
}

/// Reads the bound on the total force of all actuators of a joint.
void read_force_range(Document& document, const Values& v, const Compiler& compiler,
                      JointSpec& spec) {
  if (!is_limited(v, "actuatorfrclimited", "actuatorfrcrange", compiler)) return;
  const std::vector<double> range = v.numbers("actuatorfrcrange", 2, 2);
  if (range.empty())
    document.fail(v.element(), "actuatorfrclimited, but there is no actuatorfrcrange");
  spec.effort_limit = std::max(std::abs(range[0]), std::abs(range[1]));
  if (range[0] != -range[1])
    document.note(v.element(), fmt::format("actuatorfrcrange {} ... {}: taken as {} either way",
                                           range[0], range[1], spec.effort_limit));
}

void expect_joint_words(Document& document, const Element& element) {
  document.expect(element, {"name",
                            "class",
                            "type",
                            "group",
                            "pos",
                            "axis",
                            "springdamper",
                            "limited",
                            "actuatorfrclimited",
                            "solreflimit",
                            "solimplimit",
                            "solreffriction",
                            "solimpfriction",
                            "stiffness",
                            "range",
                            "actuatorfrcrange",
                            "actuatorgravcomp",
                            "margin",
                            "ref",
                            "springref",
                            "armature",
                            "damping",
                            "frictionloss",
                            "user"});
}

[[noreturn]] void refuse_align(const Document& document, const Element& element) {
  document.fail(element,
                "align: a body's frame that is moved to its centre is not supported; say "
                "align=\"false\"");
}

}  // namespace

JointRead read_joint(Document& document, const Defaults& defaults, const Element& element,
                     const std::string& childclass) {
  const Compiler& compiler = document.compiler(element);
  JointRead out;
  JointSpec& spec = out.spec;
  spec.where = document.where(element);
  if (std::strcmp(element.Name(), "freejoint") == 0) {
    document.expect(element, {"name", "group", "align", "class"});
    const std::string align = Values(document, element).text("align", "auto");
    if (align == "true" || (align == "auto" && compiler.align_free))
      refuse_align(document, element);
    spec.type = JointType::kFloating;
    return out;
  }
  const Values v = defaults.values(element, childclass);
  expect_joint_words(document, element);
  const std::string type = v.word("type", {"free", "ball", "slide", "hinge"}, "hinge");
  spec.type = type == "free"    ? JointType::kFloating
              : type == "ball"  ? JointType::kSpherical
              : type == "slide" ? JointType::kPrismatic
                                : JointType::kRevolute;
  spec.damping = v.number("damping", 0.0);
  spec.armature = v.number("armature", 0.0);
  spec.dry_friction = v.number("frictionloss", 0.0);
  read_force_range(document, v, compiler, spec);
  if (v.boolean("actuatorgravcomp", false) && std::isfinite(spec.effort_limit))
    document.note(
        element,
        "actuatorgravcomp: compensation for gravity does not count towards actuatorfrcrange");
  const double stiffness = v.number("stiffness", 0.0);
  if (const auto s = v.numbers("springdamper", 2, 2); !s.empty() && s[0] > 0.0 && s[1] > 0.0)
    out.spring_damper = SpringDamper{s[0], s[1]};
  if (joint_nv(spec.type) != 1) {
    if (out.spring_damper || stiffness > 0.0)
      document.refuse(element, LeaveOut::kJointForces,
                      fmt::format("{} of a {} joint is not supported",
                                  stiffness > 0.0 ? "stiffness" : "springdamper", type));
    if (spec.type == JointType::kSpherical) {
      read_range(v, compiler, compiler.angle_unit, spec);
      spec.lower = -kInfinity;  // MuJoCo does not use the first number
      out.anchor = v.vector("pos", Vector3::Zero());
    }
    return out;
  }
  const double unit = spec.type == JointType::kRevolute ? compiler.angle_unit : 1.0;
  out.anchor = v.vector("pos", Vector3::Zero());
  spec.axis = v.vector("axis", Vector3::UnitZ());
  if (!(spec.axis.norm() > 1e-10)) document.fail(element, "axis: a direction cannot be zero");
  spec.axis.normalize();
  read_range(v, compiler, unit, spec);
  spec.stiffness = stiffness;
  spec.reference = unit * v.number("springref", 0.0);
  out.reference = unit * v.number("ref", 0.0);
  if (spec.type == JointType::kRevolute)
    out.before.rotation = Eigen::AngleAxisd(-out.reference, spec.axis).toRotationMatrix();
  else
    out.before.translation = -out.reference * spec.axis;
  return out;
}

}  // namespace counterpoint::mjcf
