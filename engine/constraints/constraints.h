// The constraints of one step as they follow from (q, w): contacts, closures, joint limits,
// speed limits, dry joint friction, mimic joints.
#pragma once

#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/bounce.h"
#include "counterpoint/engine/constraints/friction_slip.h"
#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// Rows of motion of body B relative to body A: velocity at `position` along the columns of
/// `frame`, then angular velocity about them. A contact's columns are n, t1, t2.
struct PairConstraint {
  int body_a = 0, body_b = 0;
  Vector3 position = Vector3::Zero();  ///< in W [m]; one for both bodies, so that momentum is kept
  Matrix3 frame = Matrix3::Identity();
  /// Of a contact: where its friction acts, across the normal from `position` [m]
  /// (contact_patch.h).
  Vector3 rub = Vector3::Zero();
  int first = 0;  ///< of the six rows (3 linear, 3 angular) the law has rows first, first + 1, ...
  contact::Law law;
  double gap_bias = 0.0;  ///< of a contact: the bias that recovers all that is to be [m/s]
  /// Of a contact that bounces in this step: when after its start (bounce.h) [s]; else 0.
  double impact_time = 0.0;
  /// Its friction is that of a patch that spins (contact_patch.h): so much of it is left.
  bool spins = false;
  double strength = 1.0;
  /// The contact whose sliding speed law.slip_speed is a share of (friction_slip.h), or -1.
  int fastest = -1;
};

/// One row on joint coordinates: y = coefficient[0] w[v_index[0]] + coefficient[1] w[v_index[1]] +
/// b.
struct JointConstraint {
  Effect effect = Effect::kLimits;  ///< what it is a row of
  contact::Law law;
  int v_index[2] = {-1, -1};  ///< the second is -1 for limits and dry friction
  double coefficient[2] = {1.0, 0.0};
  /// Of a joint limit [rad or m] and as in PairConstraint; NaN where there is no gap.
  double gap = std::numeric_limits<double>::quiet_NaN();
  double gap_bias = std::numeric_limits<double>::quiet_NaN();
};

/// A contact candidate without rows, and what tells from velocities alone whether it may get them
/// (parked_contacts.h).
struct ParkedContact {
  collision::Candidate candidate;  ///< moved to where the bodies meet
  int body_a = 0, body_b = 0;
  Vector3 velocity = Vector3::Zero();  ///< of B relative to A there at the start, in W [m/s]
  double gap = 0.0;   ///< at least so much is left where the bodies turn within the step [m]
  double slip = 0.0;  ///< closing speed: this times the tangential speed [-]
  double spin = 0.0;  ///< and this [m] times the relative angular speed
};

/// Two geometries so far from each other that all contacts they may have are parked: what is needed
/// to see from the velocities alone that they stay so (parked_contacts.h).
struct FarPair {
  std::pair<int, int> geometries;
  int body_a = 0, body_b = 0;
  double gap = 0.0;                  ///< at least so far apart, by what encloses them [m]
  Vector3 middle = Vector3::Zero();  ///< of the smaller one, in W [m]
  double radius = 0.0;               ///< of that about its middle [m]
  double slip = 1.0;                 ///< closing speed at most this times the relative speed [-]
  double spin = 0.0;                 ///< and this [m] times the relative angular speed
  /// Turning within the step brings the surfaces closer by at most turn + turn_slope gap [m].
  double turn = 0.0, turn_slope = 0.0;
};

struct ConstraintSet {
  std::vector<collision::Candidate> contacts;
  /// First the contacts, one each, then those of `closures`.
  std::vector<PairConstraint> pairs;
  std::vector<int> closures;  ///< index into Model::closures, one for each pair behind the contacts
  std::vector<JointConstraint> joints;
  std::vector<ParkedContact> parked;  ///< by pair of geometries, ascending
  std::vector<FarPair> far;           ///< ascending; of these no contacts are known
  double max_penetration = 0.0;       ///< [m]

  bool empty() const { return pairs.empty() && joints.empty(); }
  void clear() {
    contacts.clear();
    pairs.clear();
    closures.clear();
    joints.clear();
    parked.clear();
    far.clear();
    max_penetration = 0.0;
  }
};

/// Are there closures or mimic joints?
bool has_equalities(const ConstraintSet& constraints);

