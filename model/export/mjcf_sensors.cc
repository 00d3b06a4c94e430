#include "counterpoint/model/export/mjcf_sensors.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "counterpoint/model/export/mjcf_actuators.h"
#include "counterpoint/model/mjcf/sensors.h"

namespace counterpoint {
namespace {

using mjcf::kSensorElements;
using mjcf::Sensed;
using mjcf::SensorElement;

const Frame& frame_of(const Model& model, int frame) {
  return model.frames()[static_cast<std::size_t>(frame)];
}

/// Whether a frame belongs to the link that the joint of its body moves.
bool moves_by_joint(const Model& model, int frame) {
  const Frame& f = frame_of(model, frame);
  return f.body > 0 && f.name == mjcf_body_name(model, f.body);
}

/// Returns the element for one kind of a sensor, or null.
const SensorElement* find_element(const Sensor& s, SensorKind kind) {
  const auto* const found = std::find_if(
      std::begin(kSensorElements), std::end(kSensorElements), [&](const SensorElement& e) {
        const bool free = !takes_axes(kind) || senses_wrench(kind) || senses_joint(kind);
        const bool relative = takes_reference(kind) && s.reference >= 0;
        return e.kind == kind && (free || e.own_axes == s.own_axes) &&
               !(relative && e.object == Sensed::kSite);
      });
  return found == std::end(kSensorElements) ? nullptr : found;
}

/// Returns the reason why MJCF has no sensor of this kind, or "".
std::string sensor_lack(const Model& model, const Sensor& s, SensorKind kind, EffectSet on,
                        const std::vector<char>& written) {
  const std::string name = sensor_kind_name(kind);
  if (!find_element(s, kind)) return name;
  if (senses_wrench(kind) && (s.frame < 0 || !moves_by_joint(model, s.frame)))
    return name + " at a fixed joint";
  if (senses_subtree(kind) && s.frame >= 0 && !moves_by_joint(model, s.frame))
    return name + " of a link that a fixed joint holds";
  if (senses_joint(kind) && joint_nv(model.body(s.joint + 1).joint_type) != 1)
    return name + " of a joint of several coordinates";
  if (kind == SensorKind::kTouch) return name + ": MJCF counts contacts within a site";
  if (senses_tendon(kind) && !on.has(Effect::kTendons)) return name + " without tendons";
  if (senses_actuator(kind) && !written[static_cast<std::size_t>(s.actuator)])
    return name + " of an actuator that is left out";
  // MuJoCo's has the forces of all actuators.
  if (kind == SensorKind::kJointEffort && has_drives_in_mjcf(model, on))
    return name + " beside actuators";
  return "";
}

std::string site_of(const Sensor& s) { return s.name + "/sensor"; }

std::string body_of(const Model& model, int frame) {
  return frame < 0 ? "world" : mjcf_body_name(model, frame_of(model, frame).body);
}

/// Whether the reference is a site, and not the frame of a body.
bool refers_to_site(const Model& model, const Sensor& s) {
  if (s.reference < 0) return false;
  const Pose& X = frame_of(model, s.reference).X_BF;
  return !X.translation.isZero(0.0) || !X.rotation.isIdentity(0.0);
}

std::string reference_site_of(const Sensor& s) { return s.name + "/reference"; }

void write_sensor(const Model& model, const Sensor& s, SensorKind kind, MjcfXml& xml) {
  const SensorElement& element = *find_element(s, kind);
  xml.open(element.name);
  xml.set("name", s.kinds.size() == 1 ? s.name : s.name + "/" + sensor_kind_name(kind));
  switch (element.object) {
    case Sensed::kSite:
      xml.set("site", site_of(s));
      break;
    case Sensed::kJoint:
      xml.set("joint", mjcf_joint_name(model, s.joint));
      break;
    case Sensed::kFrame:
      xml.set("objtype", "site");
      xml.set("objname", site_of(s));
      if (s.reference < 0) break;
      xml.set("reftype", refers_to_site(model, s) ? "site" : "xbody");
      xml.set("refname",
              refers_to_site(model, s) ? reference_site_of(s) : body_of(model, s.reference));
      break;
    case Sensed::kSubtree:
      xml.set("body", body_of(model, s.frame));
      break;
    case Sensed::kTendon:
      xml.set("tendon", model.tendons()[static_cast<std::size_t>(s.tendon)].name);
      break;
    case Sensed::kActuator:
      xml.set("actuator", model.actuators()[static_cast<std::size_t>(s.actuator)].name);
      break;
  }
  xml.close();
}

}  // namespace

void write_mjcf_sensor_sites(const Model& model, int body, MjcfXml& xml) {
  for (const Sensor& s : model.sensors()) {
    const bool at_site = std::any_of(s.kinds.begin(), s.kinds.end(), [&](SensorKind kind) {
      const SensorElement* element = find_element(s, kind);
      return element && (element->object == Sensed::kSite || element->object == Sensed::kFrame);
    });
    if (!at_site) continue;
    if (refers_to_site(model, s) && frame_of(model, s.reference).body == body)
      xml.site(reference_site_of(s), frame_of(model, s.reference).X_BF);
    const Frame* link = s.frame < 0 ? nullptr : &frame_of(model, s.frame);
    if ((link ? link->body : 0) != body) continue;
    xml.site(site_of(s), link ? link->X_BF * s.X_FS : s.X_FS);
  }
}

void write_mjcf_sensors(const Model& model, EffectSet on, const std::vector<char>& written,
                        MjcfXml& xml, std::vector<Note>& lost) {
  xml.open("sensor");
  for (const Sensor& s : model.sensors()) {
    const auto lose = [&](const std::string& part) {
      lost.push_back({"sensor '" + s.name + "'", part});
    };
    for (const SensorKind kind : s.kinds) {
      const std::string lack = sensor_lack(model, s, kind, on, written);
      if (lack.empty())
        write_sensor(model, s, kind, xml);
      else
        lose(lack);
    }
    if (s.errors.any()) lose("the errors of its readings");
    if (std::isfinite(s.limit)) lose("the largest distance that it measures");
  }
  xml.close();
}

}  // namespace counterpoint
