// The constraints of one step, found from (q, w): contacts, closures, joint limits, speed limits,
// dry joint friction and mimic joints.
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

/// Constraint rows on the motion of body B relative to body A: linear velocity at `position` along
/// the columns of `frame` (n, t1, t2 for a contact), then angular velocity about them.
struct PairConstraint {
  int body_a = 0, body_b = 0;
  Vector3 position = Vector3::Zero();  ///< in W [m]; one point for both bodies: keeps momentum
  Matrix3 frame = Matrix3::Identity();
  /// Contact: tangential offset from `position` to the point where friction acts, in W [m]
  /// (contact_patch.h).
  Vector3 friction_point = Vector3::Zero();
  /// The law acts on rows first, first + 1, ... of the six (3 linear, 3 angular).
  int first = 0;
  contact::Law law;
  double gap_bias = 0.0;  ///< contact: bias that would remove the whole recoverable overlap [m/s]
  /// Contact that bounces in this step: time of impact after the start of the step (bounce.h) [s];
  /// else 0.
  double impact_time = 0.0;
  /// Whether friction is that of a spinning patch (contact_patch.h), and the fraction of the
  /// sliding friction coefficients that it leaves.
  bool spins = false;
  double strength = 1.0;
  /// Index of the contact whose sliding speed sets law.slip_speed (friction_slip.h), or -1.
  int fastest_contact = -1;
};

/// One row on joint coordinates: y = sum of coefficient[k] w[v_index[k]] over k = 0, 1, plus the
/// bias b.
struct JointConstraint {
  Effect effect = Effect::kLimits;  ///< the effect that the row belongs to
  contact::Law law;
  int v_index[2] = {-1, -1};  ///< the second is -1 for limits and dry friction
  double coefficient[2] = {1.0, 0.0};
  /// Joint limit: gap [rad or m], and the bias as in PairConstraint [rad/s or m/s]; NaN if there is
  /// no gap.
  double gap = std::numeric_limits<double>::quiet_NaN();
  double gap_bias = std::numeric_limits<double>::quiet_NaN();
};

/// A contact candidate without rows, and the data that decide from velocities alone whether it
/// needs rows (parked_contacts.h).
struct ParkedContact {
  collision::Candidate candidate;  ///< its position moved to the expected meeting point
  int body_a = 0, body_b = 0;
  Vector3 velocity = Vector3::Zero();  ///< at the start, of B relative to A there, in W [m/s]
  double gap = 0.0;   ///< lower bound of the gap after the rotation within the step [m]
  double slip = 0.0;  ///< closing speed per tangential speed [-]
  double spin = 0.0;  ///< closing speed per relative angular speed [m]
};

/// Two geometries so far apart that all their possible contacts are parked, and the data that
/// decide from velocities alone whether this stays true (parked_contacts.h).
struct FarPair {
  std::pair<int, int> geometries;
  int body_a = 0, body_b = 0;
  double gap = 0.0;                  ///< lower bound of the distance, from bounding volumes [m]
  Vector3 middle = Vector3::Zero();  ///< centre of the smaller geometry, in W [m]
  double radius = 0.0;               ///< radius of that geometry about its centre [m]
  double slip = 1.0;  ///< upper bound of the closing speed: slip times the relative speed [-]
  double spin = 0.0;  ///< plus spin times the relative angular speed [m]
  /// Rotation within the step brings the surfaces closer by at most turn + turn_slope gap [m].
  double turn = 0.0, turn_slope = 0.0;
};

