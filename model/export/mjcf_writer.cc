#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "counterpoint/model/export/mjcf_parts.h"
#include "counterpoint/model/export/numbers.h"
#include "counterpoint/model/model.h"
#include "counterpoint/model/robot_files.h"

namespace counterpoint {
namespace {

class MjcfWriter {
 public:
  MjcfWriter(const Scene& scene, const MjcfExport& how)
      : scene_(scene), model_(scene.model), how_(how) {
    if (on(Effect::kClosures)) closures_ = mjcf_closures(model_, out_.lost);
    if (on(Effect::kMimics)) mimics_ = model_.mimics();
    if (on(Effect::kServos)) servos_ = model_.servos();
    const auto friction = [&](const Geometry& g) {
      return acting_surface(g.material, how.effects).friction;
    };
    const auto& all = model_.geometries();
    unlike_ = std::any_of(all.begin(), all.end(),
                          [&](const Geometry& g) { return friction(g) != friction(all.front()); });
    by_pair_ = how.pair_surfaces && (unlike_ || !model_.pair_materials().empty());
  }

  Exported write() {
    xml_.OpenElement("mujoco");
    set("model", scene_.name.empty() ? "scene" : scene_.name);
    write_options();
    write_meshes();
    write_bodies();
    if (on(Effect::kContacts)) write_contacts();
    write_equalities();
    write_rods();
    write_actuators();
    if (how_.start) write_start();
    xml_.CloseElement();
    note_forces();
    out_.text = xml_.CStr();
    return std::move(out_);
  }

 private:
  void set(const char* name, const std::string& value) { xml_.PushAttribute(name, value.c_str()); }
  void set(const char* name, double value) { set(name, export_number(value)); }
  /// Writes an element without children.
  void element(const char* name,
               std::initializer_list<std::pair<const char*, std::string>> attributes) {
    xml_.OpenElement(name);
    for (const auto& [key, value] : attributes) set(key, value);
    xml_.CloseElement();
  }
  void lose(const std::string& where, const std::string& what) {
    out_.lost.push_back({where, what});
  }
  void place(const Pose& pose) {
    set("pos", export_numbers(pose.translation));
    set("quat", export_quaternion(pose.rotation));
  }
  std::string body_name(int i) const { return i == 0 ? "world" : model_.joint(i - 1).link; }
  std::string joint_name(int joint, int part = 0) const {
    const Body& body = model_.body(joint + 1);
    const bool several = !is_free(body) && (body.joint_type == JointType::kPlanar ||
                                            body.joint_type == JointType::kFloating);
    return several ? fmt::format("{}/{}", model_.joint(joint).name, part)
                   : model_.joint(joint).name;
  }
  static bool is_free(const Body& body) {
    return body.joint_type == JointType::kFloating && body.parent == 0;
  }
  bool on(Effect effect) const { return how_.effects.has(effect); }
  Pose start_of(const Body& body) const {
    return joint_pose(body.X_PJ, body.joint_type, scene_.q.data() + body.q_index);
  }

  void write_options() {
    element("compiler", {{"angle", "radian"}, {"inertiafromgeom", "false"}});
    const Vector3 gravity = on(Effect::kGravity) ? model_.gravity() : Vector3(0, 0, 0);
    element("option", {{"timestep", export_number(scene_.options.time_step)},
                       {"gravity", export_numbers(gravity)},
                       {"integrator", how_.integrator},
                       {"cone", "elliptic"},
                       {"impratio", "100"}});
    const std::string reference = export_numbers({2.0 * scene_.options.time_step, 1.0});
    xml_.OpenElement("default");
    for (const char* what : {"geom", "equality"})
      element(what, {{"solref", reference}, {"solimp", "0.9999 0.9999 0.001"}});
    xml_.CloseElement();
  }

  void write_meshes() {
    xml_.OpenElement("asset");
    for (const Geometry& g : model_.geometries()) {
      if (g.shape.type != ShapeType::kConvexMesh || meshes_.count(g.shape.mesh.get())) continue;
      const std::string name = fmt::format("mesh{}", meshes_.size());
      meshes_[g.shape.mesh.get()] = name;
      std::string vertices;
      for (const Vector3& v : g.shape.mesh->vertices) vertices += export_numbers(v) + " ";
      element("mesh", {{"name", name}, {"vertex", vertices}});
    }
    xml_.CloseElement();
  }

