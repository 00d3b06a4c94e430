#include "counterpoint/engine/step/sleep.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace counterpoint {
namespace {

/// Whether the bits are equal: 0 and -0 differ, since results may depend on the sign.
bool same(const VectorX& a, const VectorX& b, int begin, int size) {
  if (size == 0) return true;  // memcmp takes no null pointers
  return std::memcmp(a.data() + begin, b.data() + begin, sizeof(double) * size) == 0;
}

bool same(const VectorX& a, const VectorX& b) {
  return a.size() == b.size() && same(a, b, 0, static_cast<int>(a.size()));
}

bool same_state(const Model& model, const Tree& tree, const State& a, const State& b) {
  const CoordinateRange q = coordinates(model, tree);
  return same(a.v, b.v, tree.v_begin, tree.v_end - tree.v_begin) && same(a.q, b.q, q.begin, q.size);
}

/// Whether the motion h w of a tree is lost in the rounding of its bodies' poses: a few times the
/// rounding of the largest coordinate, and as much at the radius of each body.
bool is_still(const Model& model, const Tree& tree, double h, const VectorX& w,
              const std::vector<double>& radii, const Kinematics& data) {
  constexpr double kRoundoffs = 2.0 * std::numeric_limits<double>::epsilon();
  for (int b = tree.body_begin; b < tree.body_end; ++b) {
    const Body& body = model.body(b);
    const double length =
        kRoundoffs * (radii[b] + data.X_WB[b].translation.lpNorm<Eigen::Infinity>());
    const double angle = radii[b] > 0.0 ? length / radii[b] : kRoundoffs;
    const int nv = joint_nv(body.joint_type);
    const int num_linear = joint_num_linear(body.joint_type);
    for (int j = 0; j < nv; ++j)
      if (!(std::abs(h * w[body.v_index + j]) <= (j < num_linear ? length : angle))) return false;
  }
  return true;
}

}  // namespace

Sleepers::Sleepers(const Model& model)
    : resting_(model.num_trees(), 0),
      asleep_(model.num_trees(), 0),
      idle_(model.num_bodies(), 0),
      island_awake_(model.num_trees(), 0),
      touched_(model.num_trees(), 0),
      penetration_(model.num_trees(), 0.0) {
  idle_[0] = 1;
  islands_.reset(model.num_trees());
  awake_.reserve(model.num_trees());
  woken_.reserve(model.num_trees());
}

void Sleepers::forget() {
  valid_ = false;
  std::fill(resting_.begin(), resting_.end(), 0);
}

void Sleepers::begin(const Model& model, const SimulationOptions& options,
                     const contact::Settings& settings, const State& state, const Input& input) {
  const bool known = valid_ && options == options_ && settings == settings_;
  if (!known) {
    forget();
    options_ = options;
    settings_ = settings;
  }
  std::fill(asleep_.begin(), asleep_.end(), 0);
  if (known) {
    const bool same_force = same(input.applied_force, last_input_.applied_force);
    const auto stays = [&](int t) {
      const Tree& tree = model.trees()[t];
      if (!resting_[t] || !same_state(model, tree, state, last_)) return false;
      return same_force || (input.applied_force.size() == last_input_.applied_force.size() &&
                            same(input.applied_force, last_input_.applied_force, tree.v_begin,
                                 tree.v_end - tree.v_begin));
    };
    std::fill(island_awake_.begin(), island_awake_.end(), 0);
    for (int t = 0; t < model.num_trees(); ++t)
      if (!stays(t)) island_awake_[islands_.root(t)] = 1;
    const bool same_targets = same(input.servo_position, last_input_.servo_position) &&
                              same(input.servo_velocity, last_input_.servo_velocity);
    for (const JointServo& servo : model.servos())
      if (!same_targets) island_awake_[islands_.root(model.body(servo.joint + 1).tree)] = 1;
    const bool same_tendons = same(input.tendon_force, last_input_.tendon_force) &&
                              same(input.tendon_target, last_input_.tendon_target);
    if (!same_tendons) std::fill(island_awake_.begin(), island_awake_.end(), 1);
    // An actuator, or a closure that opens, may act on any tree.
    const bool same_states = still_states_ && same(given_z(model, state.z), last_.z) &&
                             same(input.command, last_input_.command) &&
                             same(input.attach, last_input_.attach);
    if (model.nz() > 0 && !same_states) std::fill(island_awake_.begin(), island_awake_.end(), 1);
    if (!same(input.prescribed, last_input_.prescribed)) wake_prescribed(model);
    for (const ExternalWrench& w : input.wrenches)
      if (w.body != 0) island_awake_[islands_.root(model.body(w.body).tree)] = 1;
    for (int t = 0; t < model.num_trees(); ++t) asleep_[t] = island_awake_[islands_.root(t)] == 0;
  }
  list_awake(model);
}

/// Marks the islands of prescribed joints as awake.
void Sleepers::wake_prescribed(const Model& model) {
  for (int i = 0; i < model.num_joints(); ++i)
    if (model.joint(i).prescribed) island_awake_[islands_.root(model.body(i + 1).tree)] = 1;
}

void Sleepers::wake_all(const Model& model) {
  if (num_sleeping_bodies_ == 0 && !awake_.empty()) return;
  std::fill(asleep_.begin(), asleep_.end(), 0);
  list_awake(model);
}

