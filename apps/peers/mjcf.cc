#include "mjcf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "counterpoint/engine/effects.h"
#include "counterpoint/model/model.h"
#include "mjcf_words.h"

namespace counterpoint::peers {
namespace {

/// Writes the document of one scene.
class Writer {
 public:
  Writer(const Scene& scene, MujocoSettings settings, const std::string& integrator)
      : scene_(scene),
        model_(scene.model),
        collider_(scene.model),
        called_(called_for(model_, collider_)),
        on_(active_effects(called_, scene.options.effects)),
        best_(settings == MujocoSettings::kBest),
        rk4_(settings == MujocoSettings::kRungeKutta4),
        elliptic_(settings == MujocoSettings::kElliptic),
        integrator_(integrator) {}

  std::string write() {
    refuse();
    by_surface_ = on_.has(Effect::kContacts) && same_surfaces();
    out_ = "<mujoco model='scene'>\n";
    options();
    assets();
    bodies();
    contacts();
    equalities();
    tendons();
    actuators();
    return out_ + "</mujoco>\n";
  }

 private:
  template <class... Args>
  void line(fmt::format_string<Args...> format, Args&&... args) {
    out_ += fmt::format(format, std::forward<Args>(args)...) + "\n";
  }

  void refuse() const {
    if (called_.has(Effect::kCoriolis) && !on_.has(Effect::kCoriolis))
      throw NotExpressible("MuJoCo always has Coriolis forces");
    if (on_.has(Effect::kRestitution)) throw NotExpressible("MuJoCo has no restitution");
    if (on_.has(Effect::kVelocityLimits)) throw NotExpressible("MuJoCo has no velocity limits");
    for (const Geometry& g : model_.geometries()) {
      if (g.shape.type == ShapeType::kTerrain)
        throw NotExpressible("MuJoCo has no terrain of triangles");
      if (g.shape.type == ShapeType::kPlane && g.body != 0)
        throw NotExpressible("MuJoCo has planes on the world only");
    }
    if (!on_.has(Effect::kDrag)) return;
    for (const BodyDrag& drag : model_.drags()) {
      if (!is_free(model_.body(drag.body)) || drag.drag.quadratic > 0.0 ||
          drag.drag.angular_quadratic > 0.0 || !drag.center.isZero())
        throw NotExpressible(
            "MuJoCo has no such drag; only linear drag of free bodies is the same");
    }
  }

  void options() {
    const Vector3 gravity = on_.has(Effect::kGravity) ? model_.gravity() : Vector3(0, 0, 0);
    const double h = scene_.options.time_step;
    line("<compiler angle='radian' inertiafromgeom='false' balanceinertia='false'/>");
    const std::string common = fmt::format("timestep='{:.17g}' gravity='{}'", h, text(gravity));
    if (!best_) {
      line("<option {}{}{}/>", common, rk4_ ? " integrator='RK4'" : "",
           elliptic_ ? " cone='elliptic'" : "");
      return;
    }
    line(
        "<option {} integrator='{}' cone='elliptic' impratio='100' solver='Newton' "
        "tolerance='1e-12' iterations='1000'><flag multiccd='enable'/></option>",
        common, integrator_);
    const std::string impedance = "0.9999 0.9999 0.001";
    const std::string reference = fmt::format("{:.17g} 1", 2.0 * h);
    line("<default>");
    for (const char* what : {"geom", "pair", "equality"})
      line("<{} solimp='{}' solref='{}'/>", what, impedance, reference);
    line("<joint solimplimit='{0}' solreflimit='{1}' solimpfriction='{0}' solreffriction='{1}'/>",
         impedance, reference);
    line("</default>");
  }

  void assets() {
    line("<asset>");
    for (const Geometry& g : model_.geometries()) {
      if (g.shape.type != ShapeType::kConvexMesh || meshes_.count(g.shape.mesh.get())) continue;
      const std::size_t id = meshes_.size();
      meshes_[g.shape.mesh.get()] = id;
      std::string vertices;
      for (const Vector3& v : g.shape.mesh->vertices) vertices += text(v) + " ";
      line("<mesh name='m{}' vertex='{}'/>", id, vertices);
    }
    line("</asset>");
  }

