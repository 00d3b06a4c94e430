#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "counterpoint/model/export/numbers.h"
#include "counterpoint/model/robot_files.h"

namespace counterpoint {
namespace {

/// Returns roll, pitch, yaw [rad] (about fixed x, y, z) of a rotation. Roll and pitch follow
/// exactly from the rotation that remains after yaw, even at a pitch of 90 degrees, where yaw is
/// arbitrary.
Vector3 rpy(const Matrix3& R) {
  const double yaw = std::atan2(R(1, 0), R(0, 0)), s = std::sin(yaw), c = std::cos(yaw);
  const Vector3 x = c * R.row(0) + s * R.row(1), y = c * R.row(1) - s * R.row(0);
  return {std::atan2(-y.z(), y.y()), std::atan2(-R(2, 0), x.x()), yaw};
}

class UrdfWriter {
 public:
  UrdfWriter(const Scene& scene, const std::string& mesh_folder)
      : scene_(scene), model_(scene.model), folder_(mesh_folder) {}

  Exported write() {
    refuse();
    xml_.OpenElement("robot");
    set("name", scene_.name.empty() ? "robot" : scene_.name);
    if (!floats_) {
      xml_.OpenElement("link");
      set("name", "world");
      xml_.CloseElement();
    }
    for (int i = 1; i < model_.num_bodies(); ++i) write_link(i);
    for (int i = 1; i < model_.num_bodies(); ++i) write_joint(i);
    write_frames();
    write_transmissions();
    xml_.CloseElement();
    note_lost();
    out_.text = xml_.CStr();
    return std::move(out_);
  }

 private:
  void set(const char* name, const std::string& value) { xml_.PushAttribute(name, value.c_str()); }
  void set(const char* name, double value) { set(name, export_number(value)); }
  void lose(const std::string& where, const std::string& what) {
    out_.lost.push_back({where, what});
  }
  std::string body_name(int i) const { return i == 0 ? "world" : model_.joint(i - 1).link; }
  void write_origin(const Pose& pose) {
    xml_.OpenElement("origin");
    set("xyz", export_numbers(pose.translation));
    set("rpy", export_numbers(rpy(pose.rotation)));
    xml_.CloseElement();
  }
  void write_reference(const char* element, const char* attribute, const std::string& value) {
    xml_.OpenElement(element);
    set(attribute, value);
    xml_.CloseElement();
  }

  void refuse() {
    if (model_.num_trees() == 0) throw InputError("the scene has nothing that moves");
    for (const Tree& tree : model_.trees()) {
      const Body& root = model_.body(tree.body_begin);
      floats_ = floats_ || root.joint_type == JointType::kFloating;
    }
    if (floats_ && model_.num_trees() > 1)
      throw InputError(
          "the scene holds several robots or objects, and a URDF one: export it to MJCF, or take a "
          "scene with one of them");
  }

  void write_link(int i) {
    const SpatialInertia& inertia = model_.body(i).inertia;
    xml_.OpenElement("link");
    set("name", body_name(i));
    if (inertia.mass > 0.0) {
      const Matrix3& I = inertia.rotational;
      xml_.OpenElement("inertial");
      write_origin({Matrix3::Identity(), inertia.center});
      write_reference("mass", "value", export_number(inertia.mass));
      xml_.OpenElement("inertia");
      set("ixx", I(0, 0));
      set("ixy", I(0, 1));
      set("ixz", I(0, 2));
      set("iyy", I(1, 1));
      set("iyz", I(1, 2));
      set("izz", I(2, 2));
      xml_.CloseElement();
      xml_.CloseElement();
    }
    for (const Geometry& g : model_.geometries())
      if (g.body == i) write_geometry(g);
    xml_.CloseElement();
  }

