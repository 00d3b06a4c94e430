#include "counterpoint/model/mjcf/sensors.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <iterator>
#include <map>

namespace counterpoint::mjcf {
namespace {

class SensorReader {
 public:
  SensorReader(Document& document, const Defaults& defaults, const Bodies& bodies, MjcfModel& model)
      : document_(document), defaults_(defaults), bodies_(bodies), model_(model) {}

  void read(const Element& e) {
    const Values v(document_, e);
    const std::string kind = e.Name();
    SensorSpec spec;
    spec.where = document_.where(e);
    spec.sensor.name = v.text("name", fmt::format("{}{}", kind, count_[kind]++));
    for (const char* key : {"noise", "cutoff", "delay", "interval", "nsample"})
      if (v.number(key, 0.0) != 0.0)
        document_.note(e, fmt::format("{} is not used: readings are exact", key));
    const std::string why = fill(v, kind, spec);
    if (!why.empty()) return document_.note(e, why + ": left out");
    model_.sensors.push_back(std::move(spec));
  }

 private:
  /// Completes the sensor; returns the reason why it is left out, or "".
  std::string fill(const Values& v, const std::string& kind, SensorSpec& spec) const {
    const auto* const found = std::find_if(std::begin(kSensorElements), std::end(kSensorElements),
                                           [&](const SensorElement& e) { return kind == e.name; });
    if (found != std::end(kSensorElements)) {
      spec.sensor.kinds = {found->kind};
      spec.sensor.own_axes = found->own_axes;
      return of_object(v, *found, spec);
    }
    return "<" + kind + "> has no counterpart";
  }

  std::string of_object(const Values& v, const SensorElement& element, SensorSpec& spec) const {
    switch (element.object) {
      case Sensed::kSite:
        if (element.kind == SensorKind::kTouch)
          document_.note(v.element(),
                         "the site has no volume here: all contacts of the body count");
        return at_site(v.text("site"), spec);
      case Sensed::kJoint:
        return of_joint(v.text("joint"), spec);
      case Sensed::kFrame:
        return of_frame(v, element.name, spec);
      case Sensed::kTendon:
        return of_tendon(v.text("tendon"), spec);
      case Sensed::kActuator:
        return of_actuator(v.text("actuator"), element.kind, spec);
      case Sensed::kSubtree:
        break;
    }
    const std::string name = v.text("body");
    return name == "world" ? "" : of_body(name, spec.link);
  }

  std::string of_body(const std::string& name, std::string& link) const {
    const auto found = bodies_.body_names.find(name);
    if (name != "world" && found == bodies_.body_names.end())
      return fmt::format("there is no body '{}'", name);
    link = bodies_.bodies[static_cast<std::size_t>(name == "world" ? 0 : found->second)].link;
    return "";
  }

  std::string at_site(const std::string& name, SensorSpec& spec) const {
    const auto found = bodies_.sites.find(name);
    if (found == bodies_.sites.end()) return fmt::format("there is no site '{}'", name);
    spec.link = bodies_.bodies[static_cast<std::size_t>(found->second.body)].link;
    spec.sensor.X_FS = found->second.X_BS;
    return "";
  }

  std::string of_joint(const std::string& name, SensorSpec& spec) const {
    const auto found = bodies_.joint_names.find(name);
    if (found == bodies_.joint_names.end()) return fmt::format("there is no joint '{}'", name);
    spec.joint = bodies_.joints[static_cast<std::size_t>(found->second)].name;
    return "";
  }

  std::string of_frame(const Values& v, const std::string& kind, SensorSpec& spec) const {
    if (v.has("refname")) {
      if (v.text("reftype") != "xbody")
        return fmt::format("reference of type '{}'; xbody is expected", v.text("reftype"));
      if (const std::string why = of_body(v.text("refname"), spec.relative_to); !why.empty())
        return why;
    }
    const std::string type = v.text("objtype"), name = v.text("objname");
    if (type == "site") return at_site(name, spec);
    if (type != "body" && type != "xbody") return fmt::format("frame of a {}", type);
    if (type == "body" && kind == "framequat") return "principal axes of inertia";
    if (const std::string why = of_body(name, spec.link); !why.empty()) return why;
    // <body> means the frame at the centre of mass, <xbody> that of the body.
    if (type != "body") return "";
    for (const LinkSpec& link : model_.robot.links)
      if (link.name == spec.link) spec.sensor.X_FS.translation = link.inertia.center;
    return "";
  }

  std::string of_tendon(const std::string& name, SensorSpec& spec) const {
    spec.tendon = name;
    for (const TendonSpec& tendon : model_.tendons)
      if (tendon.name == name) return "";
    return fmt::format("'{}' is no tendon, or one whose forces act on a single joint", name);
  }

  /// Reads an actuator that became a servo or an applied force off its joint, if it is the only one
  /// there and has no gear.
  std::string of_actuator(const std::string& name, SensorKind kind, SensorSpec& spec) const {
    for (const ActuatorSpec& commanded : model_.commanded) {
      if (commanded.actuator.name != name) continue;
      spec.actuator = name;
      return "";
    }
    const Element* actuator = nullptr;
    for (const Element* e : document_.section_children("actuator"))
      if (const char* own = e->Attribute("name"); own != nullptr && own == name) actuator = e;
    if (actuator == nullptr) return fmt::format("there is no actuator '{}'", name);
    const std::string joint = Values(document_, *actuator).text("joint");
    int same = 0;
    for (const Element* e : document_.section_children("actuator"))
      same += Values(document_, *e).text("joint") == joint ? 1 : 0;
    double gear = 1.0;
    const std::vector<std::string> tags = {"general", "motor", "position", "velocity", "damper"};
    for (const Element* e : defaults_.chain(*actuator, "", tags))
      if (const auto g = Values(document_, *e).numbers("gear", 1, 6); !g.empty()) gear = g[0];
    if (const auto g = Values(document_, *actuator).numbers("gear", 1, 6); !g.empty()) gear = g[0];
    if (joint.empty() || same != 1 || gear != 1.0)
      return "quantities of an actuator with a gear, without a joint, or beside others";
    spec.sensor.kinds = {kind == SensorKind::kActuatorForce      ? SensorKind::kJointEffort
                         : kind == SensorKind::kActuatorPosition ? SensorKind::kJointPosition
                                                                 : SensorKind::kJointVelocity};
    return of_joint(joint, spec);
  }

  Document& document_;
  const Defaults& defaults_;
  const Bodies& bodies_;
  MjcfModel& model_;
  std::map<std::string, int> count_;
};

}  // namespace

void read_sensors(Document& document, const Defaults& defaults, const Bodies& bodies,
                  MjcfModel& model) {
  SensorReader reader(document, defaults, bodies, model);
  document.each(document.section_children("sensor"), [&](const Element& e) { reader.read(e); });
}

}  // namespace counterpoint::mjcf
