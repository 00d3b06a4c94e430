#include "report/part_tables.h"

namespace counterpoint::apps {

Json closure_json(const Closure& closure, const ClosureGap& gap) {
  Json out = {{"name", closure.name},
              {"type", closure_type_name(closure.type)},
              {"anchor_a_m", vector_json(closure.X_AC.translation)},
              {"anchor_b_m", vector_json(closure.X_BC.translation)},
              {"open_m", gap.distance},
              {"open_rad", gap.angle}};
  if (closure.type == ClosureType::kDistance) {
    out["length_m"] = closure.length;
    out["rope"] = closure.rope;
  }
  if (closure.type == ClosureType::kScrew) out["pitch_m"] = closure.pitch;
  if (closure.switched) {
    out["attached"] = closure.attached;
    out["in_place"] = closure.in_place;
    out["breaking_force_N"] = closure.breaking_force;
    out["breaking_torque_N_m"] = closure.breaking_torque;
  }
  if (closure.linear.acts) {
    out["stiffness_N_m"] = vector_json(closure.linear.stiffness);
    out["damping_N_s_m"] = vector_json(closure.linear.damping);
  }
  if (closure.angular.acts) {
    out["rotational_stiffness_N_m_rad"] = vector_json(closure.angular.stiffness);
    out["rotational_damping_N_m_s_rad"] = vector_json(closure.angular.damping);
  }
  return out;
}

Json joint_forces_json(const Model& model, int joint) {
  Json json = {{"stiffness", nullptr},       {"reference", nullptr},
               {"servo_stiffness", nullptr}, {"servo_damping", nullptr},
               {"servo_position", nullptr},  {"servo_velocity", nullptr}};
  for (const JointSpring& spring : model.springs())
    if (spring.joint == joint)
      json.update({{"stiffness", spring.stiffness}, {"reference", spring.reference}});
  if (const int found = model.find_servo(joint); found >= 0) {
    const JointServo& servo = model.servos()[found];
    json.update({{"servo_stiffness", servo.stiffness},
                 {"servo_damping", servo.damping},
                 {"servo_position", servo.position},
                 {"servo_velocity", servo.velocity}});
  }
  return json;
}

void report_tendons(const Model& model, Report& report) {
  if (model.tendons().empty()) return;
  Json list = Json::array();
  report.print("\ntendons:\n");
  const std::vector<Pose> X_WB = body_poses(model, model.default_q());
  for (const Tendon& tendon : model.tendons()) {
    const double length = tendon_length(model, tendon, model.default_q(), X_WB);
    report.print("  {:<28} {}, length {:.6g} m; stiffness {:.4g} N/m, damping {:.4g} N s/m\n",
                 tendon.name, tendon.is_spatial() ? "path" : "joints", length, tendon.stiffness,
                 tendon.damping);
    list.push_back({{"name", tendon.name},
                    {"spatial", tendon.is_spatial()},
                    {"length_m", length},
                    {"stiffness_N_m", tendon.stiffness},
                    {"damping_N_s_m", tendon.damping},
                    {"dry_friction_N", tendon.dry_friction},
                    {"servo_stiffness_N_m", tendon.servo.stiffness},
                    {"servo_damping_N_s_m", tendon.servo.damping}});
  }
  report["tendons"] = list;
}

namespace {

const char* law_name(ActuatorLaw law) {
  switch (law) {
    case ActuatorLaw::kAffine:
      return "affine";
    case ActuatorLaw::kPid:
      return "pid";
    case ActuatorLaw::kDcMotor:
      return "dc_motor";
    case ActuatorLaw::kMuscle:
      return "muscle";
    case ActuatorLaw::kPropeller:
      return "propeller";
  }
  return "";
}

/// Kind and name of the part that an actuator acts on.
std::pair<const char*, std::string> place_of(const Model& model, const Actuator& a) {
  switch (a.transmission) {
    case Transmission::kJoint:
      return {"joint", model.joint(a.joint).name};
    case Transmission::kTendon:
      return {"tendon", model.tendons()[static_cast<std::size_t>(a.tendon)].name};
    case Transmission::kLink:
      break;
    case Transmission::kAdhesion:
      return {"adhesion", model.frames()[static_cast<std::size_t>(a.frame)].name};
  }
  return {"link", model.frames()[static_cast<std::size_t>(a.frame)].name};
}

}  // namespace

void report_actuators(const Model& model, Report& report) {
  if (model.actuators().empty()) return;
  Json list = Json::array();
  report.print("\nactuators:\n");
  for (const Actuator& a : model.actuators()) {
    const auto [kind, name] = place_of(model, a);
    report.print("  {:<28} {} on {} {}, gear {:.6g}, command {:.6g}, {} internal states\n", a.name,
                 law_name(a.law), kind, name, a.gear, a.command, a.num_states());
    list.push_back({{"name", a.name},
                    {"law", law_name(a.law)},
                    {"acts_on", kind},
                    {"place", name},
                    {"gear", a.gear},
                    {"command", a.command},
                    {"internal_states", a.num_states()}});
  }
  report["actuators"] = list;
}

}  // namespace counterpoint::apps
