#include <algorithm>
#include <cmath>
#include <map>

#include "counterpoint/model/export/mjcf_actuators.h"
#include "counterpoint/model/export/mjcf_parts.h"
#include "counterpoint/model/export/mjcf_sensors.h"
#include "counterpoint/model/export/mjcf_tendons.h"
#include "counterpoint/model/export/mjcf_xml.h"
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
    const auto friction = [&](const Geometry& g) {
      return acting_surface(g.material, how.effects).friction;
    };
    const auto& all = model_.geometries();
    unlike_ = std::any_of(all.begin(), all.end(),
                          [&](const Geometry& g) { return friction(g) != friction(all.front()); });
    by_pair_ = how.pair_surfaces && (unlike_ || !model_.pair_materials().empty());
  }

  Exported write() {
    xml_.open("mujoco");
    xml_.set("model", scene_.name.empty() ? "scene" : scene_.name);
    write_options();
    write_meshes();
    write_bodies();
    if (on(Effect::kContacts)) write_contacts();
    write_equalities();
    write_mjcf_tendons(model_, closures_, on(Effect::kTendons), xml_, out_.lost);
    controls_ = write_mjcf_actuators(model_, how_.effects, xml_, out_.lost);
    if (how_.frames) write_mjcf_sensors(model_, how_.effects, controls_.written, xml_, out_.lost);
    if (how_.start) write_start();
    xml_.close();
    note_forces();
    out_.text = xml_.text();
    return std::move(out_);
  }

 private:
  void lose(const std::string& where, const std::string& what) {
    out_.lost.push_back({where, what});
  }
  void place(const Pose& pose) {
    xml_.set("pos", export_numbers(pose.translation));
    xml_.set("quat", export_quaternion(pose.rotation));
  }
  std::string body_name(int i) const { return mjcf_body_name(model_, i); }
  bool on(Effect effect) const { return how_.effects.has(effect); }
  Pose start_of(const Body& body) const {
    return joint_pose(body.X_PJ, body.joint_type, scene_.q.data() + body.q_index);
  }

  void write_options() {
    xml_.element("compiler", {{"angle", "radian"}, {"inertiafromgeom", "false"}});
    const Vector3 gravity = on(Effect::kGravity) ? model_.gravity() : Vector3(0, 0, 0);
    xml_.element("option", {{"timestep", export_number(scene_.options.time_step)},
                            {"gravity", export_numbers(gravity)},
                            {"integrator", how_.integrator},
                            {"cone", "elliptic"},
                            {"impratio", "100"}});
    const std::string reference = export_numbers({2.0 * scene_.options.time_step, 1.0});
    xml_.open("default");
    for (const char* what : {"geom", "equality"})
      xml_.element(what, {{"solref", reference}, {"solimp", "0.9999 0.9999 0.001"}});
    xml_.close();
  }

  void write_meshes() {
    xml_.open("asset");
    for (const Geometry& g : model_.geometries()) {
      if (g.shape.type != ShapeType::kConvexMesh || meshes_.count(g.shape.mesh.get())) continue;
      const std::string name = fmt::format("mesh{}", meshes_.size());
      meshes_[g.shape.mesh.get()] = name;
      std::string vertices;
      for (const Vector3& v : g.shape.mesh->vertices) vertices += export_numbers(v) + " ";
      xml_.element("mesh", {{"name", name}, {"vertex", vertices}});
    }
    xml_.close();
  }

  void write_bodies() {
    xml_.open("worldbody");
    write_contents(0);
    std::vector<int> open = {0};
    for (int i = 1; i < model_.num_bodies(); ++i) {
      const Body& body = model_.body(i);
      for (; open.back() != body.parent; open.pop_back()) xml_.close();
      xml_.open("body");
      xml_.set("name", body_name(i));
      place(is_free_in_mjcf(body) ? start_of(body) : body.X_PJ);
      write_compensation(i);
      write_joints(i);
      write_inertia(body.inertia);
      write_contents(i);
      open.push_back(i);
    }
    for (; open.size() > 1; open.pop_back()) xml_.close();
    xml_.close();
  }

  void write_compensation(int body) {
    const CarriedWeight carried = carried_weight(model_, body);
    if (carried.mass != 0.0) xml_.set("gravcomp", carried.mass / model_.body(body).inertia.mass);
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
    xml_.element("inertial", {{"pos", export_numbers(axes.translation)},
                              {"quat", export_quaternion(axes.rotation)},
                              {"mass", export_number(inertia.mass)},
                              {"diaginertia", export_numbers(moments)}});
  }

  /// Writes shapes, frames of merged links, and sites and wraps that other elements name.
  void write_contents(int body) {
    for (const Geometry& g : model_.geometries())
      if (g.body == body) write_geometry(g);
    for (const Frame& frame : model_.frames())
      if (how_.frames && frame.body == body && frame.name != body_name(body))
        xml_.site(frame.name, frame.X_BF);
    write_mjcf_anchors(model_, closures_, body, xml_);
    write_mjcf_actuator_sites(model_, how_.effects, body, xml_);
    if (how_.frames) write_mjcf_sensor_sites(model_, body, xml_);
  }

  void write_geometry(const Geometry& g) {
    const auto [type, size] = mjcf_shape(g);
    if (type.empty()) return lose("geometry '" + g.name + "'", "a terrain of triangles");
    xml_.open("geom");
    xml_.set("name", g.name);
    xml_.set("type", type);
    if (!size.empty()) xml_.set("size", size);
    if (g.shape.type == ShapeType::kConvexMesh) xml_.set("mesh", meshes_.at(g.shape.mesh.get()));
    place(g.X_BG);
    if (by_pair_ || !on(Effect::kContacts))
      for (const char* key : {"contype", "conaffinity"}) xml_.set(key, "0");
    const Material acting = acting_surface(g.material, how_.effects);
    const Material m = acting.without_direction();
    if (acting.is_directional()) lose("geometry '" + g.name + "'", "the direction of its friction");
    if (m.friction_at_rest() > m.friction) lose("geometry '" + g.name + "'", "static friction");
    if (m.is_soft()) lose("geometry '" + g.name + "'", "the stiffness of its surface");
    if (!m.surface_velocity.isZero(0.0)) lose("geometry '" + g.name + "'", "surface_velocity");
    xml_.set("condim", mjcf_dimensions(m));
    xml_.set("friction", export_numbers({m.friction, m.torsional_friction, m.rolling_friction}));
    xml_.close();
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
        if (is_free_in_mjcf(model_.body(body))) return write_joint(body, 0, "free", nullptr);
        write_joint(body, 0, "slide", "1 0 0");
        write_joint(body, 1, "slide", "0 1 0");
        write_joint(body, 2, "slide", "0 0 1");
        return write_joint(body, 3, "ball", nullptr);
    }
  }

  void write_joint(int body, int part, const char* type, const char* axis) {
    const int i = body - 1, v = model_.body(body).v_index + part;
    const JointInfo& info = model_.joint(i);
    xml_.open("joint");
    xml_.set("name", mjcf_joint_name(model_, i, part));
    xml_.set("type", type);
    if (axis) xml_.set("axis", axis);
    const auto set_if = [&](Effect effect, const char* name, double value) {
      if (on(effect) && value != 0.0) xml_.set(name, value);
    };
    set_if(Effect::kDamping, "damping", model_.damping()[v]);
    set_if(Effect::kArmature, "armature", model_.armature()[v]);
    set_if(Effect::kDryFriction, "frictionloss", model_.dry_friction()[v]);
    if (on(Effect::kDryFriction) && on(Effect::kBreakawayFriction) && part == 0 &&
        model_.breaks_away(v))
      lose("joint '" + info.name + "'", "breakaway_friction");
    for (const JointSpring& spring : model_.springs()) {
      if (spring.joint != i) continue;
      set_if(Effect::kSprings, "stiffness", spring.stiffness);
      set_if(Effect::kSprings, "springref", spring.reference);
    }
    const bool ball = model_.body(body).joint_type == JointType::kSpherical;
    if (on(Effect::kLimits) && (std::isfinite(info.lower) || std::isfinite(info.upper))) {
      xml_.set("limited", "true");
      xml_.set("range", mjcf_range(ball ? 0.0 : info.lower, info.upper));
    }
    if (on(Effect::kEffortLimits) && std::isfinite(info.effort_limit) &&
        joint_nv(model_.body(body).joint_type) == 1 && !has_drives_in_mjcf(model_, how_.effects)) {
      xml_.set("actuatorfrclimited", "true");
      xml_.set("actuatorfrcrange", export_numbers({-info.effort_limit, info.effort_limit}));
    }
    xml_.close();
    velocity_limits_ +=
        on(Effect::kVelocityLimits) && part == 0 && std::isfinite(info.velocity_limit);
  }

  void write_contacts() {
    IndexPairs apart(how_.apart.begin(), how_.apart.end());
    const auto& never = model_.excluded_geometry_pairs();
    apart.insert(never.begin(), never.end());
    const MjcfPairs pairs = list_mjcf_pairs(model_, apart, by_pair_);
    xml_.open("contact");
    for (const auto& [i, j] : pairs.excluded_bodies)
      xml_.element("exclude", {{"body1", body_name(i)}, {"body2", body_name(j)}});
    for (const auto& [a, b] : pairs.listed) write_pair(a, b);
    xml_.close();
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
    xml_.element("pair", {{"geom1", model_.geometries()[a].name},
                          {"geom2", model_.geometries()[b].name},
                          {"condim", mjcf_dimensions(m)},
                          {"friction", export_numbers({slide, slide, spin, roll, roll})}});
  }

  void write_equalities() {
    xml_.open("equality");
    for (const Closure& c : closures_) {
      const bool swapped = c.body_a == 0;  // MuJoCo accepts the world as the second body only
      if (c.type == ClosureType::kDistance) {
        xml_.element("tendon", {{"name", c.name}, {"tendon1", mjcf_rod_name(model_, c)}});
        continue;
      }
      const bool ball = c.type == ClosureType::kBall;
      xml_.open(ball ? "connect" : "weld");
      xml_.set("name", c.name);
      xml_.set("body1", body_name(swapped ? c.body_b : c.body_a));
      xml_.set("body2", body_name(swapped ? 0 : c.body_b));
      if (ball) {
        xml_.set("anchor", export_numbers(swapped ? c.X_BC.translation : c.X_AC.translation));
      } else {
        const Pose X_12 = swapped ? c.X_BC * c.X_AC.inverse() : c.X_AC * c.X_BC.inverse();
        xml_.set("relpose",
                 export_numbers(X_12.translation) + " " + export_quaternion(X_12.rotation));
      }
      xml_.close();
    }
    for (const Mimic& mimic : mimics_) {
      xml_.element("joint",
                   {{"joint1", mjcf_joint_name(model_, mimic.joint)},
                    {"joint2", mjcf_joint_name(model_, mimic.master)},
                    {"polycoef", export_numbers({mimic.offset, mimic.multiplier, 0.0, 0.0, 0.0})}});
    }
    xml_.close();
  }

  /// Writes the initial state; free bodies in world axes, as in MuJoCo.
  void write_start() {
    std::string q, v, control, activation;
    const auto append = [](std::string& to, double value) { to += export_number(value) + " "; };
    for (const Body& body : model_.bodies()) {
      if (body.parent < 0) continue;
      if (!is_free_in_mjcf(body)) {
        for (int k = 0; k < joint_nq(body.joint_type); ++k) append(q, scene_.q[body.q_index + k]);
        for (int k = 0; k < joint_nv(body.joint_type); ++k) append(v, scene_.v[body.v_index + k]);
        continue;
      }
      const Pose X = start_of(body);
      q += export_numbers(X.translation) + " " + export_quaternion(X.rotation) + " ";
      v += export_numbers(Vector3(body.X_PJ.rotation * scene_.v.segment<3>(body.v_index))) + " " +
           export_numbers(Vector3(scene_.v.segment<3>(body.v_index + 3))) + " ";
    }
    for (const double value : controls_.control) append(control, value);
    for (const double value : controls_.activation) append(activation, value);
    xml_.open("keyframe");
    xml_.open("key");
    xml_.set("name", "start");
    xml_.set("qpos", q);
    xml_.set("qvel", v);
    if (!activation.empty()) xml_.set("act", activation);
    if (!control.empty()) xml_.set("ctrl", control);
    xml_.close();
    xml_.close();
  }

  void note_forces() {
    for (const JointInfo& joint : model_.joints())
      if (joint.prescribed) lose("joint '" + joint.name + "'", "its prescribed motion");
    if (velocity_limits_ > 0)
      lose("scene", fmt::format("velocity limits of {} joints", velocity_limits_));
    if (!on(Effect::kDrag)) return;
    for (const BodyDrag& drag : model_.drags()) lose("link '" + body_name(drag.body) + "'", "drag");
  }

  const Scene& scene_;
  const Model& model_;
  const MjcfExport& how_;
  std::vector<Closure> closures_;
  std::vector<Mimic> mimics_;
  MjcfControls controls_;  ///< at the start
  bool unlike_ = false;    ///< some surfaces differ in friction
  bool by_pair_ = false;   ///< only the listed pairs collide
  std::map<const ConvexMesh*, std::string> meshes_;
  int velocity_limits_ = 0;
  MjcfXml xml_;
  Exported out_;
};

}  // namespace

Exported export_mjcf(const Scene& scene, const MjcfExport& how) {
  return MjcfWriter(scene, how).write();
}

}  // namespace counterpoint