struct ConstraintSet {
  std::vector<collision::Candidate> contacts;
  /// The contacts, one each, then the rows of `closures`.
  std::vector<PairConstraint> pairs;
  std::vector<int> closures;  ///< index into Model::closures, one for each pair behind the contacts
  std::vector<JointConstraint> joints;
  std::vector<ParkedContact> parked;  ///< sorted by pair of geometries
  std::vector<FarPair> far;      ///< sorted; the contacts of these pairs have not been computed
  double max_penetration = 0.0;  ///< [m]

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

/// Returns whether there are closures or mimic joints.
bool has_equalities(const ConstraintSet& constraints);

/// Calls visit(tree_a, tree_b) for every constraint; -1 for the world or a missing second tree.
template <class Visit>
void for_each_constraint(const Model& model, const ConstraintSet& constraints, Visit visit) {
  for (const PairConstraint& pair : constraints.pairs)
    visit(model.body(pair.body_a).tree, model.body(pair.body_b).tree);
  for (const JointConstraint& joint : constraints.joints) {
    visit(model.tree_of_velocity(joint.v_index[0]),
          joint.v_index[1] < 0 ? -1 : model.tree_of_velocity(joint.v_index[1]));
  }
}

/// Joins the trees that share a constraint into sets.
inline void join_constrained_trees(const Model& model, const ConstraintSet& constraints,
                                   contact::DisjointSets& trees) {
  trees.reset(model.num_trees());
  if (model.num_trees() < 2) return;
  for_each_constraint(model, constraints, [&](int a, int b) {
    if (a >= 0 && b >= 0) trees.join(a, b);
  });
}

/// A velocity coordinate with dry friction, and the body that it moves.
struct DryCoordinate {
  int v_index = 0, body = 0;
};

/// The coordinate of a limited joint, and the body that it moves.
struct LimitedCoordinate {
  int q_index = 0, v_index = 0, body = 0;
  double lower = 0.0, upper = 0.0;  ///< [m, rad]
};

/// A velocity coordinate with a speed limit [m/s, rad/s], and the body that it moves.
struct SpeedLimit {
  int v_index = 0, body = 0;
  double limit = 0.0;
};

/// The idle bodies: those that sleep (sleep.h), and the world. One entry per body; empty if none
/// sleeps. operator(): the body is idle; sleeps(): it is idle and not the world.
struct SleepMask {
  std::span<const char> bodies = {};
  bool operator()(int body) const { return !bodies.empty() && bodies[body]; }
  bool sleeps(int body) const { return body != 0 && (*this)(body); }
};

/// Largest mass ratio that a closure holds at its normal stiffness. The compliance of a closure
/// scales with its own inverse mass, unless it may carry a body more than this many times heavier
/// than the bodies that it moves; it then scales with kHeaviestHeld times the inverse mass of the
/// heaviest body. No load opens a closure by more than 100 eps kHeaviestHeld h^2 g / beta, 0.01 mm
/// at 5 ms.
inline constexpr double kHeaviestHeld = 100.0;

/// Largest factor by which an impact raises the speed of the fastest point of a body: the far end
/// of a rod hit at one end, by conservation of kinetic energy, since the end of a rod carries a
/// quarter of its mass.
inline constexpr double kImpactSpeedUp = 2.0;

/// A velocity at the end of a step: nv, and V_WB of all bodies where the caller has computed them.
struct Reached {
  VectorRef velocity;
  const std::vector<Motion>* of_bodies = nullptr;
};

/// Finds the constraints of a model. Holds scratch memory: use one per thread.
class ConstraintFinder {
 public:
  ConstraintFinder(const Model& model, InverseWeights weights);

  /// Finds every constraint that may act within the step, from (q, v) alone, so that the inverse
  /// finds the same set. Requires compute_poses and compute_velocities. Only the given effects are
  /// considered; constraints whose bodies are all idle are left out (Collider::compute_candidates).
  void find(const StepContext& at, const Kinematics& data, ConstraintSet& out, EffectCounts& counts,
            SleepMask idle = {});

  /// Adds the rows that the end velocity w (nv) needs beyond those of find(): limits and parked
  /// contacts that it reaches (joint_limits.h, parked_contacts.h). Returns false if none was added,
  /// which holds for the w of a solution that includes them. Parked contacts require the poses of
  /// find().
  bool find_overrun(const StepContext& at, const Reached& w, const Kinematics& data,
                    ConstraintSet& out, SleepMask idle = {});

  /// Adds the contact rows of find_overrun.
  bool find_reached_contacts(const StepContext& at, const Reached& w, const Kinematics& data,
                             ConstraintSet& out);

  /// Gives rows to all parked contacts, including those of far pairs. Same requirements as find().
  void unpark_all(const StepContext& at, const Kinematics& data, ConstraintSet& out);