  void bodies() {
    line("<worldbody>");
    body_contents(0);
    std::vector<int> open = {0};
    for (int i = 1; i < model_.num_bodies(); ++i) {
      const Body& body = model_.body(i);
      for (; open.back() != body.parent; open.pop_back()) line("</body>");
      Pose pose = body.X_PJ;
      if (is_free(body))
        pose = joint_pose(body.X_PJ, body.joint_type, scene_.q.data() + body.q_index);
      line("<body name='b{}'{} {}>", i, gravcomp(model_, i), placed(pose));
      joints(i);
      inertia(body.inertia);
      body_contents(i);
      open.push_back(i);
    }
    for (; open.size() > 1; open.pop_back()) line("</body>");
    line("</worldbody>");
  }

  /// Writes the inertia in principal axes, because MuJoCo's own search for them stops at 1e-9.
  void inertia(const SpatialInertia& I) {
    Pose axes{Matrix3::Identity(), I.center};
    Vector3 moments = I.rotational.diagonal();
    if (!I.rotational.isDiagonal(0.0)) {
      const PrincipalAxes principal = principal_axes(I.rotational);
      axes.rotation = principal.axes;
      moments = principal.moments;
    }
    line("<inertial {} mass='{:.17g}' diaginertia='{}'/>", placed(axes), I.mass, text(moments));
  }

  /// Writes the shapes of a body and the anchors of rods.
  void body_contents(int body) {
    const auto& geometries = model_.geometries();
    for (std::size_t i = 0; i < geometries.size(); ++i) {
      if (geometries[i].body == body) geometry(i);
    }
    const auto& closures = model_.closures();
    for (std::size_t i = 0; i < closures.size(); ++i) {
      if (closures[i].type != ClosureType::kDistance) continue;
      if (closures[i].body_a == body)
        line("<site name='c{}a' pos='{}'/>", i, text(closures[i].X_AC.translation));
      if (closures[i].body_b == body)
        line("<site name='c{}b' pos='{}'/>", i, text(closures[i].X_BC.translation));
    }
  }

  void geometry(std::size_t i) {
    const Geometry& g = model_.geometries()[i];
    const Vector3& s = g.shape.size;
    std::string shape;
    switch (g.shape.type) {
      case ShapeType::kPlane:
        shape = "type='plane' size='0 0 1'";
        break;
      case ShapeType::kSphere:
        shape = fmt::format("type='sphere' size='{:.17g}'", s.x());
        break;
      case ShapeType::kBox:
        shape = fmt::format("type='box' size='{}'", text(s));
        break;
      case ShapeType::kCapsule:
        shape = fmt::format("type='capsule' size='{}'", numbers({s.x(), s.y()}));
        break;
      case ShapeType::kCylinder:
        shape = fmt::format("type='cylinder' size='{}'", numbers({s.x(), s.y()}));
        break;
      case ShapeType::kConvexMesh:
        shape = fmt::format("type='mesh' mesh='m{}'", meshes_.at(g.shape.mesh.get()));
        break;
      case ShapeType::kTerrain:
        return;
    }
    const std::string contact = by_surface_
                                    ? "contype='1' conaffinity='1' " + surface(g.material, on_)
                                    : "contype='0' conaffinity='0'";
    line("<geom name='g{}' {} {} {}/>", i, shape, placed(g.X_BG), contact);
  }

