#include "counterpoint/model/mjcf/forces/equality.h"

#include <fmt/format.h>
#include <tinyxml2.h>

namespace counterpoint::mjcf {
namespace {

class EqualityReader {
 public:
  EqualityReader(Document& document, const Bodies& bodies, const Tendons& tendons,
                 Couplings& couplings, MjcfModel& model)
      : document_(document),
        bodies_(bodies),
        tendons_(tendons),
        couplings_(couplings),
        model_(model) {}

  void read(const Values& v) {
    const Element& e = v.element();
    document_.expect(e, {"name", "class", "active", "solref", "solimp", "body1", "body2", "anchor",
                         "site1", "site2", "relpose", "torquescale", "joint1", "joint2", "polycoef",
                         "tendon1", "tendon2"});
    if (!v.boolean("active", true)) return document_.note(e, "not active at the start: left out");
    const std::string kind = e.Name();
    if (kind == "connect" || kind == "weld")
      closure(v, kind == "weld");
    else if (kind == "joint")
      joints(v);
    else if (kind == "tendon")
      tendons(v);
    else
      document_.refuse(e, LeaveOut::kEqualities, fmt::format("<{}> is not supported", kind));
  }

 private:
  /// The body of one side of a closure, and the pose of its site in that body.
  Site side(const Values& v, const char* body, const char* site) const {
    const Element& e = v.element();
    if (v.has(site)) {
      const auto found = bodies_.sites.find(v.text(site));
      if (found != bodies_.sites.end()) return found->second;
      document_.fail(e, fmt::format("{}: there is no site '{}'", site, v.text(site)));
    }
    return {bodies_.body(document_, e, v.text(body, "world")), Pose()};
  }

  void closure(const Values& v, bool weld) {
    const Element& e = v.element();
    if (!v.has("body1") && !(v.has("site1") && v.has("site2")))
      document_.fail(e, "body1, or site1 and site2, are expected");
    const bool by_site = v.has("site1");
    const Site a = side(v, "body1", "site1"), b = side(v, "body2", "site2");
    const BodyNode &body_a = bodies_.bodies[a.body], &body_b = bodies_.bodies[b.body];
    if (body_a.weld == body_b.weld)
      return document_.note(e, "both sides are one rigid body: left out");
    const Pose X_AB = body_a.X_WB.inverse() * body_b.X_WB;  // in the reference pose
    ClosureSpec spec;
    spec.name = name_of(e).empty() ? fmt::format("equality{}", number_) : name_of(e);
    ++number_;
    spec.type = weld ? ClosureType::kWeld : ClosureType::kBall;
    spec.link_a = body_a.link;
    spec.link_b = body_b.link;
    spec.where = document_.where(e);
    spec.collide = true;
    if (by_site) {
      spec.anchor_a = a.X_BS.translation;
      spec.anchor_b = b.X_BS.translation;
      if (weld) spec.orientation = a.X_BS.rotation * b.X_BS.rotation.transpose();
    } else if (weld) {
      Pose held = X_AB;
      if (const auto p = v.numbers("relpose", 7, 7);
          !p.empty() && Eigen::Map<const Eigen::Vector4d>(p.data() + 3).norm() > 1e-10)
        held = {rotation_of(p.data() + 3), {p[0], p[1], p[2]}};
      spec.anchor_a = held.translation;
      spec.anchor_b = Vector3::Zero();
      spec.orientation = held.rotation;
    } else {
      if (!v.has("anchor")) document_.fail(e, "anchor: three numbers are expected");
      spec.anchor_a = v.vector("anchor", Vector3::Zero());
      spec.anchor_b = X_AB.inverse() * *spec.anchor_a;
    }
    model_.closures.push_back(spec);
  }

