#include "counterpoint/model/urdf/urdf_xml.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <set>
#include <sstream>
#include <string_view>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/spatial.h"
#include "counterpoint/model/text_files.h"
#include "counterpoint/model/urdf/optenv.h"

namespace counterpoint {

using tinyxml2::XMLElement;

Material SurfaceValues::over(const Material& base) const {
  Material out = base;
  out.restitution = restitution.value_or(base.restitution);
  out.torsional_friction = torsional_friction.value_or(base.torsional_friction);
  out.rolling_friction = rolling_friction.value_or(base.rolling_friction);
  if (friction) {
    out.friction = *friction;
    out.static_friction = 0.0;
    out.friction_axis = friction_axis;
    out.friction_across = friction_across;
  }
  if (is_spring(stiffness) && !(out.restitution > 0.0)) {
    out.stiffness = *stiffness;
    out.damping = damping;
  }
  return out;
}

namespace {

/// Reads the elements of one robot, and rewrites the document for urdfdom.
class Pass {
 public:
  Pass(const std::filesystem::path& file, UrdfXml& out) : file_(file.string()), out_(out) {}

  void read(tinyxml2::XMLDocument& document) {
    XMLElement* robot = document.RootElement();
    if (robot == nullptr || std::strcmp(robot->Name(), "robot") != 0) {
      throw InputError(fmt::format("{}:{}: the root element is <{}>; a URDF has <robot>", file_,
                                   robot == nullptr ? 1 : robot->GetLineNum(),
                                   robot == nullptr ? "" : robot->Name()));
    }
    if (const char* name = robot->Attribute("name"); name == nullptr || *name == '\0') {
      const std::string stem = std::filesystem::path(file_).stem().string();
      out_.notes.push_back({at(robot), "the robot has no name; it is called '" + stem + "'"});
      robot->SetAttribute("name", stem.c_str());
    }
    std::vector<XMLElement*> elements;
    for (XMLElement* e = robot->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      elements.push_back(e);
    }
    for (XMLElement* e : elements) {
      const std::string name = e->Name();
      if (name == "link") faults_.collect([&] { read_link(e); });
      if (name == "joint") faults_.collect([&] { read_joint(e); });
    }
    add_world_link(robot);
    for (XMLElement* e : elements) {
      const std::string name = e->Name();
      if (name == "link" || name == "joint") continue;
      if (name == "gazebo")
        faults_.collect([&] { read_gazebo(e); });
      else if (name == "transmission")
        faults_.collect([&] { read_transmission(e); });
      else if (name != "material" && name != "frame")
        note_unused(e, "");
      robot->DeleteChild(e);
    }
    faults_.throw_if_any();
  }

 private:
  std::string at(const XMLElement* e) const { return fmt::format("{}:{}", file_, e->GetLineNum()); }

  /// Adds a link "world" if a joint has this parent and there is no such link, as in files for
  /// Drake.
  void add_world_link(XMLElement* robot) {
    if (out_.links.count("world") > 0) return;
    for (XMLElement* e = robot->FirstChildElement("joint"); e != nullptr;
         e = e->NextSiblingElement("joint")) {
      const XMLElement* parent = e->FirstChildElement("parent");
      const char* name = parent == nullptr ? nullptr : parent->Attribute("link");
      if (name == nullptr || std::strcmp(name, "world") != 0) continue;
      robot->InsertNewChildElement("link")->SetAttribute("name", "world");
      out_.link_names.push_back("world");
      out_.links["world"].line = parent->GetLineNum();
      out_.notes.push_back({at(parent), "there is no link 'world'; an empty one is added"});
      return;
    }
  }

  void note_unused(const XMLElement* e, const std::string& owner) {
    std::string what = fmt::format("<{}>", e->Name());
    if (const char* name = e->Attribute("name")) what += fmt::format(" '{}'", name);
    out_.notes.push_back({at(e) + owner, what + " is not used"});
  }

  double parse(const XMLElement* e, const char* attribute, std::string_view text) const {
    const auto blank = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && blank(text.back())) text.remove_suffix(1);
    const std::optional<double> value = parse_number(text);
    if (!value) {
      throw InputError(fmt::format("{}: <{} {}=\"{}\">: a number is expected", at(e), e->Name(),
                                   attribute, e->Attribute(attribute)));
    }
    return *value;
  }