/// Calls visit(tree_a, tree_b) for every constraint; -1 for the world, or if there is no second.
template <class Visit>
void for_each_constraint(const Model& model, const ConstraintSet& constraints, Visit visit) {
  for (const PairConstraint& pair : constraints.pairs)
    visit(model.body(pair.body_a).tree, model.body(pair.body_b).tree);
  for (const JointConstraint& joint : constraints.joints) {
    visit(model.tree_of_velocity(joint.v_index[0]),
          joint.v_index[1] < 0 ? -1 : model.tree_of_velocity(joint.v_index[1]));
  }
}

/// Makes sets of the trees that constraints join.
inline void join_constrained_trees(const Model& model, const ConstraintSet& constraints,
                                   contact::DisjointSets& trees) {
  trees.reset(model.num_trees());
  if (model.num_trees() < 2) return;
  for_each_constraint(model, constraints, [&](int a, int b) {
    if (a >= 0 && b >= 0) trees.join(a, b);
  });
}

/// A velocity coordinate with dry friction, and the body it moves.
struct DryCoordinate {
  int v_index = 0, body = 0;
};

/// A coordinate of a limited joint, and the body it moves.
struct LimitedCoordinate {
  int q_index = 0, v_index = 0, body = 0;
  double lower = 0.0, upper = 0.0;  ///< [m, rad]
};

/// A velocity coordinate with a speed limit [m/s, rad/s], and the body it moves.
struct SpeedLimit {
  int v_index = 0, body = 0;
  double limit = 0.0;
};

/// Bodies asleep, and the world (sleep.h). A list by body, empty where none sleeps.
struct Idle {
  std::span<const char> bodies = {};
  bool operator()(int body) const { return !bodies.empty() && bodies[body]; }
  bool sleeps(int body) const { return body != 0 && (*this)(body); }
};

/// A closure has the compliance of its own inverse mass up to a body of so many times the mass that
/// it moves, which may hang on it; beyond, that of a body of this share of the heaviest one's mass:
/// no load opens it by more than 100 eps kHeaviestHeld h^2 g / beta, 0.01 mm at 5 ms.
inline constexpr double kHeaviestHeld = 100.0;

/// A rod hit at one end: the far end may be twice as fast as any point was before. The kinetic
/// energy bounds it, and the end of a rod carries a quarter of the mass.
inline constexpr double kImpactSpeedUp = 2.0;

/// A velocity that a step comes to: nv, and of the bodies, in W, where the caller knows these.
struct Reached {
  VectorRef velocity;
  const std::vector<Motion>* of_bodies = nullptr;
};

/// Finds the constraints of a model. Scratch memory inside: one per thread.
class ConstraintFinder {
 public:
  ConstraintFinder(const Model& model, InverseWeights weights);

  /// Everything which may push within the step, judged from (q, v) alone: the inverse must come to
  /// the same set. Needs compute_poses and compute_velocities.
  /// Only the effects given are looked at; constraints between none but idle bodies are left out
  /// (Collider::compute_candidates).
  void find(const StepContext& at, const Kinematics& data, ConstraintSet& out, EffectCounts& counts,
            Idle idle = {});

  /// Adds to what find() found what the velocity w (nv) that a step came to runs into from afar
  /// (joint_limits.h, parked_contacts.h); for w that are a solution with it, nothing. False if
  /// nothing was added. Where contacts are parked it needs the poses of find().
  bool find_overrun(const StepContext& at, const Reached& w, const Kinematics& data,
                    ConstraintSet& out, Idle idle = {});

  /// The part of find_overrun that is about contacts.
  bool find_reached_contacts(const StepContext& at, const Reached& w, const Kinematics& data,
                             ConstraintSet& out);

  /// Gives rows to all contacts that are parked, those of far pairs too. Needs what find() needed.
  void unpark_all(const StepContext& at, const Kinematics& data, ConstraintSet& out);

  /// A contact that may bounce: its gap [m], and its velocity now in its rows [m/s].
  struct Bouncing {
    const Material& surface;
    const PairConstraint& contact;
    double gap;
    const Vector3& v;
  };
  /// What restitution makes of it in the step; V_WB in data. Nothing of trees that are wedged: what
  /// is held from several sides would gain energy by Newton's law of impact. Of the last find().
  Bounce find_contact_bounce(const Model& model, const SimulationOptions& options,
                             EffectSet effects, const Kinematics& data, const Bouncing& what) const;
  /// Whether some body of a contact's trees is farther inside another one than the margin. Of the
  /// last find().
  bool is_wedged(const PairConstraint& contact) const {
    return wedged_[contact.body_a] || wedged_[contact.body_b];
  }
  /// The relative acceleration that this reckons with, in W [m/s^2].
  Vector3 relative_fall(EffectSet effects, const PairConstraint& contact) const;

