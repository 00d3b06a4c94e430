#include "counterpoint/model/sdf/bodies.h"

#include <fmt/format.h>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/model.h"
#include "counterpoint/model/sdf/joints.h"
#include "counterpoint/model/sdf/motors.h"

namespace counterpoint::sdf_file {
namespace {

constexpr const char* kStaticSensor = "a sensor of a static model; left out";

class BodyReader {
 public:
  BodyReader(Document& document, ShapeReader& shapes, const std::string& prefix)
      : document_(document), shapes_(shapes), prefix_(prefix) {}

  /// Reads a model and the models within it. `scope`: its path of names in the outermost model, ""
  /// or "inner::"; `X_TM`: pose of its frame in that of the outermost model; `is_static`: a model
  /// around it is static.
  void read(const sdf::Model& model, const std::string& scope, const Pose& X_TM, bool is_static) {
    const sdf::ElementPtr element = model.Element();
    document_.pass_over_all_but(
        element, {"link", "joint", "frame", "model", "include", "pose", "static", "self_collide",
                  "allow_auto_disable", "enable_wind", "plugin"});
    is_static = is_static || model.Static();
    for (std::uint64_t i = 0; i < model.LinkCount(); ++i)
      read_link(*model.LinkByIndex(i), model, scope, X_TM, is_static);
    for (std::uint64_t i = 0; i < model.ModelCount(); ++i) {
      const sdf::Model& inner = *model.ModelByIndex(i);
      const Pose X_MI = document_.resolve(inner.SemanticPose(), "__model__", inner.Element());
      read(inner, scope + inner.Name() + "::", X_TM * X_MI, is_static);
    }
    for (std::uint64_t i = 0; i < model.JointCount(); ++i)
      document_.faults.collect([&] { read_joint(*model.JointByIndex(i), scope, X_TM, is_static); });
    for (const sdf::ElementPtr& e : document_.children(element)) {
      if (e->GetName() != "plugin") continue;
      if (is_static)
        document_.note(e, "plugins do not run");
      else
        document_.faults.collect([&] {
          read_motor(
              document_, e,
              [&](const std::string& path) {
                const std::size_t leaf = path.rfind(':') + 1;
                return name_of(scope + path.substr(0, leaf), path.substr(leaf));
              },
              bodies.motors);
        });
    }
  }

  Bodies bodies;

 private:
  /// Converts scope "inner::" and name "arm" to "inner/arm", after the prefix.
  std::string name_of(const std::string& scope, const std::string& name) const {
    std::string out = prefix_;
    std::size_t from = 0;
    for (std::size_t at = 0; (at = scope.find("::", from)) != std::string::npos; from = at + 2) {
      out.append(scope, from, at - from);
      out += '/';
    }
    return out + name;
  }

  void read_link(const sdf::Link& in, const sdf::Model& model, const std::string& scope,
                 const Pose& X_TM, bool is_static) {
    const sdf::ElementPtr element = in.Element();
    document_.pass_over_all_but(
        element, {"pose", "inertial", "collision", "gravity", "self_collide", "kinematic",
                  "must_be_base_link", "velocity_decay", "enable_wind", "sensor"});
    if (bodies.links.size() + bodies.fixed.size() == static_cast<std::size_t>(limits::kMaxLinks))
      document_.fail(element, fmt::format("more than {} links in a model", limits::kMaxLinks));
    LinkNode node;
    node.element = element;
    node.X_TL = X_TM * document_.resolve(in.SemanticPose(), "__model__", element);
    node.self_collide = Document::flag(element, "self_collide", model.SelfCollide());
    node.spec.name = name_of(scope, in.Name());
    node.spec.where = document_.where(element);
    if (!is_static) {
      document_.faults.collect([&] { check_motion(element); });
      document_.faults.collect([&] { density_ = density_of(element); });
      if (!Document::flag(element, "gravity", true)) node.spec.gravity_compensation = 1.0;
    }
    if (is_static) density_.reset();
    SpatialInertia solids;
    for (std::uint64_t i = 0; i < in.CollisionCount(); ++i)
      document_.faults.collect(
          [&] { read_collision(*in.CollisionByIndex(i), is_static, node, solids); });
    if (!is_static)
      document_.faults.collect([&] { node.spec.inertia = inertia_of(element, solids); });
    for (std::uint64_t i = 0; i < in.SensorCount(); ++i)
      if (is_static)
        document_.note(in.SensorByIndex(i)->Element(), kStaticSensor);
      else
        document_.faults.collect([&] {
          read_link_sensor(document_, *in.SensorByIndex(i), in.Name(), node.spec.name,
                           bodies.sensors);
        });
    indices_[scope + in.Name()] = is_static ? -1 : static_cast<int>(bodies.links.size());
    (is_static ? bodies.fixed : bodies.links).push_back(node);
  }

  /// Adds the inertia of the collision's solid to `solids`, if that is wanted.
  void read_collision(const sdf::Collision& in, bool is_static, LinkNode& node,
                      SpatialInertia& solids) {
    const CollisionRead read = shapes_.read(in, is_static, density_);
    solids = solids + read.inertia;
    if (!read.touches)
      return document_.note(in.Element(), "touches nothing, as its <contact> says");
    node.spec.collisions.push_back(read.collision);
    node.collisions.push_back(read);
  }