  void joints(int body) {
    switch (model_.body(body).joint_type) {
      case JointType::kRevolute:
        joint(body, 0, "hinge", "0 0 1");
        break;
      case JointType::kPrismatic:
        joint(body, 0, "slide", "0 0 1");
        break;
      case JointType::kPlanar:
        joint(body, 0, "slide", "1 0 0");
        joint(body, 1, "slide", "0 1 0");
        joint(body, 2, "hinge", "0 0 1");
        break;
      case JointType::kSpherical:
        joint(body, 0, "ball", nullptr);
        break;
      case JointType::kFloating:
        if (is_free(model_.body(body))) {
          joint(body, 0, "free", nullptr);
          break;
        }
        joint(body, 0, "slide", "1 0 0");
        joint(body, 1, "slide", "0 1 0");
        joint(body, 2, "slide", "0 0 1");
        joint(body, 3, "ball", nullptr);
        break;
    }
  }

  void joint(int body, int coordinate, const char* type, const char* axis) {
    const int i = body - 1, v = model_.body(body).v_index + coordinate;
    std::string more;
    if (axis) more += fmt::format(" axis='{}'", axis);
    const auto add = [&](Effect effect, const char* name, double value) {
      if (on_.has(effect) && value != 0.0) more += fmt::format(" {}='{:.17g}'", name, value);
    };
    add(Effect::kDamping, "damping", model_.damping()[v]);
    add(Effect::kArmature, "armature", model_.armature()[v]);
    add(Effect::kDryFriction, "frictionloss", model_.dry_friction()[v]);
    for (const JointSpring& spring : model_.springs()) {
      if (spring.joint != i) continue;
      add(Effect::kSprings, "stiffness", spring.stiffness);
      add(Effect::kSprings, "springref", spring.reference);
    }
    const JointInfo& info = model_.joint(i);
    if (on_.has(Effect::kLimits) && (std::isfinite(info.lower) || std::isfinite(info.upper))) {
      // A missing limit on one side is replaced by a value beyond any motion.
      more += fmt::format(" limited='true' range='{}'",
                          numbers({std::max(info.lower, -1e9), std::min(info.upper, 1e9)}));
    }
    line("<joint name='j{}_{}' type='{}'{}/>", i, coordinate, type, more);
  }

  bool enabled(std::size_t a, std::size_t b) const {
    return collider_.may_touch(static_cast<int>(a), static_cast<int>(b));
  }

  /// True if all surfaces are equal, so that MuJoCo's friction of a pair (the larger of two) equals
  /// ours.
  bool same_surfaces() const {
    const auto& g = model_.geometries();
    return std::all_of(g.begin(), g.end(), [&](const Geometry& geometry) {
      return surface(geometry.material, on_) == surface(g[0].material, on_);
    });
  }

  /// Writes the pairs that can touch. If all surfaces are equal, MuJoCo chooses the pairs itself;
  /// it leaves out parent and child unless the parent is the world. Bodies of which some geometries
  /// must not touch are excluded, and their remaining pairs are listed. With different surfaces all
  /// pairs are listed.
  void contacts() {
    if (!on_.has(Effect::kContacts)) return;
    line("<contact>");
    const auto& g = model_.geometries();
    std::vector<std::pair<std::size_t, std::size_t>> told;
    std::set<std::pair<int, int>> apart;
    std::vector<std::vector<std::size_t>> of_body(model_.bodies().size());
    for (std::size_t a = 0; a < g.size(); ++a) {
      of_body[static_cast<std::size_t>(g[a].body)].push_back(a);
      for (std::size_t b = a + 1; b < g.size(); ++b) {
        const int i = std::min(g[a].body, g[b].body), j = std::max(g[a].body, g[b].body);
        const bool joined = i > 0 && model_.body(j).parent == i;
        const bool on = enabled(a, b);
        if (on && (!by_surface_ || joined)) told.emplace_back(a, b);
        if (by_surface_ && !on && !joined && i != j) apart.emplace(i, j);
      }
    }
    for (const auto& [i, j] : apart) {
      line("<exclude body1='{}' body2='{}'/>", body_name(i), body_name(j));
      for (const std::size_t a : of_body[static_cast<std::size_t>(i)]) {
        for (const std::size_t b : of_body[static_cast<std::size_t>(j)])
          if (enabled(a, b)) told.emplace_back(a, b);
      }
    }
    for (const auto& [a, b] : told) {
      line("<pair geom1='g{}' geom2='g{}' {}/>", a, b,
           surface(model_.pair_material(static_cast<int>(a), static_cast<int>(b)), on_, true));
    }
    line("</contact>");
  }