  void write_bodies() {
    xml_.OpenElement("worldbody");
    write_contents(0);
    std::vector<int> open = {0};
    for (int i = 1; i < model_.num_bodies(); ++i) {
      const Body& body = model_.body(i);
      for (; open.back() != body.parent; open.pop_back()) xml_.CloseElement();
      xml_.OpenElement("body");
      set("name", body_name(i));
      place(is_free(body) ? start_of(body) : body.X_PJ);
      write_compensation(i);
      write_joints(i);
      write_inertia(body.inertia);
      write_contents(i);
      open.push_back(i);
    }
    for (; open.size() > 1; open.pop_back()) xml_.CloseElement();
    xml_.CloseElement();
  }

  void write_compensation(int body) {
    const CarriedWeight carried = carried_weight(model_, body);
    if (carried.mass != 0.0) set("gravcomp", carried.mass / model_.body(body).inertia.mass);
    if (!carried.at_center)
      lose("link '" + body_name(body) + "'",
           "gravity compensation of a part of it: written as of the whole");
  }

  /// Writes the inertia in principal axes if it is not diagonal: MuJoCo's own diagonalization has a
  /// tolerance of 1e-9.
  void write_inertia(const SpatialInertia& inertia) {
    if (inertia.mass == 0.0) return;
    Pose axes{Matrix3::Identity(), inertia.center};
    Vector3 moments = inertia.rotational.diagonal();
    if (!inertia.rotational.isDiagonal(0.0)) {
      const PrincipalAxes principal = principal_axes(inertia.rotational);
      axes.rotation = principal.axes;
      moments = principal.moments;
    }
    element("inertial", {{"pos", export_numbers(axes.translation)},
                         {"quat", export_quaternion(axes.rotation)},
                         {"mass", export_number(inertia.mass)},
                         {"diaginertia", export_numbers(moments)}});
  }

  /// Writes shapes, frames of merged links and anchors of rods.
  void write_contents(int body) {
    for (const Geometry& g : model_.geometries())
      if (g.body == body) write_geometry(g);
    for (const Frame& frame : model_.frames())
      if (how_.frames && frame.body == body && frame.name != body_name(body))
        write_site(frame.name, frame.X_BF);
    for (const Closure& c : closures_) {
      if (c.type != ClosureType::kDistance) continue;
      if (c.body_a == body) write_site(c.name + "/a", c.X_AC);
      if (c.body_b == body) write_site(c.name + "/b", c.X_BC);
    }
  }

  void write_site(const std::string& name, const Pose& pose) {
    element("site", {{"name", name},
                     {"pos", export_numbers(pose.translation)},
                     {"quat", export_quaternion(pose.rotation)}});
  }

  void write_geometry(const Geometry& g) {
    const auto [type, size] = mjcf_shape(g);
    if (type.empty()) return lose("geometry '" + g.name + "'", "a terrain of triangles");
    xml_.OpenElement("geom");
    set("name", g.name);
    set("type", type);
    if (!size.empty()) set("size", size);
    if (g.shape.type == ShapeType::kConvexMesh) set("mesh", meshes_.at(g.shape.mesh.get()));
    place(g.X_BG);
    if (by_pair_ || !on(Effect::kContacts))
      for (const char* key : {"contype", "conaffinity"}) set(key, "0");
    const Material acting = acting_surface(g.material, how_.effects);
    const Material m = acting.without_direction();
    if (acting.is_directional()) lose("geometry '" + g.name + "'", "the direction of its friction");
    if (m.friction_at_rest() > m.friction) lose("geometry '" + g.name + "'", "static friction");
    if (m.is_soft()) lose("geometry '" + g.name + "'", "the stiffness of its surface");
    if (!m.surface_velocity.isZero(0.0)) lose("geometry '" + g.name + "'", "surface_velocity");
    set("condim", mjcf_dimensions(m));
    set("friction", export_numbers({m.friction, m.torsional_friction, m.rolling_friction}));
    xml_.CloseElement();
    if (m.restitution > 0.0) lose("geometry '" + g.name + "'", "restitution");
  }

  void write_joints(int body) {
    switch (model_.body(body).joint_type) {
      case JointType::kRevolute:
        return write_joint(body, 0, "hinge", "0 0 1");
      case JointType::kPrismatic:
        return write_joint(body, 0, "slide", "0 0 1");
      case JointType::kPlanar:
        write_joint(body, 0, "slide", "1 0 0");
        write_joint(body, 1, "slide", "0 1 0");
        return write_joint(body, 2, "hinge", "0 0 1");
      case JointType::kSpherical:
        return write_joint(body, 0, "ball", nullptr);
      case JointType::kFloating:
        if (is_free(model_.body(body))) return write_joint(body, 0, "free", nullptr);
        write_joint(body, 0, "slide", "1 0 0");
        write_joint(body, 1, "slide", "0 1 0");
        write_joint(body, 2, "slide", "0 0 1");
        return write_joint(body, 3, "ball", nullptr);
    }
  }

