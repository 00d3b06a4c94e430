// The constraints of one step: contacts, closures, joint limits, speed limits, dry joint friction,
// mimic joints, tendons and actuators, with their laws.
#pragma once

#include <initializer_list>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

/// The error that rows of a closure hold at zero (closures.h).
enum class ClosureError : unsigned char {
  kApart,     ///< the vector between the anchors, in W
  kOffset,    ///< position of B's anchor in A's anchor frame
  kDistance,  ///< excess of the distance of the anchors
  kTurn,      ///< rotation vector between the anchor frames
  kAxis,      ///< cross product of the z axes, in A's anchor frame
  kThread,    ///< way along a screw beyond that of its turns
};

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
  ClosureError error = ClosureError::kApart;  ///< closures only
  contact::Law law;
  /// Screw: the row adds this [m/rad] times the angular velocity about its axis.
  double lead = 0.0;
  double gap_bias = 0.0;  ///< contact: bias that would remove the whole recoverable overlap [m/s]
  /// Contact of soft surfaces: displacements leave its overlap to the spring. Closure: its rows are
  /// a spring.
  bool soft = false;
  /// Contact that bounces in this step: time of impact after the start of the step (bounce.h) [s];
  /// else 0.
  double impact_time = 0.0;
  /// Whether friction is that of a spinning patch (contact_patch.h), and the fraction of the
  /// sliding friction coefficients that it leaves.
  bool spins = false;
  double strength = 1.0;
  /// Index of the contact whose sliding speed sets law.slip_speed (friction_slip.h), or -1.
  int fastest_contact = -1;
  /// Axis of the surface of body A or B whose friction depends on direction, a unit vector in W;
  /// zero if none does. The first tangent then has the larger coefficient.
  Vector3 friction_axis = Vector3::Zero();
  bool axis_of_b = false;

  /// Contact: whether a surface moves on its body (Material::surface_velocity).
  bool has_belt() const { return law.bias[1] != 0.0 || law.bias[2] != 0.0; }
};

/// A coordinate of v in a row on joint coordinates.
struct RowTerm {
  int v_index = 0;
  double coefficient = 1.0;
};

/// The part of a tendon that a row belongs to; springs and servos have given gains.
enum class TendonPart : unsigned char {
  kNone,
  kSpring,
  kShortSpring,  ///< acts below the shortest rest length
  kLongSpring,   ///< acts above the longest one
  kServo,
  kFriction,
  kLowerLimit,
  kUpperLimit,
};

/// One row on the coordinates of one or two trees: y = sum of coefficient w[v_index] over its terms
/// (ConstraintSet::terms), plus the bias b.
struct JointConstraint {
  Effect effect = Effect::kLimits;  ///< the effect that the row belongs to
  contact::Law law;
  int first_term = 0, num_terms = 0;  ///< in ConstraintSet::row_terms
  int tendon = -1;                    ///< index into Model::tendons, or -1
  TendonPart part = TendonPart::kNone;
  int actuator = -1;  ///< index into Model::actuators, or -1; `part` is kServo then
  /// Springs, servos, actuators: derivative of the bias by the length along the row [1/s].
  double bias_by_length = 0.0;
  /// Breakaway friction: derivative of law.bound by the velocity at the start [kg or kg m^2].
  double bound_by_velocity = 0.0;
  /// Sign of the force along the tendon that a positive impulse gives.
  double along() const {
    return part == TendonPart::kLongSpring || part == TendonPart::kUpperLimit ? -1.0 : 1.0;
  }
  bool has_given_gains() const { return part >= TendonPart::kSpring && part <= TendonPart::kServo; }
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
  /// Velocity of the surface of B relative to that of A from their motion on the bodies
  /// (Material::surface_velocity), along the tangents, in W [m/s].
  Vector3 surface = Vector3::Zero();
  Vector3 velocity = Vector3::Zero();  ///< at the start, of surface B relative to A, in W [m/s]
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
  double surface = 0.0;              ///< upper bound of ParkedContact::surface [m/s]
  double slip = 1.0;  ///< upper bound of the closing speed: slip times the relative speed [-]
  double spin = 0.0;  ///< plus spin times the relative angular speed [m]
  /// Rotation within the step brings the surfaces closer by at most turn + turn_slope gap [m].
  double turn = 0.0, turn_slope = 0.0;
};

