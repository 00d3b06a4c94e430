// Sensors and motors of a URDF: <gazebo> and <transmission>.
#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstring>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/sdf/urdf_tags.h"
#include "counterpoint/model/text_files.h"
#include "counterpoint/model/urdf/optenv.h"

namespace counterpoint {
namespace {

using tinyxml2::XMLElement;

template <class Parts>
bool has(const Parts& parts, const std::string& name) {
  return std::any_of(parts.begin(), parts.end(),
                     [&](const auto& part) { return part.name == name; });
}

/// Appends an SDF model with this element alone, in the line that it has in its file.
void append_model(const XMLElement& e, bool on_joint, std::size_t number, std::string& text) {
  tinyxml2::XMLPrinter printer(nullptr, true);
  e.Accept(&printer);
  const auto lines = std::count(text.begin(), text.end(), '\n');
  if (e.GetLineNum() - 1 > lines)
    text.append(static_cast<std::size_t>(e.GetLineNum() - 1 - lines), '\n');
  const char *before = "<link name='at'>", *after = "</link>";
  if (std::strcmp(e.Name(), "plugin") == 0) {
    before = "<link name='at'/>";
    after = "";
  } else if (on_joint) {
    before =
        "<link name='p'/><link name='c'/><joint name='at' type='fixed'><parent>p</parent>"
        "<child>c</child>";
    after = "</joint>";
  }
  text += fmt::format("<model name='m{}'>{}{}{}</model>", number, before, printer.CStr(), after);
}

/// Notes what transmissions say: no motor, and gears that inputs do not pass.
void note_transmissions(const std::string& file, const XMLElement& root, RobotSpec& robot) {
  int count = 0;
  for (const auto* e = root.FirstChildElement("transmission"); e != nullptr;
       e = e->NextSiblingElement("transmission"), ++count) {
    const XMLElement* joint = e->FirstChildElement("joint");
    const char* name = joint == nullptr ? nullptr : joint->Attribute("name");
    for (const XMLElement* part : {e, e->FirstChildElement("actuator"), joint}) {
      const XMLElement* reduction =
          part == nullptr ? nullptr : part->FirstChildElement("mechanicalReduction");
      if (reduction == nullptr || reduction->DoubleText(1.0) == 1.0) continue;
      robot.notes.push_back(
          {fmt::format("{}:{}", file, reduction->GetLineNum()),
           fmt::format("<mechanicalReduction> {} of joint '{}' is not used: inputs act behind the "
                       "gear; the `armature` of the joint is the rotor's inertia times its square",
                       reduction->GetText(), name == nullptr ? "" : name)});
    }
  }
  if (count > 0)
    robot.notes.push_back(
        {file, fmt::format("<transmission> ({}): no motor by itself; efforts are inputs of the "
                           "joints, and actuators of a scene take other commands",
                           count)});
}

}  // namespace

ModelParts load_urdf_parts(const std::filesystem::path& file, RobotSpec& robot) {
  std::vector<Note> known;  // load_urdf adds them
  tinyxml2::XMLDocument document;
  parse_xml(file, expand_optenv(read_xml_file(file, "there is no such file"), file.string(), known),
            document);
  const XMLElement& root = *document.RootElement();
  std::string text = "<sdf version='1.9'><world name='urdf'>";
  std::vector<std::string> references;
  for (const auto* e = root.FirstChildElement("gazebo"); e != nullptr;
       e = e->NextSiblingElement("gazebo")) {
    const char* attribute = e->Attribute("reference");
    const std::string name = attribute == nullptr ? "" : attribute;
    for (const auto* c = e->FirstChildElement(); c != nullptr; c = c->NextSiblingElement()) {
      const bool sensor = std::strcmp(c->Name(), "sensor") == 0;
      if (!sensor && std::strcmp(c->Name(), "plugin") != 0) continue;
      const bool on_joint = has(robot.joints, name) &&
                            (!has(robot.links, name) || c->Attribute("type", "force_torque"));
      if (!sensor || on_joint || has(robot.links, name)) {
        append_model(*c, on_joint, references.size(), text);
        references.push_back(name);
      } else {
        robot.notes.push_back(
            {fmt::format("{}:{}: <sensor>", file.string(), c->GetLineNum()),
             fmt::format("reference '{}' is no link and no joint; left out", name)});
      }
    }
  }
  note_transmissions(file.string(), root, robot);
  ModelParts parts;
  if (!references.empty())
    sdf_file::read_urdf_tags(file, text + "</world></sdf>", references, robot, parts);
  return parts;
}

}  // namespace counterpoint