  void write_geometry(const Geometry& g) {
    if (g.shape.type == ShapeType::kPlane || g.shape.type == ShapeType::kTerrain)
      return lose("geometry '" + g.name + "'", "a plane or terrain");
    xml_.OpenElement("collision");
    set("name", g.name.substr(g.name.rfind('/') + 1));
    write_origin(g.X_BG);
    xml_.OpenElement("geometry");
    const Vector3& s = g.shape.size;
    switch (g.shape.type) {
      case ShapeType::kSphere:
        write_reference("sphere", "radius", export_number(s.x()));
        break;
      case ShapeType::kBox:
        write_reference("box", "size", export_numbers(Vector3(2.0 * s)));
        break;
      case ShapeType::kCapsule:
      case ShapeType::kCylinder:
        xml_.OpenElement(g.shape.type == ShapeType::kCapsule ? "capsule" : "cylinder");
        set("radius", s.x());
        set("length", 2.0 * s.y());
        xml_.CloseElement();
        break;
      default:
        write_reference("mesh", "filename", mesh_file(*g.shape.mesh));
    }
    xml_.CloseElement();
    xml_.OpenElement("drake:proximity_properties");
    write_reference("drake:mu_dynamic", "value",
                    export_number(g.material.without_direction().friction));
    xml_.CloseElement();
    xml_.CloseElement();
    const Material& m = g.material;
    if (m.restitution > 0.0 || m.torsional_friction > 0.0 || m.rolling_friction > 0.0)
      lose("geometry '" + g.name + "'", "restitution, torsional or rolling friction");
    if (m.is_directional() || m.friction_at_rest() > m.friction)
      lose("geometry '" + g.name + "'", "the direction of its friction, or static friction");
    if (m.is_soft()) lose("geometry '" + g.name + "'", "the stiffness of its surface");
    if (!m.surface_velocity.isZero(0.0)) lose("geometry '" + g.name + "'", "surface_velocity");
  }

  /// Returns the name of a mesh's OBJ file (17 digits); every mesh is written once.
  std::string mesh_file(const ConvexMesh& mesh) {
    std::string& name = meshes_[&mesh];
    if (!name.empty()) return name;
    name = fmt::format("{}/hull{}.obj", folder_, out_.files.size());
    std::string text;
    for (const Vector3& v : mesh.vertices) text += "v " + export_numbers(v) + "\n";
    for (const std::vector<int>& face : mesh.faces) {
      for (std::size_t k = 2; k < face.size(); ++k)
        text += fmt::format("f {} {} {}\n", face[0] + 1, face[k - 1] + 1, face[k] + 1);
    }
    out_.files.push_back({name, text});
    return name;
  }

  void write_joint(int i) {
    const Body& body = model_.body(i);
    if (body.parent == 0 && floats_) return;
    const JointInfo& info = model_.joint(i - 1);
    xml_.OpenElement("joint");
    set("name", info.name);
    set("type", joint_word(body.joint_type, info));
    write_origin(body.X_PJ);
    write_reference("parent", "link", body_name(body.parent));
    write_reference("child", "link", body_name(i));
    if (body.joint_type != JointType::kSpherical) write_reference("axis", "xyz", "0 0 1");
    const double damping = model_.damping()[body.v_index];
    const double friction = model_.dry_friction()[body.v_index];
    if (model_.breaks_away(body.v_index)) lose("joint '" + info.name + "'", "breakaway_friction");
    if (damping != 0.0 || friction != 0.0) {
      xml_.OpenElement("dynamics");
      set("damping", damping);
      set("friction", friction);
      xml_.CloseElement();
    }
    if (joint_nv(body.joint_type) == 1) write_limit(info);
    for (const Mimic& mimic : model_.mimics()) {
      if (mimic.joint != i - 1) continue;
      xml_.OpenElement("mimic");
      set("joint", model_.joint(mimic.master).name);
      set("multiplier", mimic.multiplier);
      set("offset", mimic.offset);
      xml_.CloseElement();
    }
    xml_.CloseElement();
  }

  static const char* joint_word(JointType type, const JointInfo& info) {
    switch (type) {
      case JointType::kRevolute:
        return std::isfinite(info.lower) || std::isfinite(info.upper) ? "revolute" : "continuous";
      case JointType::kPrismatic:
        return "prismatic";
      case JointType::kPlanar:
        return "planar";
      case JointType::kSpherical:
        return "spherical";
      case JointType::kFloating:
        break;
    }
    return "floating";
  }

