#include "counterpoint/model/sdf/trees.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace counterpoint::sdf_file {
namespace {

/// Poses whose entries [m, or of the rotation matrix] differ by less are equal up to round-off.
constexpr double kSame = 1e-14;

bool is_identity(const Pose& pose) {
  return pose.translation.cwiseAbs().maxCoeff() < kSame &&
         (pose.rotation - Matrix3::Identity()).cwiseAbs().maxCoeff() < kSame;
}

class TreeBuilder {
 public:
  TreeBuilder(Document& document, const Bodies& bodies, const std::string& prefix, const Pose& X_WT,
              SdfModel& model)
      : document_(document),
        bodies_(bodies),
        prefix_(prefix),
        X_WT_(X_WT),
        model_(model),
        joints_of_(bodies.links.size() + 1),
        done_(bodies.links.size() + 1, false) {}

  void build() {
    const std::vector<int> loops = choose();
    if (!joints_of_[0].empty()) build_tree(-1);
    // Roots are the links without a parent joint; in a cycle, its first link.
    std::vector<char> is_child(bodies_.links.size(), 0);
    for (const auto& joints : joints_of_)
      for (const int j : joints)
        if (bodies_.joints[j].child >= 0) is_child[bodies_.joints[j].child] = 1;
    for (const bool roots : {true, false})
      for (int i = 0; i < static_cast<int>(bodies_.links.size()); ++i)
        if (!done_[i + 1] && (!roots || !is_child[i])) build_tree(i);
    for (const int j : loops) close(bodies_.joints[j]);
  }

 private:
  /// Chooses the joints of the trees in file order, those marked as loop joints last. Returns the
  /// others, which close loops.
  std::vector<int> choose() {
    std::vector<int> set(bodies_.links.size() + 1), order(bodies_.joints.size()), loops;
    std::iota(set.begin(), set.end(), 0);
    std::iota(order.begin(), order.end(), 0);
    std::stable_partition(order.begin(), order.end(),
                          [&](int j) { return !bodies_.joints[j].loop; });
    const auto root = [&](int i) {
      while (set[i] != i) i = set[i] = set[set[i]];
      return i;
    };
    for (const int j : order) {
      const int a = bodies_.joints[j].parent + 1, b = bodies_.joints[j].child + 1;
      if (root(a) == root(b)) {
        loops.push_back(j);
        continue;
      }
      set[root(a)] = root(b);
      joints_of_[a].push_back(j);
      joints_of_[b].push_back(j);
    }
    for (auto& joints : joints_of_) std::sort(joints.begin(), joints.end());
    return loops;
  }

  Pose pose_of(int link) const { return link < 0 ? X_WT_.inverse() : bodies_.links[link].X_TL; }
  std::string name_of(int link) const {
    return link < 0 ? prefix_ + "world" : bodies_.links[link].spec.name;
  }

  void build_tree(int root) {
    SdfModel::Tree tree;
    tree.base = root < 0 ? Base::kFixed : Base::kFloating;
    if (root >= 0) tree.X_WL = X_WT_ * bodies_.links[root].X_TL;
    tree.robot.name = prefix_.empty() ? model_.name : prefix_.substr(0, prefix_.size() - 1);
    tree.robot.where = document_.file().string();
    std::vector<int> open = {root};
    while (!open.empty()) {
      const int link = open.back();
      open.pop_back();
      done_[link + 1] = true;
      add_link(link, tree.robot);
      std::vector<int> next;
      for (const int j : joints_of_[link + 1]) {
        const JointNode& joint = bodies_.joints[j];
        const int other = joint.parent == link ? joint.child : joint.parent;
        if (done_[other + 1]) continue;
        add_joint(joint, link, other, tree.robot);
        add_sensors(joint, link, other, tree.robot);
        next.push_back(other);
      }
      open.insert(open.end(), next.rbegin(), next.rend());
    }
    model_.trees.push_back(std::move(tree));
  }

  void add_link(int link, RobotSpec& robot) const {
    if (link >= 0) return robot.links.push_back(bodies_.links[link].spec);
    LinkSpec world;
    world.name = name_of(-1);
    world.where = document_.file().string();
    robot.links.push_back(world);
  }