  /// By tree: a fast body may strike it within the step, and what may touch it was looked for as
  /// far as that one goes. Of the last find().
  std::span<const char> in_reach_of_fast() const { return in_reach_; }

  /// Radius [m] of each body's geometry about the body origin.
  const std::vector<double>& radii() const { return radius_; }
  const InverseWeights& weights() const { return weights_; }
  const collision::Collider& collider() const { return collider_; }

 private:
  void set_margins(const StepContext& at, const Kinematics& data, Idle idle);
  void find_candidates(const StepContext& at, const Kinematics& data, ConstraintSet& out,
                       Idle idle);
  FarPair locate(const Model& model, const std::pair<int, int>& pair, EffectSet effects,
                 const Kinematics& data) const;
  const Material& material_of(const Model& model, EffectSet effects,
                              const collision::Candidate& candidate);
  void move_to_meeting(const Model& model, collision::Candidate& candidate) const;
  ParkedContact describe(const StepContext& at, const Kinematics& data,
                         const collision::Candidate& candidate);
  Vector3 make_contact(const StepContext& at, const Kinematics& data, const ParkedContact& open,
                       PairConstraint& contact);
  void give_rows(const StepContext& at, const ParkedContact& parked, PairConstraint& contact,
                 ConstraintSet& out);
  void park_contacts_of(const StepContext& at, const FarPair& far, const Kinematics& data,
                        ConstraintSet& out);
  bool spread_travel(const Model& model, std::span<const std::pair<int, int>> close,
                     double threshold, double own_threshold);
  void find_contacts(const StepContext& at, const Kinematics& data, ConstraintSet& out,
                     EffectCounts& counts, Idle idle);
  void find_crowds(const StepContext& at);
  void stiffen_closures(const Model& model, ConstraintSet& out);
  double turning_advance(const Vector3& n, const Vector3& arm, double h, int body,
                         const Kinematics& data);
  double gap_less_turning(const PairConstraint& contact, double gap, double h,
                          const Kinematics& data);

  InverseWeights weights_;
  collision::Collider collider_;
  std::vector<double> radius_;  ///< of each body's geometry about the body origin [m]
  std::vector<double> travel_;  ///< of each body's surface within the step [m]
  std::vector<double> slack_;   ///< what impacts and applied forces may add to that [m]
  std::vector<double> margin_;  ///< both
  std::vector<char> in_reach_;  ///< by tree, see in_reach_of_fast
  /// By body, h^2 |w|^2 / 2: of a place at an arm no more than this share of the arm's length is
  /// between turning and h w x arm, since |(exp(a) - 1 - a x) arm| <= |a|^2 |arm| / 2.
  Eigen::ArrayXd turn_share_;
  Eigen::ArrayXd fastest_point_;  ///< by body: speed of its geometry, at most [m/s]
  std::vector<collision::Candidate> candidates_;
  /// By body: some body of its tree is farther inside another one than the margin of contacts.
  std::vector<char> wedged_;
  std::vector<int> crowd_;  ///< by body: contacts that its tree may come to in the step
  /// Some body may hang on closures of bodies more than kHeaviestHeld times lighter.
  bool holds_much_;
  contact::DisjointSets islands_;
  std::vector<double> least_weight_;  ///< by tree, of the island that has it as root [1/kg]
  std::vector<Vector3> fall_;         ///< free_fall
  std::vector<double> speed_;         ///< at which each contact with rows slides at the start [m/s]
  FrictionSlip friction_slip_;
  std::vector<DryCoordinate> dry_;  ///< with dry friction
  std::vector<LimitedCoordinate> limited_;
  std::vector<SpeedLimit> speed_limits_;
  std::vector<Motion> acceleration_;         ///< scratch of closures
  std::vector<Motion> V_;                    ///< bodies' velocities at the end of a step
  std::pair<int, int> material_of_{-1, -1};  ///< the pair of geometries that material_ is of
  Material material_;
  std::vector<Quaternion> turn_;  ///< of each body within the step at its velocity, where known
  std::vector<char> turn_known_;
};

/// Of body B relative to A at a position in W [m/s], from the bodies' V_WB.
Vector3 relative_velocity_at(const Vector3& position, int body_a, int body_b,
                             const Kinematics& data, const std::vector<Motion>& V);

/// Velocity of B relative to A in the rows of a constraint [m/s, rad/s], from the bodies' V_WB
/// (data.h).
contact::Rows relative_velocity(const PairConstraint& pair, const Kinematics& data,
                                const std::vector<Motion>& V);

}  // namespace counterpoint