void Sleepers::list_awake(const Model& model) {
  awake_.clear();
  num_sleeping_bodies_ = 0;
  for (int t = 0; t < model.num_trees(); ++t) {
    const Tree& tree = model.trees()[t];
    std::fill(idle_.begin() + tree.body_begin, idle_.begin() + tree.body_end, asleep_[t]);
    if (asleep_[t]) {
      num_sleeping_bodies_ += tree.body_end - tree.body_begin;
    } else if (!awake_.empty() && awake_.back().end == tree.body_begin) {
      awake_.back().end = tree.body_end;
    } else {
      awake_.push_back({tree.body_begin, tree.body_end});
    }
  }
}

bool Sleepers::wake_touched(const Model& model, const ConstraintSet& constraints,
                            std::span<const char> in_reach) {
  woken_.clear();
  if (num_sleeping_bodies_ == 0) return false;
  std::fill(island_awake_.begin(), island_awake_.end(), 0);
  bool any = false;
  for_each_constraint(model, constraints, [&](int a, int b) {
    if (a < 0 || b < 0 || asleep_[a] == asleep_[b]) return;
    island_awake_[islands_.root(asleep_[a] ? a : b)] = 1;
    any = true;
  });
  for (int t = 0; t < model.num_trees(); ++t) {
    if (!asleep_[t] || !in_reach[t]) continue;
    island_awake_[islands_.root(t)] = 1;
    any = true;
  }
  if (!any) return false;
  for (int t = 0; t < model.num_trees(); ++t) {
    if (!asleep_[t] || !island_awake_[islands_.root(t)]) continue;
    asleep_[t] = 0;
    woken_.push_back({model.trees()[t].body_begin, model.trees()[t].body_end});
  }
  list_awake(model);
  return true;
}

void Sleepers::find_islands(const Model& model, const ConstraintSet& constraints) {
  for (int t = 0; t < model.num_trees(); ++t) {
    if (asleep_[t]) continue;
    islands_.isolate(t);
    touched_[t] = 0;
  }
  for_each_constraint(model, constraints, [&](int a, int b) {
    if (a >= 0) touched_[a] = 1;
    if (b >= 0) touched_[b] = 1;
    if (a >= 0 && b >= 0) islands_.join(a, b);
  });
  // Open contacts join trees as well: else one that sleeps would be woken by its neighbour.
  for (const InactiveContact& open : constraints.inactive)
    if (open.pair.body_a != 0 && open.pair.body_b != 0)
      islands_.join(model.body(open.pair.body_a).tree, model.body(open.pair.body_b).tree);
}

void Sleepers::hold_still(const Model& model, double h, const std::vector<double>& radii,
                          const Kinematics& data, const State& state, const VectorX& displacement,
                          State& next) {
  std::fill(island_awake_.begin(), island_awake_.end(), 0);
  const auto& trees = model.trees();
  for (int t = 0; t < model.num_trees(); ++t) {
    if (!asleep_[t] && !(touched_[t] && is_still(model, trees[t], h, displacement, radii, data)))
      island_awake_[islands_.root(t)] = 1;
  }
  for (int t = 0; t < model.num_trees(); ++t) {
    if (asleep_[t] || island_awake_[islands_.root(t)]) continue;
    const CoordinateRange q = coordinates(model, trees[t]);
    next.q.segment(q.begin, q.size) = state.q.segment(q.begin, q.size);
  }
}

void Sleepers::end(const Model& model, const State& state, const Input& input,
                   const ConstraintSet& constraints, const State& next) {
  last_.q.resize(model.nq());
  last_.v.resize(model.nv());
  last_input_.applied_force = input.applied_force;
  last_input_.servo_position = input.servo_position;
  last_input_.servo_velocity = input.servo_velocity;
  last_input_.tendon_force = input.tendon_force;
  last_input_.tendon_target = input.tendon_target;
  last_input_.prescribed = input.prescribed;
  last_input_.command = input.command;
  last_input_.attach = input.attach;
  last_.z = next.z;
  still_states_ = same(given_z(model, state.z), next.z);
  for (int t = 0; t < model.num_trees(); ++t) {
    if (asleep_[t]) continue;
    const Tree& tree = model.trees()[t];
    penetration_[t] = 0.0;
    resting_[t] = same_state(model, tree, state, next);
    if (!resting_[t]) continue;
    const CoordinateRange q = coordinates(model, tree);
    last_.q.segment(q.begin, q.size) = state.q.segment(q.begin, q.size);
    last_.v.segment(tree.v_begin, tree.v_end - tree.v_begin) =
        state.v.segment(tree.v_begin, tree.v_end - tree.v_begin);
  }
  // The next step may be without the wrench, which is not compared.
  for (const ExternalWrench& w : input.wrenches)
    if (w.body != 0) resting_[model.body(w.body).tree] = 0;
  for (const collision::Candidate& contact : constraints.contacts) {
    for (const int g : {contact.geometry_a, contact.geometry_b}) {
      const int tree = model.body(model.geometries()[g].body).tree;
      if (tree >= 0) penetration_[tree] = std::max(penetration_[tree], -contact.gap);
    }
  }
  valid_ = true;
}

SleepMask Sleepers::sleep_mask() const {
  if (num_sleeping_bodies_ == 0) return {};
  return {idle_};
}

double Sleepers::max_penetration() const {
  double deepest = 0.0;
  for (size_t t = 0; t < asleep_.size(); ++t)
    if (asleep_[t]) deepest = std::max(deepest, penetration_[t]);
  return deepest;
}

}  // namespace counterpoint