  void write_joint(int body, int part, const char* type, const char* axis) {
    const int i = body - 1, v = model_.body(body).v_index + part;
    const JointInfo& info = model_.joint(i);
    xml_.OpenElement("joint");
    set("name", joint_name(i, part));
    set("type", type);
    if (axis) set("axis", axis);
    const auto set_if = [&](Effect effect, const char* name, double value) {
      if (on(effect) && value != 0.0) set(name, value);
    };
    set_if(Effect::kDamping, "damping", model_.damping()[v]);
    set_if(Effect::kArmature, "armature", model_.armature()[v]);
    set_if(Effect::kDryFriction, "frictionloss", model_.dry_friction()[v]);
    for (const JointSpring& spring : model_.springs()) {
      if (spring.joint != i) continue;
      set_if(Effect::kSprings, "stiffness", spring.stiffness);
      set_if(Effect::kSprings, "springref", spring.reference);
    }
    if (on(Effect::kLimits) && (std::isfinite(info.lower) || std::isfinite(info.upper))) {
      constexpr double kBeyond = 1e9;  // stands for no limit: MJCF has both limits or none
      set("limited", "true");
      set("range", export_numbers({std::max(info.lower, -kBeyond), std::min(info.upper, kBeyond)}));
    }
    if (on(Effect::kEffortLimits) && std::isfinite(info.effort_limit) &&
        joint_nv(model_.body(body).joint_type) == 1) {
      set("actuatorfrclimited", "true");
      set("actuatorfrcrange", export_numbers({-info.effort_limit, info.effort_limit}));
    }
    xml_.CloseElement();
    velocity_limits_ +=
        on(Effect::kVelocityLimits) && part == 0 && std::isfinite(info.velocity_limit);
  }

  void write_contacts() {
    IndexPairs apart(how_.apart.begin(), how_.apart.end());
    const auto& never = model_.excluded_geometry_pairs();
    apart.insert(never.begin(), never.end());
    const MjcfPairs pairs = list_mjcf_pairs(model_, apart, by_pair_);
    xml_.OpenElement("contact");
    for (const auto& [i, j] : pairs.excluded_bodies)
      element("exclude", {{"body1", body_name(i)}, {"body2", body_name(j)}});
    for (const auto& [a, b] : pairs.listed) write_pair(a, b);
    xml_.CloseElement();
    const auto& given = model_.pair_materials();
    const auto is_listed = [&](const PairMaterial& p) {
      return pairs.listed.count({p.geometry_a, p.geometry_b}) > 0;
    };
    if (!std::all_of(given.begin(), given.end(), is_listed))
      lose("scene", "surface values of pairs of geometries");
    if (unlike_ && !by_pair_)
      lose("scene", "friction of unlike surfaces is their mean here, the larger one in MuJoCo");
  }

  void write_pair(int a, int b) {
    const Material acting = acting_surface(model_.pair_material(a, b), how_.effects);
    const Material m = acting.without_direction();
    if (model_.find_pair_material(a, b) != nullptr &&
        (acting.is_directional() || m.friction_at_rest() > m.friction || m.is_soft()))
      lose("pair '" + model_.geometries()[a].name + "', '" + model_.geometries()[b].name + "'",
           "the direction of its friction, static friction or stiffness");
    // MuJoCo requires a positive coefficient even where it has no effect.
    const double slide = m.friction > 0.0 ? m.friction : 1.0;
    const double spin = m.torsional_friction, roll = m.rolling_friction;
    element("pair", {{"geom1", model_.geometries()[a].name},
                     {"geom2", model_.geometries()[b].name},
                     {"condim", mjcf_dimensions(m)},
                     {"friction", export_numbers({slide, slide, spin, roll, roll})}});
  }

