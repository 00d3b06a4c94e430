#include "counterpoint/model/mjcf/bodies/bodies.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <cmath>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/mjcf/bodies/joints.h"

namespace counterpoint::mjcf {
namespace {

class TreeReader {
 public:
  TreeReader(Document& document, const Defaults& defaults, MjcfModel& model)
      : document_(document), defaults_(defaults), model_(model) {}

  Bodies read() {
    add_link("world", document_.file().string());
    used_.insert("world");
    out_.body_names["world"] = 0;
    BodyNode world;
    world.element = &document_.root();
    world.link = "world";
    out_.bodies.push_back(world);
    for (const Element* section : document_.sections("worldbody")) {
      document_.expect(*section, {});
      read_contents(*section, 0, Pose(), "");
    }
    return std::move(out_);
  }

 private:
  /// `X_BF`: pose of the enclosing <frame> elements in the frame of the body.
  void read_contents(const Element& element, int body, const Pose& X_BF,
                     const std::string& childclass) {
    document_.each(document_.children(element),
                   [&](const Element& e) { read_content(e, body, X_BF, childclass); });
  }

  void read_content(const Element& e, int body, const Pose& X_BF, const std::string& childclass) {
    const std::string kind = e.Name();
    if (kind == "body") {
      read_body(e, body, X_BF, childclass);
    } else if (kind == "geom") {
      read_one_geom(e, body, X_BF, childclass);
    } else if (kind == "site") {
      read_site(e, body, X_BF, childclass);
    } else if (kind == "frame") {
      document_.expect(
          e, {"name", "childclass", "pos", "quat", "axisangle", "xyaxes", "zaxis", "euler"});
      const char* own = e.Attribute("childclass");
      read_contents(e, body, X_BF * pose_of(Values(document_, e)), own ? own : childclass);
    } else if (kind == "joint" || kind == "freejoint" || kind == "inertial") {
      if (body == 0) document_.fail(e, "the world cannot move; put it into a <body>");
      // read_body has read these before.
      if (!X_BF.rotation.isIdentity(0.0) || !X_BF.translation.isZero(0.0))
        document_.fail(e, "within a displaced <frame> it is not supported; move it out");
    } else if (kind != "camera" && kind != "light") {
      document_.fail(
          e, fmt::format("<{}> is not supported; save the model with MuJoCo as one plain file "
                         "(mj_saveLastXML), or write the bodies out",
                         kind));
    }
  }

  void read_site(const Element& e, int body, const Pose& X_BF, const std::string& childclass) {
    const Values v = defaults_.values(e, childclass);
    Pose X_BS = pose_of(v);
    if (const auto f = v.numbers("fromto", 6, 6); !f.empty())
      X_BS.translation = 0.5 * Vector3(f[0] + f[3], f[1] + f[4], f[2] + f[5]);
    if (const std::string name = name_of(e); !name.empty()) out_.sites[name] = {body, X_BF * X_BS};
  }

  void read_body(const Element& element, int parent, const Pose& X_PF, const std::string& above) {
    document_.expect(element, {"name", "childclass", "mocap", "pos", "quat", "axisangle", "xyaxes",
                               "zaxis", "euler", "gravcomp", "user", "sleep"});
    const Values v(document_, element);
    const std::string childclass = v.text("childclass", above);
    const int index = static_cast<int>(out_.bodies.size());
    if (index > limits::kMaxLinks)
      document_.fail(element,
                     fmt::format("more than {} bodies; make the model smaller", limits::kMaxLinks));
    BodyNode node;
    node.element = &element;
    node.parent = parent;
    const Pose X_PB = X_PF * pose_of(v);
    node.X_WB = out_.bodies[parent].X_WB * X_PB;
    node.link =
        free_name(name_of(element).empty() ? fmt::format("body{}", index) : name_of(element));
    const std::string name = name_of(element);
    if (!name.empty() && !out_.body_names.emplace(name, index).second)
      document_.fail(element, "there is already a body of this name");

    std::vector<const Element*> joints;
    for (const Element* e : contents(element)) {
      const std::string kind = e->Name();
      if (kind == "joint" || kind == "freejoint") joints.push_back(e);
      if (kind != "inertial") continue;
      if (node.inertial) document_.fail(*e, "a body has one <inertial>");
      node.inertial = e;
    }
    const bool mocap = v.boolean("mocap", false) && !leaves_out_mocap(element);
    if (mocap && (parent != 0 || !joints.empty()))
      document_.fail(element, "a mocap body hangs on the world and has no joint");
    node.weld = joints.empty() && !mocap ? out_.bodies[parent].weld : index;
    node.mocap = mocap;
    out_.bodies.push_back(node);
    std::string hangs_on = out_.bodies[parent].link;
    Pose at = X_PB;
    for (std::size_t i = 0; i < joints.size(); ++i)
      document_.faults.collect([&] {
        add_joint(*joints[i], index, i, i + 1 == joints.size(), childclass, hangs_on, at);
      });
    if (mocap) {
      add_mocap(element, node);
    } else if (hangs_on != node.link) {
      JointSpec fixed;
      fixed.name = node.link + ".fixed";
      fixed.fixed = true;
      fixed.parent = hangs_on;
      fixed.child = node.link;
      fixed.X_PJ = at;
      fixed.where = document_.where(element);
      model_.robot.joints.push_back(fixed);
    }
    out_.bodies[index].link_index = static_cast<int>(model_.robot.links.size());
    add_link(node.link, document_.where(element));
    model_.robot.links.back().gravity_compensation = v.number("gravcomp", 0.0);
    read_contents(element, index, Pose(), childclass);
  }