/// A contact without rows in the present solve, since it is open (parked_contacts.h).
struct InactiveContact {
  collision::Candidate candidate;
  PairConstraint pair;
};

/// A closure that acts in a step.
struct ActingClosure {
  int index = 0;  ///< into Model::closures
  Pose X_BC;      ///< frame in body B that it makes coincide with A's (Closure::anchor_b)
};

struct ConstraintSet {
  std::vector<collision::Candidate> contacts;
  /// The contacts, one each, then the rows of `closures`.
  std::vector<PairConstraint> pairs;
  std::vector<ActingClosure> closures;  ///< one for each pair behind the contacts
  std::vector<JointConstraint> joints;
  std::vector<RowTerm> row_terms;     ///< the terms of all rows in `joints`, each at least one
  std::vector<ParkedContact> parked;  ///< sorted by pair of geometries
  std::vector<FarPair> far;  ///< sorted; the contacts of these pairs have not been computed
  std::vector<InactiveContact> inactive;  ///< contacts without rows until a step closes them
  double max_penetration = 0.0;           ///< [m]

  /// Returns the terms of a row of this set.
  std::span<const RowTerm> terms(const JointConstraint& row) const {
    return std::span(row_terms).subspan(static_cast<size_t>(row.first_term),
                                        static_cast<size_t>(row.num_terms));
  }
  /// Appends a row with these terms, which must not be in row_terms.
  void add(JointConstraint row, std::span<const RowTerm> with) {
    row.first_term = static_cast<int>(row_terms.size());
    row.num_terms = static_cast<int>(with.size());
    row_terms.insert(row_terms.end(), with.begin(), with.end());
    joints.push_back(row);
  }
  void add(const JointConstraint& row, std::initializer_list<RowTerm> with) {
    add(row, std::span(with.begin(), with.size()));
  }

  bool empty() const { return pairs.empty() && joints.empty(); }
  void clear() {
    contacts.clear();
    pairs.clear();
    closures.clear();
    joints.clear();
    row_terms.clear();
    parked.clear();
    far.clear();
    inactive.clear();
    max_penetration = 0.0;
  }
};

/// Returns whether there are closures or mimic joints.
bool has_equalities(const ConstraintSet& constraints);

/// Returns the trees of a row's coordinates; the second is -1 if there is one only.
inline std::pair<int, int> trees_of(const Model& model, std::span<const RowTerm> terms) {
  const int first = model.tree_of_velocity(terms[0].v_index);
  for (const RowTerm& term : terms.subspan(1)) {
    const int tree = model.tree_of_velocity(term.v_index);
    if (tree != first) return {first, tree};
  }
  return {first, -1};
}

/// Returns the velocity y of a row at w (nv), without its bias.
inline double row_velocity(std::span<const RowTerm> terms, const VectorRef& w) {
  double y = 0.0;
  for (const RowTerm& term : terms) y += term.coefficient * w[term.v_index];
  return y;
}

/// Calls visit(tree_a, tree_b) for every constraint; -1 for the world or a missing second tree.
template <class Visit>
void for_each_constraint(const Model& model, const ConstraintSet& constraints, Visit visit) {
  for (const PairConstraint& pair : constraints.pairs)
    visit(model.body(pair.body_a).tree, model.body(pair.body_b).tree);
  for (const JointConstraint& joint : constraints.joints) {
    const auto [tree_a, tree_b] = trees_of(model, constraints.terms(joint));
    visit(tree_a, tree_b);
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

/// The idle bodies: those that sleep (sleep.h), and the world. One entry per body; empty if none
/// sleeps. operator(): the body is idle; sleeps(): it is idle and not the world.
struct SleepMask {
  std::span<const char> bodies = {};
  bool operator()(int body) const { return !bodies.empty() && bodies[body]; }
  bool sleeps(int body) const { return body != 0 && (*this)(body); }
};

/// A velocity at the end of a step: nv, and V_WB of all bodies where the caller has computed them.
struct Reached {
  VectorRef velocity;
  const std::vector<Motion>* of_bodies = nullptr;
};

}  // namespace counterpoint