  void write_equalities() {
    xml_.OpenElement("equality");
    for (const Closure& c : closures_) {
      const bool swapped = c.body_a == 0;  // MuJoCo accepts the world as the second body only
      if (c.type == ClosureType::kDistance) {
        element("tendon", {{"name", c.name}, {"tendon1", c.name}});
        continue;
      }
      const bool ball = c.type == ClosureType::kBall;
      xml_.OpenElement(ball ? "connect" : "weld");
      set("name", c.name);
      set("body1", body_name(swapped ? c.body_b : c.body_a));
      set("body2", body_name(swapped ? 0 : c.body_b));
      if (ball) {
        set("anchor", export_numbers(swapped ? c.X_BC.translation : c.X_AC.translation));
      } else {
        const Pose X_12 = swapped ? c.X_BC * c.X_AC.inverse() : c.X_AC * c.X_BC.inverse();
        set("relpose", export_numbers(X_12.translation) + " " + export_quaternion(X_12.rotation));
      }
      xml_.CloseElement();
    }
    for (const Mimic& mimic : mimics_) {
      element("joint",
              {{"joint1", joint_name(mimic.joint)},
               {"joint2", joint_name(mimic.master)},
               {"polycoef", export_numbers({mimic.offset, mimic.multiplier, 0.0, 0.0, 0.0})}});
    }
    xml_.CloseElement();
  }

  /// Writes distance closures as tendons; write_equalities fixes their length.
  void write_rods() {
    xml_.OpenElement("tendon");
    for (const Closure& c : closures_) {
      if (c.type != ClosureType::kDistance) continue;
      xml_.OpenElement("spatial");
      set("name", c.name);
      for (const char* end : {"/a", "/b"}) element("site", {{"site", c.name + end}});
      xml_.CloseElement();
    }
    xml_.CloseElement();
  }

  /// Writes servos as actuators with force kp (control - q) - kd w.
  void write_actuators() {
    xml_.OpenElement("actuator");
    for (const JointServo& servo : servos_) {
      element("general", {{"name", model_.joint(servo.joint).name},
                          {"joint", joint_name(servo.joint)},
                          {"gainprm", export_numbers({servo.stiffness, 0.0, 0.0})},
                          {"biastype", "affine"},
                          {"biasprm", export_numbers({0.0, -servo.stiffness, -servo.damping})}});
      if (servo.velocity != 0.0)
        lose("joint '" + model_.joint(servo.joint).name + "'", "the target velocity of its servo");
    }
    xml_.CloseElement();
  }

  /// Writes the initial state; free bodies in world axes, as in MuJoCo.
  void write_start() {
    std::string q, v, control;
    const auto append = [](std::string& to, double value) { to += export_number(value) + " "; };
    for (const Body& body : model_.bodies()) {
      if (body.parent < 0) continue;
      if (!is_free(body)) {
        for (int k = 0; k < joint_nq(body.joint_type); ++k) append(q, scene_.q[body.q_index + k]);
        for (int k = 0; k < joint_nv(body.joint_type); ++k) append(v, scene_.v[body.v_index + k]);
        continue;
      }
      const Pose X = start_of(body);
      q += export_numbers(X.translation) + " " + export_quaternion(X.rotation) + " ";
      v += export_numbers(Vector3(body.X_PJ.rotation * scene_.v.segment<3>(body.v_index))) + " " +
           export_numbers(Vector3(scene_.v.segment<3>(body.v_index + 3))) + " ";
    }
    for (const JointServo& servo : servos_) append(control, servo.position);
    xml_.OpenElement("keyframe");
    xml_.OpenElement("key");
    set("name", "start");
    set("qpos", q);
    set("qvel", v);
    if (!control.empty()) set("ctrl", control);
    xml_.CloseElement();
    xml_.CloseElement();
  }

  void note_forces() {
    if (velocity_limits_ > 0)
      lose("scene", fmt::format("velocity limits of {} joints", velocity_limits_));
    for (const Note& lost : lost_parts(model_)) lose(lost.where, lost.message);
    if (!on(Effect::kDrag)) return;
    for (const BodyDrag& drag : model_.drags()) lose("link '" + body_name(drag.body) + "'", "drag");
  }

  const Scene& scene_;
  const Model& model_;
  const MjcfExport& how_;
  std::vector<Closure> closures_;
  std::vector<Mimic> mimics_;
  std::vector<JointServo> servos_;
  bool unlike_ = false;   ///< some surfaces differ in friction
  bool by_pair_ = false;  ///< only the listed pairs collide
  std::map<const ConvexMesh*, std::string> meshes_;
  int velocity_limits_ = 0;
  tinyxml2::XMLPrinter xml_;
  Exported out_;
};

}  // namespace

Exported export_mjcf(const Scene& scene, const MjcfExport& how) {
  return MjcfWriter(scene, how).write();
}

}  // namespace counterpoint