  bool leaves_out_mocap(const Element& element) {
    const bool out = document_.options().leave_out.count(LeaveOut::kMocap) > 0;
    if (out) document_.note(element, "mocap is left out: the body stays where it is");
    return out;
  }

  /// Adds the joint of a mocap body, whose motion is prescribed.
  void add_mocap(const Element& element, const BodyNode& node) {
    JointSpec joint;
    joint.name = node.link;
    joint.type = JointType::kFloating;
    joint.parent = out_.bodies[0].link;
    joint.child = node.link;
    joint.prescribed = true;
    joint.where = document_.where(element);
    if (!joint_names_.insert(joint.name).second)
      document_.fail(element, fmt::format("there is already a joint '{}'", joint.name));
    model_.robot.joints.push_back(joint);
    const Quaternion q(node.X_WB.rotation);
    const Vector3& p = node.X_WB.translation;
    model_.mocaps.push_back(
        {joint.name, joint.type, {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()}});
    document_.note(element, "mocap: moves as its input says (prescribed), and else stays");
  }

  /// Returns the elements of a body, including those in its <frame> elements.
  std::vector<const Element*> contents(const Element& element) const {
    std::vector<const Element*> out;
    for (const Element* e : document_.children(element)) {
      if (std::string(e->Name()) != "frame") {
        out.push_back(e);
        continue;
      }
      for (const Element* inner : contents(*e)) out.push_back(inner);
    }
    return out;
  }

  /// Adds one of a body's joints, which act in series: each axis is moved by the joints before it,
  /// with massless links in between. `hangs_on`: the link that the next joint attaches to; `at`:
  /// pose of the body frame in that link. Updates both.
  void add_joint(const Element& element, int body, std::size_t number, bool last,
                 const std::string& childclass, std::string& hangs_on, Pose& at) {
    JointRead read = read_joint(document_, defaults_, element, childclass);
    const BodyNode& node = out_.bodies[body];
    const bool is_free = read.spec.type == JointType::kFloating;
    if (is_free && (node.parent != 0 || number > 0 || !last))
      document_.fail(element, "a free joint is the only one of a body that hangs on the world");
    JointSpec& spec = read.spec;
    const std::string given = name_of(element);
    spec.name = given.empty() ? fmt::format("{}.joint{}", node.link, number) : given;
    if (given.empty() && is_free) spec.name = node.link;
    if (!joint_names_.insert(spec.name).second)
      document_.fail(element, fmt::format("there is already a joint '{}'", spec.name));
    spec.parent = hangs_on;
    const bool ends_here = last && read.anchor.isZero(0.0);
    spec.child = ends_here ? node.link : free_name(node.link + "." + spec.name);
    const int index = static_cast<int>(out_.joints.size());
    out_.joints.push_back({&element, spec.name, static_cast<int>(model_.robot.joints.size()), body,
                           read.reference, read.spring_damper});
    if (!given.empty()) out_.joint_names[given] = index;
    MjcfModel::Coordinate coordinate{spec.name, spec.type, {read.reference}};
    if (is_free) {
      // MuJoCo's coordinates of a free body are its pose in the world frame.
      const Quaternion q(node.X_WB.rotation);
      const Vector3& p = node.X_WB.translation;
      coordinate.reference = {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
      spec.X_PJ = Pose();
      at = Pose();
    } else {
      if (spec.type == JointType::kSpherical) coordinate.reference = {1, 0, 0, 0};
      spec.X_PJ = at * Pose{Matrix3::Identity(), read.anchor} * read.before;
      at = {Matrix3::Identity(), -read.anchor};
    }
    model_.coordinates.push_back(coordinate);
    hangs_on = spec.child;
    if (!ends_here) add_link(spec.child, spec.where);
    model_.robot.joints.push_back(spec);
  }

  void read_one_geom(const Element& element, int body, const Pose& X_BF,
                     const std::string& childclass) {
    Geom geom = read_geom(defaults_.values(element, childclass), X_BF, body);
    const int index = static_cast<int>(out_.geoms.size());
    if (!geom.name.empty() && !out_.geom_names.emplace(geom.name, index).second)
      document_.fail(element, "there is already a geom of this name");
    if (index >= limits::kMaxGeometries)
      document_.fail(element, "too many geoms; make the model smaller");
    geom.collision = fmt::format("{}/{}", out_.bodies[body].link,
                                 geom.name.empty() ? fmt::format("geom{}", index) : geom.name);
    out_.geoms.push_back(geom);
  }

  void add_link(const std::string& name, const std::string& where) {
    LinkSpec link;
    link.name = name;
    link.where = where;
    model_.robot.links.push_back(link);
  }

  std::string free_name(const std::string& wish) {
    std::string name = wish;
    for (int i = 1; !used_.insert(name).second; ++i) name = fmt::format("{}:{}", wish, i);
    return name;
  }

  Document& document_;
  const Defaults& defaults_;
  MjcfModel& model_;
  Bodies out_;
  std::set<std::string> used_, joint_names_;
};

}  // namespace

int Bodies::body(const Document& document, const Element& user, const std::string& name) const {
  const auto found = body_names.find(name);
  if (found != body_names.end()) return found->second;
  document.fail(user, fmt::format("there is no body '{}'", name));
}

Bodies read_bodies(Document& document, const Defaults& defaults, MjcfModel& model) {
  return TreeReader(document, defaults, model).read();
}

}  // namespace counterpoint::mjcf