  /// The number in an attribute; nothing if the attribute is missing.
  std::optional<double> number(const XMLElement* e, const char* attribute) const {
    const char* text = e->Attribute(attribute);
    if (text == nullptr) return std::nullopt;
    return parse(e, attribute, text);
  }

  /// The three numbers in an attribute; zeros if the attribute is missing.
  Vector3 vector(const XMLElement* e, const char* attribute) const {
    const char* text = e->Attribute(attribute);
    if (text == nullptr) return Vector3::Zero();
    std::istringstream words(text);
    std::vector<double> values;
    for (std::string word; words >> word;) values.push_back(parse(e, attribute, word));
    if (values.size() == 3) return {values[0], values[1], values[2]};
    throw InputError(fmt::format("{}: <{} {}=\"{}\">: three numbers are expected", at(e), e->Name(),
                                 attribute, text));
  }

  /// The number in the text of an element, as in Gazebo's <mu1>0.9</mu1>.
  std::optional<double> text_number(XMLElement* e) const {
    if (e == nullptr || e->GetText() == nullptr) return std::nullopt;
    e->SetAttribute("value", e->GetText());
    return number(e, "value");
  }

  void read_link(XMLElement* e) {
    const char* name = e->Attribute("name");
    if (name == nullptr) throw InputError(at(e) + ": a <link> needs a name");
    if (out_.links.count(name) > 0) {
      throw InputError(fmt::format("{}: link '{}' is there twice (first in line {}); rename one",
                                   at(e), name, out_.links[name].line));
    }
    if (out_.link_names.size() == limits::kMaxLinks) {
      throw InputError(
          fmt::format("{}: more than {} links; put the robot into several files of a scene", at(e),
                      limits::kMaxLinks));
    }
    out_.link_names.push_back(name);
    UrdfXml::Link& link = out_.links[name];
    link.line = e->GetLineNum();
    const std::string owner = fmt::format(": link '{}'", name);
    for (XMLElement* c = e->FirstChildElement(); c != nullptr;) {
      XMLElement* next = c->NextSiblingElement();
      const std::string kind = c->Name();
      if (kind == "collision") {
        read_collision(c, owner, link);
      } else if (kind == "contact") {
        read_bullet_contact(c, owner, link.surface);
      } else if (kind == "inertial") {
        read_inertial(c, owner, link);
      } else {
        if (kind != "visual" && kind != "material") note_unused(c, owner);
        e->DeleteChild(c);
      }
      c = next;
    }
  }

  void read_inertial(XMLElement* e, const std::string& owner, UrdfXml::Link& link) {
    if (e->FirstChildElement("inertia") == nullptr && e->FirstChildElement("mass") != nullptr) {
      out_.notes.push_back({at(e) + owner, "<inertial> has no <inertia>; taken as a point mass"});
      XMLElement* inertia = e->InsertNewChildElement("inertia");
      for (const char* name : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) {
        inertia->SetAttribute(name, "0");
      }
    }
    if (e == e->Parent()->FirstChildElement("inertial")) return;
    out_.notes.push_back({at(e) + owner, "more than one <inertial>; their sum is used"});
    SpatialInertia inertia;
    Pose pose;
    if (const XMLElement* mass = e->FirstChildElement("mass")) {
      inertia.mass = number(mass, "value").value_or(0.0);
    }
    if (const XMLElement* origin = e->FirstChildElement("origin")) {
      const Vector3 rpy = vector(origin, "rpy");
      pose = {rotation_from_rpy(rpy[0], rpy[1], rpy[2]), vector(origin, "xyz")};
    }
    if (const XMLElement* i = e->FirstChildElement("inertia")) {
      const auto moment = [&](const char* name) { return number(i, name).value_or(0.0); };
      // All are read before the matrix is filled: Eigen aborts if an exception leaves its comma
      // initializer half filled.
      const double xx = moment("ixx"), yy = moment("iyy"), zz = moment("izz");
      const double xy = moment("ixy"), xz = moment("ixz"), yz = moment("iyz");
      inertia.rotational << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    }
    link.further_inertia = link.further_inertia + inertia.transformed(pose);
    e->Parent()->DeleteChild(e);
  }

