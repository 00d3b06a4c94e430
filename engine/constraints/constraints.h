// Finds the constraints of one step from (q, w).
#pragma once

#include <vector>

#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/constraints/contact_finder.h"
#include "counterpoint/engine/constraints/joint_limits.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"

namespace counterpoint {

/// Largest mass ratio that a closure holds at its normal stiffness. The compliance of a closure
/// scales with its own inverse mass, unless it may carry a body more than this many times heavier
/// than the bodies that it moves; it then scales with kHeaviestHeld times the inverse mass of the
/// heaviest body. No load opens a closure by more than 100 eps kHeaviestHeld h^2 g / beta, 0.01 mm
/// at 5 ms.
inline constexpr double kHeaviestHeld = 100.0;

/// A velocity coordinate with dry friction, and the body that it moves.
struct DryCoordinate {
  int v_index = 0, body = 0;
};

/// Returns the bound of the dry friction of a coordinate [N, N m] in a step from the velocity v
/// [m/s, rad/s], with its derivatives; those by friction are upward where it is the same at rest.
SlidingFriction dry_friction_at(const Model& model, EffectSet effects, int v_index, double v);

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

  ContactFinder& contacts() { return contacts_; }
  const ContactFinder& contacts() const { return contacts_; }
  const InverseWeights& weights() const { return weights_; }
  const collision::Collider& collider() const { return contacts_.search().collider(); }
  /// Radius [m] of each body's geometry about the body origin.
  const std::vector<double>& radii() const { return contacts_.search().radii(); }

 private:
  void stiffen_closures(const Model& model, ConstraintSet& out);

  InverseWeights weights_;
  ContactFinder contacts_;
  /// Some closure may carry a body too heavy for its own compliance (kHeaviestHeld).
  bool holds_much_;
  contact::DisjointSets islands_;
  std::vector<double> least_weight_;  ///< per island, stored at its root tree [1/kg]
  std::vector<DryCoordinate> dry_;    ///< coordinates with dry friction
  std::vector<LimitedCoordinate> limited_;
  std::vector<SpeedLimit> speed_limits_;
  std::vector<Motion> acceleration_;  ///< scratch of find_closures
};

/// Velocity of body B relative to A at a position in W [m/s], from the bodies' V_WB.
Vector3 relative_velocity_at(const Vector3& position, int body_a, int body_b,
                             const Kinematics& data, const std::vector<Motion>& V);

/// Velocity of body B relative to A in the rows of a constraint [m/s, rad/s], from the bodies' V_WB
/// (data.h).
contact::Rows relative_velocity(const PairConstraint& pair, const Kinematics& data,
                                const std::vector<Motion>& V);

}  // namespace counterpoint
