#include "counterpoint/model/sdf/motors.h"

#include <fmt/format.h>

namespace counterpoint::sdf_file {
namespace {

/// A plugin's elements with the defaults of gz-sim.
class Motor {
 public:
  Motor(const Document& document, const sdf::ElementPtr& plugin, Actuator& out)
      : document_(document), plugin_(plugin), out_(out) {}

  /// These complete the actuator, or return the reason why none acts like the plugin.
  std::string read_position() {
    if (Document::flag(plugin_, "use_velocity_commands", false))
      return "with <use_velocity_commands> it sets the speed itself, without a force";
    if (number("cmd_offset", 0.0) != 0.0) return "a PID law has no <cmd_offset>";
    const double least = number("i_min", -1.0), most = number("i_max", 1.0);
    out_.law = ActuatorLaw::kPid;
    out_.kp = number("p_gain", 1.0);
    out_.kd = number("d_gain", 0.01);
    out_.ki = most == 0.0 && least == 0.0 ? 0.0 : number("i_gain", 0.1);
    if (out_.ki != 0.0 && most >= least) {
      if (most != -least) return "<i_min> = -<i_max> is expected";
      out_.integral_limit = most;
    }
    out_.command = number("initial_position", 0.0);
    return read_bounds();
  }

  std::string read_velocity() {
    if (!Document::flag(plugin_, "use_force_commands", false))
      return "without <use_force_commands> it sets the speed itself, without a force";
    if (number("i_gain", 0.0) != 0.0 || number("d_gain", 0.0) != 0.0)
      return "only <p_gain> of a speed has a counterpart";
    out_.gain = out_.damping = number("p_gain", 1.0);
    out_.bias = number("cmd_offset", 0.0);
    out_.command = number("initial_velocity", 0.0);
    return read_bounds();
  }

 private:
  double number(const char* name, double otherwise) const {
    const sdf::ElementPtr e = Document::child(plugin_, name);
    if (!e) return otherwise;
    const std::string text = e->GetValue() ? e->GetValue()->GetAsString() : "";
    const auto value = parse_number(trimmed(text, " \t\r\n"));
    if (!value)
      document_.fail(plugin_, fmt::format("<{}>: '{}': a number is expected", name, text));
    return *value;
  }

  std::string read_bounds() {
    const double least = number("cmd_min", -1000.0), most = number("cmd_max", 1000.0);
    if (most >= least) std::tie(out_.least, out_.most) = std::pair(least, most);
    return "";
  }

  const Document& document_;
  const sdf::ElementPtr& plugin_;
  Actuator& out_;
};

}  // namespace

void read_motor(Document& document, const sdf::ElementPtr& plugin,
                const std::function<std::string(const std::string&)>& named,
                std::vector<ActuatorSpec>& out) {
  const std::string library = plugin->Get<std::string>("filename", "").first,
                    name = plugin->Get<std::string>("name", "").first;
  const auto is = [&](const char* system, const char* stem) {
    return name.ends_with(std::string("systems::") + system) ||
           library.find(std::string(stem) + "-system") != std::string::npos;
  };
  const bool position = is("JointPositionController", "joint-position-controller"),
             velocity = !position && is("JointController", "joint-controller"),
             force = is("ApplyJointForce", "apply-joint-force");
  ActuatorSpec spec;
  std::string why;
  Motor motor(document, plugin, spec.actuator);
  const sdf::ElementPtr joint = Document::child(plugin, "joint_name");
  if (position)
    why = motor.read_position();
  else if (velocity)
    why = motor.read_velocity();
  else if (!force)
    why = "forces that it would apply are inputs here";
  if (why.empty() && (!joint || joint->GetNextElement("joint_name") ||
                      Document::number(plugin, "joint_index", 0.0) != 0.0))
    why = "one <joint_name>, and <joint_index> 0, are expected";
  if (!why.empty())
    return document.note(plugin, fmt::format("plugins do not run: {}: {}", library, why));
  spec.joint = named(std::string(trimmed(joint->Get<std::string>(), " \t\r\n")));
  spec.where = document.where(plugin);
  spec.actuator.name = spec.joint + (position ? "/position" : velocity ? "/velocity" : "/force");
  out.push_back(std::move(spec));
}

}  // namespace counterpoint::sdf_file