  /// Adds a joint from `inner` to `outer`, reversed if the file has it the other way. Massless
  /// links go in between if the joint has two axes, or if the frame of the outer link is not the
  /// joint frame.
  void add_joint(const JointNode& joint, int inner, int outer, RobotSpec& robot) const {
    const bool turned = joint.parent != inner;
    std::string hangs_on = name_of(inner);
    Pose at = pose_of(inner).inverse() * (joint.motions.empty() ? pose_of(outer) : joint.X_TJ);
    const Pose X_JO = joint.X_TJ.inverse() * pose_of(outer);
    std::vector<JointSpec> motions = joint.motions;
    if (turned) std::reverse(motions.begin(), motions.end());
    for (std::size_t i = 0; i < motions.size(); ++i) {
      JointSpec& spec = motions[i];
      if (turned) spec.axis = -spec.axis;
      spec.parent = hangs_on;
      spec.X_PJ = at;
      const bool ends_here = i + 1 == motions.size() && is_identity(X_JO);
      spec.child =
          ends_here ? name_of(outer) : fmt::format("{}.{}", name_of(outer), leaf(spec.name));
      if (!ends_here) {
        LinkSpec between;
        between.name = spec.child;
        between.where = spec.where;
        robot.links.push_back(between);
      }
      hangs_on = spec.child;
      at = i + 1 == motions.size() ? X_JO : Pose();
      robot.joints.push_back(spec);
    }
    if (hangs_on == name_of(outer)) return;
    JointSpec fixed;
    fixed.name = motions.empty() ? joint.name : name_of(outer) + ".fixed";
    fixed.fixed = true;
    fixed.parent = hangs_on;
    fixed.child = name_of(outer);
    fixed.X_PJ = at;
    fixed.where = document_.where(joint.element);
    robot.joints.push_back(fixed);
  }

  void add_sensors(const JointNode& joint, int inner, int outer, RobotSpec& robot) const {
    TreeJoint at;
    at.name = joint.name;
    at.reversed = joint.parent != inner;
    at.inner = name_of(inner);
    at.outer = name_of(outer);
    at.X_IJ = pose_of(inner).inverse() * joint.X_TJ;
    at.X_OJ = pose_of(outer).inverse() * joint.X_TJ;
    for (const JointSpec& motion : joint.motions) {
      at.motions.insert(at.reversed ? at.motions.begin() : at.motions.end(), motion.name);
      at.turns = at.turns || motion.type != JointType::kPrismatic;
    }
    for (const WrenchSensor& sensor : joint.sensors)
      place_wrench(sensor, at, robot, model_.sensors);
  }

  static std::string leaf(const std::string& name) {
    const std::size_t slash = name.rfind('/');
    return slash == std::string::npos ? name : name.substr(slash + 1);
  }

  void close(const JointNode& joint) {
    ClosureSpec closure;
    closure.name = joint.name;
    closure.link_a = name_of(joint.parent);
    closure.link_b = name_of(joint.child);
    closure.where = document_.where(joint.element);
    const Pose X_PJ = pose_of(joint.parent).inverse() * joint.X_TJ;
    const Pose X_CJ = pose_of(joint.child).inverse() * joint.X_TJ;
    closure.type = closure_type(joint);
    closure.anchor_a = X_PJ.translation;
    closure.anchor_b = X_CJ.translation;
    if (holds_angles(closure.type)) closure.orientation = X_PJ.rotation * X_CJ.rotation.transpose();
    if (closure.type == ClosureType::kHinge || closure.type == ClosureType::kPrismatic)
      closure.axis = X_PJ.rotation * joint.motions[0].axis;
    for (const JointSpec& spec : joint.motions)
      if (spec.damping != 0.0 || spec.dry_friction != 0.0 || spec.stiffness != 0.0 ||
          std::isfinite(spec.lower) || std::isfinite(spec.upper))
        document_.note(joint.element,
                       "it closes a loop: its limits, damping, friction and spring are not used");
    for (const WrenchSensor& sensor : joint.sensors)
      model_.notes.push_back(
          {sensor.spec.where, "its joint closes a loop, whose wrench no sensor reads; left out"});
    model_.closures.push_back(closure);
  }

  ClosureType closure_type(const JointNode& joint) {
    if (joint.motions.empty()) return ClosureType::kWeld;
    const JointType type = joint.motions[0].type;
    if (joint.motions.size() == 1 && type == JointType::kSpherical) return ClosureType::kBall;
    if (joint.motions.size() == 1 && type == JointType::kRevolute) return ClosureType::kHinge;
    if (joint.motions.size() == 1 && type == JointType::kPrismatic) return ClosureType::kPrismatic;
    document_.fail(
        joint.element,
        "it closes a loop; revolute, prismatic, ball or fixed joints may, so mark another "
        "of the loop by <must_be_loop_joint>");
  }

  Document& document_;
  const Bodies& bodies_;
  const std::string prefix_;
  const Pose X_WT_;
  SdfModel& model_;
  std::vector<std::vector<int>> joints_of_;  // joints of the trees; index: link + 1
  std::vector<char> done_;
};

}  // namespace

void add_trees(Document& document, const Bodies& bodies, const std::string& prefix,
               const Pose& X_WT, SdfModel& model) {
  TreeBuilder(document, bodies, prefix, X_WT, model).build();
}

}  // namespace counterpoint::sdf_file