  /// A contact that may bounce: its gap [m], and its present velocity in its rows [m/s].
  struct Bouncing {
    const Material& surface;
    const PairConstraint& contact;
    double gap;
    const Vector3& v;
  };
  /// Finds the bounce of a contact in this step; `data` holds V_WB. Wedged trees do not bounce: a
  /// body held from several sides would gain energy under Newton's law of impact. Valid for the
  /// last find().
  Bounce find_contact_bounce(const Model& model, const SimulationOptions& options,
                             EffectSet effects, const Kinematics& data, const Bouncing& what) const;
  /// Whether a body of the contact's trees penetrates another one by more than the margin. Valid
  /// for the last find().
  bool is_wedged(const PairConstraint& contact) const {
    return wedged_[contact.body_a] || wedged_[contact.body_b];
  }
  /// Relative free-fall acceleration that the bounce assumes, in W [m/s^2].
  Vector3 relative_fall(EffectSet effects, const PairConstraint& contact) const;

  /// Per tree: a fast body may reach it this step, so contacts were searched out to that body's
  /// travel. Valid for the last find().
  std::span<const char> in_reach_of_fast() const { return in_reach_; }

  /// Radius [m] of each body's geometry about the body origin.
  const std::vector<double>& radii() const { return radius_; }
  const InverseWeights& weights() const { return weights_; }
  const collision::Collider& collider() const { return collider_; }

 private:
  void set_margins(const StepContext& at, const Kinematics& data, SleepMask idle);
  void find_candidates(const StepContext& at, const Kinematics& data, ConstraintSet& out,
                       SleepMask idle);
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
                     EffectCounts& counts, SleepMask idle);
  void find_crowds(const StepContext& at);
  void stiffen_closures(const Model& model, ConstraintSet& out);
  double turning_advance(const Vector3& n, const Vector3& arm, double h, int body,
                         const Kinematics& data);
  double gap_less_turning(const PairConstraint& contact, double gap, double h,
                          const Kinematics& data);

  InverseWeights weights_;
  collision::Collider collider_;
  std::vector<double> radius_;  ///< radius of each body's geometry about the body origin [m]
  std::vector<double> travel_;  ///< upper bound of each body's surface travel within the step [m]
  std::vector<double> slack_;   ///< allowance for impacts and applied forces beyond travel_ [m]
  std::vector<double> margin_;  ///< travel_ + slack_ [m]
  std::vector<char> in_reach_;  ///< per tree, see in_reach_of_fast
  /// Per body, h^2 |w|^2 / 2: the displacement of a point by the rotation within the step differs
  /// from h w x arm by at most this fraction of |arm|, since |(exp(a) - 1 - a x) arm| <= |a|^2
  /// |arm| / 2.
  Eigen::ArrayXd turn_share_;
  Eigen::ArrayXd fastest_point_;  ///< per body: upper bound of the speed of its geometry [m/s]
  std::vector<collision::Candidate> candidates_;
  /// Per body: some body of its tree penetrates another one by more than the contact margin.
  std::vector<char> wedged_;
  std::vector<int> crowd_;  ///< per body: contacts that its tree may close in the step
  /// Some closure may carry a body too heavy for its own compliance (kHeaviestHeld).
  bool holds_much_;
  contact::DisjointSets islands_;
  std::vector<double> least_weight_;  ///< per island, stored at its root tree [1/kg]
  std::vector<Vector3> fall_;         ///< free_fall(model) [m/s^2]
  std::vector<double> speed_;         ///< initial sliding speed of each contact with rows [m/s]
  FrictionSlip friction_slip_;
  std::vector<DryCoordinate> dry_;  ///< coordinates with dry friction
  std::vector<LimitedCoordinate> limited_;
  std::vector<SpeedLimit> speed_limits_;
  std::vector<Motion> acceleration_;         ///< scratch of find_closures
  std::vector<Motion> V_;                    ///< body velocities at the end of a step
  std::pair<int, int> material_of_{-1, -1};  ///< pair of geometries that has material_
  Material material_;
  /// Rotation of each body within the step at its present velocity, valid where turn_known_.
  std::vector<Quaternion> turn_;
  std::vector<char> turn_known_;
};

/// Velocity of body B relative to A at a position in W [m/s], from the bodies' V_WB.
Vector3 relative_velocity_at(const Vector3& position, int body_a, int body_b,
                             const Kinematics& data, const std::vector<Motion>& V);

/// Velocity of body B relative to A in the rows of a constraint [m/s, rad/s], from the bodies' V_WB
/// (data.h).
contact::Rows relative_velocity(const PairConstraint& pair, const Kinematics& data,
                                const std::vector<Motion>& V);

}  // namespace counterpoint