  void read_bullet_contact(XMLElement* contact, const std::string& owner, SurfaceValues& surface) {
    std::string unused;
    for (XMLElement* c = contact->FirstChildElement(); c != nullptr; c = c->NextSiblingElement()) {
      const std::string kind = c->Name();
      const std::optional<double> value = number(c, "value");
      if (kind == "lateral_friction")
        surface.friction = value;
      else if (kind == "restitution")
        surface.restitution = value;
      else if (kind == "rolling_friction")
        surface.rolling_friction = value;
      else if (kind == "spinning_friction")
        surface.torsional_friction = value;
      else
        unused += fmt::format("{}<{}>", unused.empty() ? "" : ", ", kind);
    }
    if (!unused.empty()) {
      out_.notes.push_back({at(contact) + owner, "<contact>: not used: " + unused});
    }
    contact->Parent()->DeleteChild(contact);
  }

  void read_collision(XMLElement* e, const std::string& owner, UrdfXml::Link& link) {
    UrdfXml::Collision& collision = link.collisions.emplace_back();
    for (XMLElement* c = e->FirstChildElement(); c != nullptr;) {
      XMLElement* next = c->NextSiblingElement();
      const std::string kind = c->Name();
      if (kind == "geometry") {
        XMLElement* shape = c->FirstChildElement();
        if (shape && std::strcmp(shape->Name(), "capsule") == 0) {
          collision.capsule = true;
          shape->SetName("cylinder");
        }
        collision.convex = shape && shape->FirstChildElement("drake:declare_convex");
      } else if (kind == "drake:proximity_properties") {
        read_drake_surface(c, owner, collision.surface);
      } else if (kind != "origin" && kind != "verbose" && kind != "material") {
        note_unused(c, owner + " <collision>");
      }
      c = next;
    }
  }

  void read_drake_surface(XMLElement* e, const std::string& owner, SurfaceValues& surface) {
    for (XMLElement* c = e->FirstChildElement(); c != nullptr; c = c->NextSiblingElement()) {
      const std::string kind = c->Name();
      const std::optional<double> value = number(c, "value");
      const bool resting = kind == "drake:mu_static";  // mu_dynamic takes precedence over it
      if (kind == "drake:mu_dynamic" || (resting && !surface.friction))
        surface.friction = value;
      else if (!resting)
        note_unused(c, owner + " <drake:proximity_properties>");
    }
  }

  void read_joint(XMLElement* e) {
    const char* name = e->Attribute("name");
    if (name == nullptr) throw InputError(at(e) + ": a <joint> needs a name");
    if (out_.joints.count(name) > 0) {
      throw InputError(fmt::format("{}: joint '{}' is there twice (first in line {}); rename one",
                                   at(e), name, out_.joints[name].line));
    }
    out_.joint_names.push_back(name);
    UrdfXml::Joint& joint = out_.joints[name];
    joint.line = e->GetLineNum();
    const char* type = e->Attribute("type");
    if (type != nullptr &&
        (std::strcmp(type, "spherical") == 0 || std::strcmp(type, "ball") == 0)) {
      joint.spherical = true;
      e->SetAttribute("type", "floating");
    }
    read_joint_elements(e, type == nullptr ? "" : type, fmt::format(": joint '{}'", name), joint);
  }

  void read_joint_elements(XMLElement* e, const std::string& type, const std::string& owner,
                           UrdfXml::Joint& joint) {
    static const std::set<std::string> known = {
        "parent", "child", "origin", "axis", "mimic", "safety_controller", "calibration"};
    const bool bounded = type == "revolute" || type == "prismatic";
    if (bounded && e->FirstChildElement("limit") == nullptr) {
      throw InputError(
          fmt::format("{}{}: a {} joint needs <limit lower= upper= effort= velocity=>{}", at(e),
                      owner, type, type == "revolute" ? "; or give it type=\"continuous\"" : ""));
    }
    for (XMLElement* c = e->FirstChildElement(); c != nullptr; c = c->NextSiblingElement()) {
      const std::string kind = c->Name();
      if (known.count(kind) > 0) continue;
      if (kind == "limit") {
        read_limit(c, bounded, owner, joint);
      } else if (kind == "dynamics" || kind == "joint_properties") {
        note_unused_values(c, owner, kind == "dynamics");
      } else if (kind != "hardwareInterface") {
        note_unused(c, owner);
      }
    }
  }