  /// Writes the limits of a joint; 1e9 stands for none, since URDF requires effort and velocity.
  void write_limit(const JointInfo& info) {
    constexpr double kBeyond = 1e9;
    xml_.OpenElement("limit");
    if (std::isfinite(info.lower) || std::isfinite(info.upper)) {
      set("lower", std::max(info.lower, -kBeyond));
      set("upper", std::min(info.upper, kBeyond));
    }
    set("effort", std::min(info.effort_limit, kBeyond));
    set("velocity", std::min(info.velocity_limit, kBeyond));
    xml_.CloseElement();
  }

  /// Writes merged links as frames on fixed joints, without inertia: their body has it.
  void write_frames() {
    for (const Frame& frame : model_.frames()) {
      if (frame.name == body_name(frame.body) || (frame.body == 0 && floats_)) continue;
      xml_.OpenElement("link");
      set("name", frame.name);
      xml_.CloseElement();
      xml_.OpenElement("joint");
      set("name", frame.name + "/fixed");
      set("type", "fixed");
      write_origin(frame.X_BF);
      write_reference("parent", "link", body_name(frame.body));
      write_reference("child", "link", frame.name);
      xml_.CloseElement();
    }
  }

  /// Writes the rotor inertia as in Drake's URDFs: behind a gear of ratio 1.
  void write_transmissions() {
    for (int i = 1; i < model_.num_bodies(); ++i) {
      const Body& body = model_.body(i);
      const double armature = model_.armature()[body.v_index];
      if (armature == 0.0 || joint_nv(body.joint_type) != 1) continue;
      const std::string& name = model_.joint(i - 1).name;
      xml_.OpenElement("transmission");
      set("name", name + "/transmission");
      xml_.OpenElement("type");
      xml_.PushText("transmission_interface/SimpleTransmission");
      xml_.CloseElement();
      write_reference("joint", "name", name);
      xml_.OpenElement("actuator");
      set("name", name + "/motor");
      write_reference("drake:rotor_inertia", "value", export_number(armature));
      write_reference("drake:gear_ratio", "value", "1");
      xml_.CloseElement();
      xml_.CloseElement();
    }
  }

  void note_lost() {
    for (const JointSpring& s : model_.springs())
      lose("joint '" + model_.joint(s.joint).name + "'", "a spring");
    for (const JointServo& s : model_.servos())
      lose("joint '" + model_.joint(s.joint).name + "'", "a servo");
    for (const BodyDrag& drag : model_.drags()) lose("link '" + body_name(drag.body) + "'", "drag");
    for (const GravityCompensation& c : model_.gravity_compensations())
      lose("link '" + body_name(c.body) + "'", "gravity compensation");
    for (const Closure& c : model_.closures()) lose("closure '" + c.name + "'", "a closed loop");
    for (const Sensor& s : model_.sensors()) lose("sensor '" + s.name + "'", "a sensor");
    for (const Tendon& t : model_.tendons()) lose("tendon '" + t.name + "'", "a tendon");
    for (const Actuator& a : model_.actuators()) lose("actuator '" + a.name + "'", "an actuator");
    for (const JointInfo& joint : model_.joints())
      if (joint.prescribed) lose("joint '" + joint.name + "'", "its prescribed motion");
    if (!model_.excluded_geometry_pairs().empty())
      lose("scene", "pairs of geometries that do not collide (an SRDF holds these)");
    if (!model_.included_geometry_pairs().empty())
      lose("scene", "pairs of geometries that collide though a joint joins them or they overlap");
    lose("scene", "the start, gravity and options (a scene file holds these)");
  }

  const Scene& scene_;
  const Model& model_;
  std::string folder_;
  bool floats_ = false;
  std::map<const ConvexMesh*, std::string> meshes_;
  tinyxml2::XMLPrinter xml_;
  Exported out_;
};

}  // namespace

Exported export_urdf(const Scene& scene, const std::string& mesh_folder) {
  return UrdfWriter(scene, mesh_folder).write();
}

}  // namespace counterpoint