  void check_motion(const sdf::ElementPtr& element) {
    if (Document::flag(element, "kinematic", false))
      document_.fail(
          element,
          "<kinematic>: a link that forces do not move is not supported; fix it to the world");
    const sdf::ElementPtr decay = Document::child(element, "velocity_decay");
    for (const char* part : {"linear", "angular"})
      if (Document::number(decay, part, 0.0) != 0.0)
        document_.refuse(
            decay, LeaveOut::kFluid,
            fmt::format("<{}> is not 0: a share of the speed lost each step is not supported",
                        part));
  }

  /// The density [kg/m^3] from which a link's <inertial auto="true"> (SDF 1.11) takes its inertia;
  /// nothing if that is given by numbers.
  std::optional<double> density_of(const sdf::ElementPtr& link) {
    constexpr double kWater = 1000.0;  // the format's default
    const sdf::ElementPtr inertial = Document::child(link, "inertial");
    const std::string word = document_.later(inertial, "auto");
    if (word.empty() || word == "false" || word == "0") return {};
    if (word != "true" && word != "1")
      document_.fail(inertial, fmt::format("auto=\"{}\": true or false is expected", word));
    return Document::later_number(inertial, "density").value_or(kWater);
  }

  SpatialInertia inertia_of(const sdf::ElementPtr& element, const SpatialInertia& solids) {
    const sdf::ElementPtr inertial = Document::child(element, "inertial");
    if (density_) {
      if (!(solids.mass > 0.0))
        document_.fail(element,
                       "<inertial auto=\"true\">: the link has no <collision> with a volume; give "
                       "one, or <mass> and <inertia>");
      if (!Document::child(inertial, "mass")) return solids;
      // A mass scales the whole, whatever the densities.
      const double share = Document::number(inertial, "mass", solids.mass) / solids.mass;
      return {share * solids.mass, solids.center, share * solids.rotational};
    }
    const sdf::ElementPtr moments = Document::child(inertial, "inertia");
    if (!inertial)
      document_.note(element, "no <inertial>: 1 kg with moments of 1 kg m^2, as the format says");
    const auto moment = [&](const char* name, double otherwise) {
      return Document::number(moments, name, otherwise);
    };
    const double xx = moment("ixx", 1.0), yy = moment("iyy", 1.0), zz = moment("izz", 1.0);
    const double xy = moment("ixy", 0.0), xz = moment("ixz", 0.0), yz = moment("iyz", 0.0);
    SpatialInertia inertia;
    inertia.mass = Document::number(inertial, "mass", 1.0);
    inertia.rotational << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    if (Document::child(inertial, "fluid_added_mass"))
      document_.fail(inertial, "<fluid_added_mass> is not supported");
    if (const sdf::ElementPtr pose = Document::child(inertial, "pose"))
      inertia = inertia.transformed(to_pose(pose->Get<ignition::math::Pose3d>()));
    const std::string defect = document_.options().repair_inertias ? inertia_defect(inertia) : "";
    if (defect.empty()) return inertia;
    document_.note(element, defect + "; replaced by the nearest possible");
    return nearest_physical(inertia);
  }

  void read_joint(const sdf::Joint& in, const std::string& scope, const Pose& X_TM,
                  bool is_static) {
    JointNode node;
    node.element = in.Element();
    node.name = name_of(scope, in.Name());
    for (std::uint64_t i = 0; i < in.SensorCount(); ++i)
      if (is_static)
        document_.note(in.SensorByIndex(i)->Element(), kStaticSensor);
      else if (const auto meter =
                   read_joint_sensor(document_, *in.SensorByIndex(i), in.Name(), node.name))
        node.sensors.push_back(*meter);
    if (is_static) return;
    node.parent = link_index(in, scope, true);
    node.child = link_index(in, scope, false);
    if (node.parent == node.child) document_.fail(node.element, "it joins a link to itself");
    node.motions = read_motions(document_, in, node.name);
    node.X_TJ = X_TM * document_.resolve(in.SemanticPose(), "__model__", node.element);
    const sdf::ElementPtr simbody =
        Document::child(Document::child(node.element, "physics"), "simbody");
    node.loop = Document::flag(simbody, "must_be_loop_joint", false);
    bodies.joints.push_back(node);
  }

  int link_index(const sdf::Joint& in, const std::string& scope, bool parent) const {
    std::string name;
    document_.check(parent ? in.ResolveParentLink(name) : in.ResolveChildLink(name), in.Element());
    if (name == "world") return -1;
    const auto found = indices_.find(scope + name);
    if (found != indices_.end()) return found->second;
    document_.fail(in.Element(), fmt::format("there is no link '{}'", name));
  }

  Document& document_;
  std::optional<double> density_;  ///< the link that is being read has it (density_of)
  ShapeReader& shapes_;
  const std::string prefix_;
  std::map<std::string, int> indices_;  // key: "scope::name" in the outermost model; -1: static
};

}  // namespace

Bodies read_bodies(Document& document, ShapeReader& shapes, const sdf::Model& model,
                   const std::string& prefix) {
  BodyReader reader(document, shapes, prefix);
  reader.read(model, "", Pose(), false);
  return reader.bodies;
}

}  // namespace counterpoint::sdf_file