  void couple(const Element& e, const Couplings::Sum& sum, double value) {
    switch (couplings_.couple(sum, value)) {
      case Couplings::Outcome::kCoupled:
        return;
      case Couplings::Outcome::kHeldAlready:
        return document_.note(e, "other equalities hold this already: left out");
      case Couplings::Outcome::kLocks:
        return document_.refuse(e, LeaveOut::kEqualities,
                                "it holds a joint where it is; take the joint away");
      case Couplings::Outcome::kTooMany:
        return document_.refuse(e, LeaveOut::kEqualities,
                                "it couples more than two joints, which is not supported");
    }
  }

  /// Couples joints by q1 = q1_0 + p0 + p1 (q2 - q2_0), with the coordinates q_0 of the reference
  /// pose; refuses higher powers.
  void joints(const Values& v) {
    const Element& e = v.element();
    std::vector<double> p = v.numbers("polycoef", 1, 5);
    if (p.empty()) p = {0, 1};
    p.resize(5);
    if (p[2] != 0.0 || p[3] != 0.0 || p[4] != 0.0)
      return document_.refuse(
          e, LeaveOut::kEqualities,
          "polycoef: joints follow others linearly only; two numbers are expected");
    const Joint& first =
        bodies_.joints[find_scalar_joint(document_, bodies_, model_, e, v.text("joint1"))];
    Couplings::Sum sum{{first.spec, 1.0}};
    double value = first.reference + p[0];
    if (v.has("joint2")) {
      const Joint& second =
          bodies_.joints[find_scalar_joint(document_, bodies_, model_, e, v.text("joint2"))];
      sum.emplace_back(second.spec, -p[1]);
      value -= p[1] * second.reference;
    }
    couple(e, sum, value);
  }

  void tendons(const Values& v) {
    const Element& e = v.element();
    const auto find = [&](const char* key) -> const TendonElement& {
      const auto found = tendons_.find(v.text(key));
      if (found != tendons_.end()) return found->second;
      document_.fail(e, fmt::format("{}: there is no tendon '{}'", key, v.text(key)));
    };
    std::vector<double> p = v.numbers("polycoef", 1, 5);
    if (p.empty()) p = {0, 1};
    p.resize(5);
    const TendonElement& first = find("tendon1");
    const TendonElement* second = v.has("tendon2") ? &find("tendon2") : nullptr;
    if (!first.fixed || (second && !second->fixed) || p[2] != 0.0 || p[3] != 0.0 || p[4] != 0.0)
      return document_.refuse(e, LeaveOut::kEqualities,
                              "only sums of joints (<fixed>) can be coupled, and linearly");
    Couplings::Sum sum = first.sum;
    double value = first.reference + p[0];
    if (second) {
      for (const auto& [joint, coefficient] : second->sum)
        sum.emplace_back(joint, -p[1] * coefficient);
      value -= p[1] * second->reference;
    }
    couple(e, sum, value);
  }

  Document& document_;
  const Bodies& bodies_;
  const Tendons& tendons_;
  Couplings& couplings_;
  MjcfModel& model_;
  int number_ = 0;
};

}  // namespace

int find_scalar_joint(const Document& document, const Bodies& bodies, const MjcfModel& model,
                      const Element& user, const std::string& name) {
  const auto found = bodies.joint_names.find(name);
  if (found == bodies.joint_names.end())
    document.fail(user, fmt::format("there is no joint '{}'", name));
  const Joint& joint = bodies.joints[found->second];
  if (joint_nv(model.robot.joints[joint.spec].type) == 1) return found->second;
  document.fail(
      user, fmt::format("joint '{}' has several coordinates; a hinge or slide is expected", name));
}

void read_equalities(Document& document, const Defaults& defaults, const Bodies& bodies,
                     const Tendons& tendons, Couplings& couplings, MjcfModel& model) {
  EqualityReader reader(document, bodies, tendons, couplings, model);
  document.each(document.section_children("equality"),
                [&](const Element& e) { reader.read(defaults.values(e, "", "equality")); });
}

}  // namespace counterpoint::mjcf