  static std::string body_name(int i) { return i == 0 ? "world" : fmt::format("b{}", i); }

  /// Writes the closures and mimic joints. The anchors of ball closures are set in the compiled
  /// model, because MJCF derives the second one from the start pose.
  void equalities() {
    line("<equality>");
    const auto& closures = model_.closures();
    for (std::size_t i = 0; on_.has(Effect::kClosures) && i < closures.size(); ++i) {
      const Closure& c = closures[i];
      // MuJoCo accepts the world as the second body only.
      const bool swapped = c.body_a == 0;
      const std::string between =
          fmt::format("name='c{}' body1='{}' body2='{}'", i,
                      body_name(swapped ? c.body_b : c.body_a), body_name(swapped ? 0 : c.body_b));
      if (c.type == ClosureType::kBall)
        line("<connect {} anchor='{}'/>", between,
             text(swapped ? c.X_BC.translation : c.X_AC.translation));
      if (c.type == ClosureType::kWeld) {
        const Pose X_12 = swapped ? c.X_BC * c.X_AC.inverse() : c.X_AC * c.X_BC.inverse();
        const Quaternion q(X_12.rotation);
        line("<weld {} relpose='{} {}'/>", between, text(X_12.translation),
             numbers({q.w(), q.x(), q.y(), q.z()}));
      }
      if (c.type == ClosureType::kDistance) line("<tendon name='c{0}' tendon1='t{0}'/>", i);
    }
    for (const Mimic& mimic : model_.mimics()) {
      if (!on_.has(Effect::kMimics)) break;
      line("<joint joint1='j{}_0' joint2='j{}_0' polycoef='{} 0 0 0'/>", mimic.joint, mimic.master,
           numbers({mimic.offset, mimic.multiplier}));
    }
    line("</equality>");
  }

  /// Writes rods as tendons of constant length.
  void tendons() {
    const auto& closures = model_.closures();
    line("<tendon>");
    for (std::size_t i = 0; i < closures.size(); ++i) {
      if (closures[i].type == ClosureType::kDistance)
        line("<spatial name='t{0}'><site site='c{0}a'/><site site='c{0}b'/></spatial>", i);
    }
    line("</tendon>");
  }

  /// Writes servos: force = control - kp q - kd w, within the effort limit.
  void actuators() {
    line("<actuator>");
    for (const JointServo& servo : model_.servos()) {
      if (!on_.has(Effect::kServos)) break;
      const double limit = model_.joint(servo.joint).effort_limit;
      std::string range;
      if (on_.has(Effect::kEffortLimits) && std::isfinite(limit))
        range = fmt::format(" forcelimited='true' forcerange='{}'", numbers({-limit, limit}));
      line("<general joint='j{}_0' gainprm='1 0 0' biastype='affine' biasprm='{}'{}/>", servo.joint,
           numbers({0.0, -servo.stiffness, -servo.damping}), range);
    }
    line("</actuator>");
  }

  const Scene& scene_;
  const Model& model_;
  collision::Collider collider_;
  EffectSet called_, on_;
  bool best_ = false, rk4_ = false, elliptic_ = false;
  bool by_surface_ = false;  ///< MuJoCo chooses pairs and friction itself
  std::string integrator_, out_;
  std::map<const ConvexMesh*, std::size_t> meshes_;
};

}  // namespace

bool is_free(const Body& body) {
  return body.joint_type == JointType::kFloating && body.parent == 0;
}

EffectSet effects_of(const Scene& scene) {
  return active_effects(called_for(scene.model, collision::Collider(scene.model)),
                        scene.options.effects);
}

std::string mjcf(const Scene& scene, MujocoSettings settings, const std::string& integrator) {
  return Writer(scene, settings, integrator).write();
}

}  // namespace counterpoint::peers
