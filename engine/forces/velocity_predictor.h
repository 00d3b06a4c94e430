// Prediction of the velocity at the end of a step from (q, w) alone.
//
// Gravity, velocity-dependent forces, the joints' own springs and dampers, closures and mimic
// joints are functions of (q, w), and so is the velocity that they lead to. Forces at the velocity
// in the middle of a step (mid_velocity.h, midpoint.h) use this prediction, and the inverse, which
// knows (q, w), finds the same one. Applied forces are left out, since the inverse has to find
// them. Trees with servos, and trees that contacts, limits or dry friction touch in the step, get
// no prediction: it would lack the forces that hold them.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/dynamics/equality_solver.h"
#include "counterpoint/engine/forces/mid_velocity.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

class VelocityPredictor {
 public:
  explicit VelocityPredictor(const Model& model);

  /// The trees that a prediction is requested for.
  enum class Of {
    kLinkages,         ///< trees of several bodies that rotate
    kUnderEqualities,  ///< rotating trees under closures or mimic joints
    kAllLinkages,      ///< trees of several bodies, at rest too: the limit of the prediction there
  };

  /// Predicts the velocities of the requested trees in `ranges` for a step from (q, v), under
  /// gravity [m/s^2] and the constraints found there. The smooth forces act over `span` [s] of the
  /// step, before the impulses. Needs compute_poses, compute_velocities and the mean forces of
  /// free_flight.h, and no applied forces in `data`. It completes the inertias of these trees and
  /// overwrites the scratch memory of aba.
  void find(const StepContext& at, Of of, double span, const Vector3& gravity,
            const ConstraintSet& constraints, std::span<const BodyRange> ranges, Data& data);

  /// A second pass for trees under closures and mimic joints, after `find` (kLinkages): it takes
  /// velocity-dependent forces at the velocity in the middle of the step that the first pass found,
  /// and aims closures at the pose that this velocity leads to (closures.h), in `constraints` too.
  /// The caller sets the mean forces of these trees afterwards.
  void refine(const StepContext& at, const Vector3& gravity, ConstraintSet& constraints,
              Data& data);

  /// Drops all predictions.
  void forget();

  bool covers(int tree) const { return covered_[tree]; }
  /// Whether (q, w) determines all forces on the tree: it would be covered if it rotated.
  bool knows(int tree) const { return known_[tree]; }
  /// Velocity (nv) of the covered trees at the end of the step [m/s, rad/s].
  const VectorX& velocity() const { return velocity_; }
  /// Its change (nv) by closures and mimic joints [m/s, rad/s]; zero for other trees.
  const VectorX& change_by_equalities() const { return equality_change_; }

  // Intermediate results, for the derivatives of the prediction.

  /// Whether a tree is covered.
  bool any() const { return any_; }
  /// Whether the tree has a velocity here: it is covered, or coupled to a covered tree.
  bool has(int tree) const { return any_ && needed_[tree]; }
  /// Closures and mimic joints of these trees with the biases of the first pass, and for each pair
  /// its index among the closures of the constraints.
  const ConstraintSet& equalities() const { return equalities_; }
  const std::vector<int>& equality_closures() const { return equality_closures_; }
  /// Whether the bias of a closure's rows is aimed.
  bool aims(const Model& model, const PairConstraint& pair) const;
  /// Velocity (nv) at the end of the first pass [m/s, rad/s].
  const VectorX& first_velocity() const { return first_; }
  /// Whether the second pass succeeded.
  bool refined() const { return refined_; }

 private:
  bool choose(const Model& model, EffectSet effects, Of of, const ConstraintSet& constraints,
              std::span<const BodyRange> ranges, const Kinematics& data);
  void gather_equalities(const Model& model, const ConstraintSet& constraints);
  bool accelerate(const Model& model, const Tree& tree, double span, const VectorRef& v,
                  const Vector3& gravity, Data& data);
  bool solve_equalities(const Model& model);
  void aim(const StepContext& at, ConstraintSet& constraints, const Kinematics& data);

  std::vector<char> with_servo_;        ///< per tree
  std::vector<char> driven_;            ///< per tree: it has prescribed joints
  std::vector<char> known_;             ///< per tree: (q, w) determines all forces on it
  std::vector<char> covered_;           ///< per tree
  std::vector<char> needed_;            ///< per tree: covered, or coupled to a covered one
  ConstraintSet equalities_;            ///< closures and mimic joints of needed trees
  std::vector<int> equality_closures_;  ///< per pair in equalities_: its index among the
                                        ///< constraints' closures
  VectorX tau_, diagonal_, acceleration_, velocity_, equality_change_;
  std::vector<int> block_of_tree_;
  contact::Problem problem_;
  EqualitySolver equality_solver_;
  bool any_ = false, refined_ = false;
  bool factored_ = false;   ///< equality_solver_ has factored problem_
  contact::Solver solver_;  ///< used where there are too many equalities
  VectorX w_, impulse_;     ///< grown only, see Workspace::Impl

  // Second pass.
  MidVelocity mid_velocity_;
  VectorX first_;                ///< nv: the velocity that the first pass found
  std::optional<Data> reached_;  ///< poses reached; set if there are closures
  VectorX q_reached_;
  std::vector<Motion> V_;  ///< per body: its motion at velocity_
};

}  // namespace counterpoint
