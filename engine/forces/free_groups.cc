#include "counterpoint/engine/forces/free_groups.h"

#include <algorithm>
#include <utility>

#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/dynamics/kinematics.h"

namespace counterpoint {
namespace {

const Body& base(const Model& model, int tree) {
  return model.body(model.trees()[static_cast<size_t>(tree)].body_begin);
}

BodyRange bodies_of(const Tree& tree) { return {tree.body_begin, tree.body_end}; }

/// True if a tree has a floating base that is not prescribed and on which no armature, damping or
/// dry friction acts.
bool floats(const Model& model, int t) {
  const Body& root = base(model, t);
  if (root.joint_type != JointType::kFloating) return false;
  if (model.joint(model.trees()[static_cast<size_t>(t)].body_begin - 1).prescribed) return false;
  for (const VectorX* v :
       {&model.armature(), &model.damping(), &model.dry_friction(), &model.breakaway_friction()})
    if (!v->segment<6>(root.v_index).isZero(0.0)) return false;
  return true;
}

/// Returns the sum of the generalized forces u (nv) on the bases of trees, in W [N].
Vector3 force_on_bases(const Model& model, std::span<const int> trees, const VectorRef& u) {
  Vector3 force = Vector3::Zero();
  for (const int t : trees) {
    const Body& root = base(model, t);
    force += root.X_PJ.rotation * u.segment<3>(root.v_index);
  }
  return force;
}

}  // namespace

FreeGroups::FreeGroups(const Model& model) {
  const auto count = model.trees().size();
  floats_.resize(count);
  off_center_.resize(count);
  held_.resize(count);
  carried_.assign(count, 0.0);
  mass_.assign(count, 0.0);
  for (size_t t = 0; t < count; ++t) {
    const Tree& tree = model.trees()[t];
    floats_[t] = floats(model, static_cast<int>(t));
    off_center_[t] = tree.body_end - tree.body_begin > 1 ||
                     !model.body(tree.body_begin).inertia.center.isZero(0.0);
    any_ = any_ || (floats_[t] && off_center_[t]);
    for (int i = tree.body_begin; i < tree.body_end; ++i) mass_[t] += model.body(i).inertia.mass;
  }
  for (const GravityCompensation& carried : model.gravity_compensations())
    if (carried.body != 0)
      carried_[static_cast<size_t>(model.body(carried.body).tree)] += carried.mass;
  if (!any_) return;
  groups_.resize(count);
  trees_.reserve(count);
  scratch_.emplace(model);
  V_.resize(static_cast<size_t>(model.num_bodies()));
  v_ = tau_ = VectorX::Zero(model.nv());
}

/// Joins the trees that touch, or may within the step; marks those that touch the world or have
/// drag.
void FreeGroups::join_touched(const StepContext& at, const ConstraintSet& constraints) {
  const Model& model = at.model;
  const auto touch = [&](int a, int b) {
    if (a == b) return;
    if (a >= 0 && b >= 0) return sets_.join(a, b);
    held_[static_cast<size_t>(std::max(a, b))] = 1;
  };
  const auto touch_bodies = [&](int a, int b) { touch(model.body(a).tree, model.body(b).tree); };
  for (const PairConstraint& pair : constraints.pairs) touch_bodies(pair.body_a, pair.body_b);
  for (const ParkedContact& parked : constraints.parked) touch_bodies(parked.body_a, parked.body_b);
  for (const FarPair& far : constraints.far) touch_bodies(far.body_a, far.body_b);
  // Steps of Runge-Kutta have no constraint set, so closures and mimic joints are read from the
  // model.
  if (at.effects.has(Effect::kClosures))
    for (const Closure& closure : model.closures())
      if (closure.acts(at.z)) touch_bodies(closure.body_a, closure.body_b);
  if (at.effects.has(Effect::kMimics))
    for (const Mimic& mimic : model.mimics()) touch_bodies(mimic.joint + 1, mimic.master + 1);
  if (at.effects.has(Effect::kTendons)) {
    for (const Tendon& tendon : model.tendons()) {
      for (const TendonJoint& term : tendon.joints)
        touch_bodies(tendon.joints[0].joint + 1, term.joint + 1);
      for (const TendonSegment& segment : tendon.path) {
        touch_bodies(tendon.path[0].from.body, segment.from.body);
        touch_bodies(tendon.path[0].from.body, segment.to.body);
      }
      for (const TendonWrap& wrap : tendon.wraps) touch_bodies(tendon.path[0].from.body, wrap.body);
    }
  }
  if (at.effects.has(Effect::kDrag))
    for (const BodyDrag& drag : model.drags()) touch(model.body(drag.body).tree, -1);
}

/// Lists the trees of groups without a held tree, in order of group.
void FreeGroups::list_free_trees(const Model& model) {
  for (int t = 0; t < model.num_trees(); ++t)
    if (held_[static_cast<size_t>(t)]) held_[static_cast<size_t>(sets_.root(t))] = 1;
  for (int t = 0; t < model.num_trees(); ++t)
    if (!held_[static_cast<size_t>(sets_.root(t))]) trees_.push_back(t);
  std::sort(trees_.begin(), trees_.end(), [&](int a, int b) {
    return std::pair(sets_.root(a), a) < std::pair(sets_.root(b), b);
  });
}

void FreeGroups::add_group(const StepContext& at, std::span<const int> trees,
                           const Kinematics& data) {
  const Model& model = at.model;
  const auto off_center = [&](int t) { return off_center_[static_cast<size_t>(t)] != 0; };
  if (std::none_of(trees.begin(), trees.end(), off_center)) return;
  Group& group = groups_[count_++];
  group = {};
  group.trees = trees;
  for (const int t : trees) {
    group.mass += mass_[static_cast<size_t>(t)];
    group.heavy_mass += mass_[static_cast<size_t>(t)] - carried_[static_cast<size_t>(t)];
  }
  group.origin = data.X_WB[model.trees()[static_cast<size_t>(trees[0])].body_begin].translation;
  group.start = motion_of(model, group, at.v, data);
}

void FreeGroups::find(const StepContext& at, const ConstraintSet& constraints, SleepMask idle,
                      const Kinematics& data) {
  count_ = 0;
  trees_.clear();
  if (!any_) return;
  const Model& model = at.model;
  sets_.reset(model.num_trees());
  for (int t = 0; t < model.num_trees(); ++t) {
    const auto i = static_cast<size_t>(t);
    held_[i] = !floats_[i] || idle(model.trees()[i].body_begin);
  }
  join_touched(at, constraints);
  list_free_trees(model);
  for (size_t first = 0, last = 0; first < trees_.size(); first = last) {
    while (last < trees_.size() && sets_.root(trees_[last]) == sets_.root(trees_[first])) ++last;
    add_group(at, {&trees_[first], last - first}, data);
  }
}

/// Returns the motion of the group's centre of mass at the poses in `data` and velocities v.
CenterMotion FreeGroups::motion_of(const Model& model, const Group& group, const VectorRef& v,
                                   const Kinematics& data) {
  CenterMotion sum;
  for (const int t : group.trees) {
    const Tree& tree = model.trees()[static_cast<size_t>(t)];
    const Body& root = base(model, t);
    const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
    v_(part) = v(part);
    v_.segment<3>(root.v_index).setZero();
    compute_body_velocities(model, v_, bodies_of(tree), data, V_);
    sum.bases += mass_[static_cast<size_t>(t)] * (root.X_PJ.rotation * v.segment<3>(root.v_index));
    for (int i = tree.body_begin; i < tree.body_end; ++i) {
      const SpatialInertia& inertia = model.body(i).inertia;
      const Vector3 arm = data.X_WB[i].rotation * inertia.center;
      sum.position += inertia.mass * (data.X_WB[i].translation - group.origin + arm);
      sum.turning += inertia.mass * V_[i].at(arm);
    }
  }
  return {sum.position / group.mass, sum.bases / group.mass, sum.turning / group.mass};
}

/// Returns the motion of the group's centre of mass at (q, v).
CenterMotion FreeGroups::motion_at(const Model& model, const Group& group, const VectorRef& q,
                                   const VectorRef& v) {
  for (const int t : group.trees)
    compute_poses(model, q, bodies_of(model.trees()[static_cast<size_t>(t)]), *scratch_);
  return motion_of(model, group, v, *scratch_);
}

/// Returns the sum of the group's weight and external wrenches, in W [N].
Vector3 FreeGroups::weight_and_wrenches(const StepContext& at, const Group& group,
                                        const Input& input) const {
  Vector3 force = Vector3::Zero();
  if (at.effects.has(Effect::kGravity)) force = group.heavy_mass * at.model.gravity();
  if (!at.effects.has(Effect::kExternalWrenches)) return force;
  for (const ExternalWrench& w : input.wrenches)
    if (group.holds(at.model.body(w.body).tree)) force += w.wrench.force;
  return force;
}

void FreeGroups::correct(const StepContext& at, const Input& input, const VectorRef& q_reached,
                         State& next) {
  const Model& model = at.model;
  const double h = at.h();
  const bool euler = at.options.integrator == Integrator::kSemiImplicitEuler;
  const bool applied = at.effects.has(Effect::kAppliedForces) && input.applied_force.size() > 0;
  for (const Group& group : groups()) {
    Vector3 force = weight_and_wrenches(at, group, input);
    if (applied) force += force_on_bases(model, group.trees, input.applied_force);
    const Vector3 gain = h / group.mass * force;
    CenterMotion reached = motion_at(model, group, q_reached, next.v);
    const Vector3 faster = gain - velocity_between(group.start, reached);
    Vector3 farther = h * faster;
    if (!euler || at.options.mean_velocity_forces) {
      if (q_reached.data() != next.q.data()) reached = motion_at(model, group, next.q, next.v);
      const Vector3 mean = group.start.bases + group.start.turning + (euler ? 1.0 : 0.5) * gain;
      farther = group.start.position + h * mean - reached.position;
    }
    for (const int t : group.trees) {
      const Body& root = base(model, t);
      const Matrix3& R_WJ = root.X_PJ.rotation;
      next.v.segment<3>(root.v_index) += R_WJ.transpose() * faster;
      next.q.segment<3>(root.q_index) += R_WJ.transpose() * farther;
    }
  }
}

void FreeGroups::restore(const StepContext& at, const Input& known, const VectorRef& q_reached,
                         const VectorRef& v_next, const Kinematics& data,
                         std::vector<Force>& forces, VectorOut u) {
  const Model& model = at.model;
  for (size_t i = 0; i < count_; ++i) {
    Group& group = groups_[i];
    const Vector3 gained =
        group.mass * velocity_between(group.start, motion_at(model, group, q_reached, v_next));
    group.shift = (gained / at.h() - weight_and_wrenches(at, group, known) -
                   force_on_bases(model, group.trees, u)) /
                  group.mass;
    std::fill(forces.begin(), forces.end(), Force());
    for (const int t : group.trees) {
      const Tree& tree = model.trees()[static_cast<size_t>(t)];
      for (int b = tree.body_begin; b < tree.body_end; ++b) {
        const SpatialInertia& inertia = model.body(b).inertia;
        const Vector3 force = inertia.mass * group.shift;
        forces[static_cast<size_t>(b)] = {(data.X_WB[b].rotation * inertia.center).cross(force),
                                          force};
      }
    }
    tau_.setZero();
    project_on_joints(model, data, forces, tau_);
    u += tau_;
  }
}

}  // namespace counterpoint
