#include "counterpoint/model/sdf/urdf_tags.h"

#include <fmt/format.h>

#include <algorithm>
#include <sdf/Joint.hh>
#include <sdf/Link.hh>
#include <sdf/Model.hh>
#include <sdf/World.hh>

#include "counterpoint/model/sdf/motors.h"
#include "counterpoint/model/sdf/sensors.h"

namespace counterpoint::sdf_file {
namespace {

/// Returns the scene's name of a collision LINK/NAME, whose NAME may be Gazebo's: L_collision,
/// L_collision_1 ... of a link L, and X_fixed_joint_lump__N_collision_3 where L was merged into a
/// link X, N being L or the collision's own name; "" if none or several have this name.
std::string find_collision(const RobotSpec& robot, const std::string& name) {
  constexpr std::string_view kEnd = "_collision", kMerged = "_fixed_joint_lump__";
  std::string leaf = name.substr(name.rfind('/') + 1);
  const std::size_t merged = leaf.find(kMerged);
  if (merged != std::string::npos)
    leaf = leaf.substr(merged + kMerged.size(), leaf.rfind(kEnd) - merged - kMerged.size());
  std::vector<std::string> found;
  for (const LinkSpec& link : robot.links)
    for (std::size_t i = 0; i < link.collisions.size(); ++i) {
      const std::string index = std::to_string(i), &own = link.collisions[i].name;
      const std::string here = link.name + "/" + (own.empty() ? index : own);
      if (name == here) return here;
      const bool same = merged != std::string::npos
                            ? leaf == (own.empty() ? link.name : own)
                            : leaf == link.name + "_collision" + (i > 0 ? "_" + index : "");
      if (same) found.push_back(here);
    }
  return found.size() == 1 ? found.front() : "";
}

TreeJoint place_of(const JointSpec& joint) {
  TreeJoint at;
  at.name = joint.name;
  if (!joint.fixed) at.motions = {joint.name};
  at.turns = !joint.fixed && joint.type != JointType::kPrismatic;
  at.inner = joint.parent;
  at.outer = joint.child;
  at.X_IJ = joint.X_PJ;
  return at;
}

std::vector<JointSpec>::iterator joint_named(RobotSpec& robot, const std::string& name) {
  return std::find_if(robot.joints.begin(), robot.joints.end(),
                      [&](const JointSpec& joint) { return joint.name == name; });
}

void read_link(Document& document, const sdf::Link& in, const std::string& name,
               const RobotSpec& robot, std::vector<SensorSpec>& out) {
  const std::size_t first = out.size();
  for (std::uint64_t i = 0; i < in.SensorCount(); ++i)
    read_link_sensor(document, *in.SensorByIndex(i), in.Name(), name, out);
  for (std::size_t k = first; k < out.size(); ++k) {
    SensorSpec& spec = out[k];
    if (spec.link == name) continue;
    const std::string found = find_collision(robot, spec.link);
    if (found.empty())
      document.notes.push_back(
          {spec.where, fmt::format("there is no collision '{}'; all of link '{}' count",
                                   spec.link.substr(name.size() + 1), name)});
    spec.link = found.empty() ? name : found;
  }
}

void read_joint(Document& document, const sdf::Joint& in, const std::string& name, RobotSpec& robot,
                std::vector<SensorSpec>& out) {
  for (std::uint64_t i = 0; i < in.SensorCount(); ++i)
    if (const auto meter = read_joint_sensor(document, *in.SensorByIndex(i), in.Name(), name))
      place_wrench(*meter, place_of(*joint_named(robot, name)), robot, out);
}

void read_plugin(Document& document, const sdf::ElementPtr& plugin, RobotSpec& robot,
                 std::vector<ActuatorSpec>& out) {
  std::vector<ActuatorSpec> motors;
  read_motor(
      document, plugin, [](const std::string& name) { return name; }, motors);
  for (const ActuatorSpec& motor : motors) {
    const auto joint = joint_named(robot, motor.joint);
    if (joint != robot.joints.end() && !joint->fixed)
      out.push_back(motor);
    else
      document.note(plugin, fmt::format("no joint '{}' moves; left out", motor.joint));
  }
}

}  // namespace

void read_tags(const std::filesystem::path& file, const std::string& text,
               const std::vector<std::string>& references, RobotSpec& robot, ModelParts& parts) {
  const SdfOptions options;
  Document document(file, text, options);
  const sdf::World& world = *document.root().WorldByIndex(0);
  for (std::uint64_t i = 0; i < world.ModelCount(); ++i)
    document.faults.collect([&] {
      const sdf::Model& model = *world.ModelByIndex(i);
      const std::string& name = references[i];
      const sdf::ElementPtr plugin = Document::child(model.Element(), "plugin");
      if (plugin)
        read_plugin(document, plugin, robot, parts.commanded);
      else if (const sdf::Joint* joint = model.JointByName("at"))
        read_joint(document, *joint, name, robot, parts.sensors);
      else
        read_link(document, *model.LinkByName("at"), name, robot, parts.sensors);
    });
  document.faults.throw_if_any();
  robot.notes.insert(robot.notes.end(), document.notes.begin(), document.notes.end());
}

}  // namespace counterpoint::sdf_file