  /// Notes the attributes that are not zero, except damping and friction of <dynamics>
  /// (`standard`).
  void note_unused_values(const XMLElement* e, const std::string& owner, bool standard) {
    std::string unused;
    for (const auto* a = e->FirstAttribute(); a != nullptr; a = a->Next()) {
      const std::string name = a->Name();
      if (standard && (name == "damping" || name == "friction")) continue;
      if (std::strpbrk(a->Value(), "123456789") == nullptr) continue;  // zero, or no number
      unused += fmt::format("{}{}=\"{}\"", unused.empty() ? "" : ", ", name, a->Value());
    }
    if (unused.empty()) return;
    out_.notes.push_back({at(e) + owner, fmt::format("<{}>: not used: {}", e->Name(), unused)});
  }

  /// Reads <limit>; adds effort and velocity if missing, since urdfdom requires them.
  void read_limit(XMLElement* e, bool bounded, const std::string& owner, UrdfXml::Joint& joint) {
    joint.effort_limited = e->Attribute("effort") != nullptr;
    joint.velocity_limited = e->Attribute("velocity") != nullptr;
    if (!joint.effort_limited) e->SetAttribute("effort", "0");
    if (!joint.velocity_limited) e->SetAttribute("velocity", "0");
    joint.bounded = e->Attribute("lower") != nullptr || e->Attribute("upper") != nullptr;
    if (joint.bounded || !bounded) return;
    out_.notes.push_back({at(e) + owner,
                          "<limit> has neither lower nor upper; taken as unlimited (the URDF "
                          "default of 0 for both would lock the joint)"});
  }

  void read_gazebo(XMLElement* e) {
    const char* reference = e->Attribute("reference");
    if (reference == nullptr) return;
    const auto link = out_.links.find(reference);
    if (link == out_.links.end()) return;  // a joint, or an element that is not in this file
    const auto mu = text_number(e->FirstChildElement("mu1")),
               across = text_number(e->FirstChildElement("mu2"));
    if (mu) link->second.surface.friction = mu;
    const bool differ = mu && across && *mu != *across;
    XMLElement* axis = e->FirstChildElement("fdir1");
    if (differ && axis != nullptr && axis->GetText() != nullptr && *mu > 0.0 && *across > 0.0) {
      axis->SetAttribute("xyz", axis->GetText());
      link->second.surface.friction_axis = vector(axis, "xyz");
      link->second.surface.friction_across = *across;
    } else if (differ) {
      out_.notes.push_back(
          {at(e) + fmt::format(": link '{}'", reference),
           fmt::format("mu1 = {} and mu2 = {} without <fdir1>, the direction of mu1; mu1 counts",
                       *mu, *across)});
    }
    SurfaceValues& surface = link->second.surface;
    const auto kp = text_number(e->FirstChildElement("kp")),
               kd = text_number(e->FirstChildElement("kd"));
    if (kp) surface.stiffness = kp;
    if (kd) surface.damping = *kd;
    const XMLElement* weightless = e->FirstChildElement("turnGravityOff");
    if (weightless == nullptr || weightless->GetText() == nullptr) return;
    if (std::strcmp(weightless->GetText(), "true") == 0) {
      note_unused(weightless, fmt::format(": link '{}'", reference));
    }
  }

  void read_transmission(XMLElement* e) {
    const XMLElement* joint = e->FirstChildElement("joint");
    const XMLElement* actuator = e->FirstChildElement("actuator");
    if (joint == nullptr || actuator == nullptr || joint->Attribute("name") == nullptr) return;
    const auto found = out_.joints.find(joint->Attribute("name"));
    if (found == out_.joints.end()) return;
    const XMLElement* rotor = actuator->FirstChildElement("drake:rotor_inertia");
    const XMLElement* gear = actuator->FirstChildElement("drake:gear_ratio");
    if (rotor == nullptr) return;
    const double ratio = gear == nullptr ? 1.0 : number(gear, "value").value_or(1.0);
    found->second.armature = number(rotor, "value").value_or(0.0) * ratio * ratio;
  }

  std::string file_;
  UrdfXml& out_;
  Faults faults_;
};

}  // namespace

UrdfXml read_urdf_xml(const std::filesystem::path& file) {
  UrdfXml out;
  const std::string text =
      expand_optenv(read_xml_file(file, "there is no such file"), file.string(), out.notes);
  tinyxml2::XMLDocument document;
  parse_xml(file, text, document);
  Pass(file, out).read(document);
  tinyxml2::XMLPrinter printer(nullptr, true);
  document.Print(&printer);
  out.standard_xml = printer.CStr();
  return out;
}

}  // namespace counterpoint
