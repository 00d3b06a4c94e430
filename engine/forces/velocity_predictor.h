// Where a step will take the velocities, as far as (q, w) tells.
//
// Gravity, velocity-dependent forces, the joints' own springs and dampers, closures and mimic
// joints are functions of (q, w), and so is the velocity that they lead to. Forces that want the
// velocity in the middle of a step (mid_velocity.h, midpoint.h) take it from here, and the inverse,
// which knows (q, w), comes to the same one. What is applied is left out, since the inverse is to
// find it; trees with servos, and those that contacts, limits or dry friction touch in the step,
// get no prediction: without what holds them it would be wrong.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/constraints/equality_solver.h"
#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/forces/mid_velocity.h"
#include "counterpoint/engine/step_context.h"

namespace counterpoint {

class VelocityPredictor {
 public:
  explicit VelocityPredictor(const Model& model);

  /// Which trees a prediction is asked for.
  enum class Of {
    kLinkages,         ///< of several bodies
    kUnderEqualities,  ///< under closures or mimic joints
    kAllLinkages,      ///< turning or not: what a prediction tends to where a tree comes to rest
  };

  /// For a step from (q, v), gravity [m/s^2], constraints as found there, smooth forces
  /// over `span` [s] of it before the impulses; for those trees in `ranges` that turn. Needs
  /// compute_poses, compute_velocities and free_flight.h's mean forces; compute_inertias of what
  /// is asked for is done here. No applied forces in data (has_external, added); aba's scratch is
  /// overwritten.
  void find(const StepContext& at, Of of, double span, const Vector3& gravity,
            const ConstraintSet& constraints, std::span<const BodyRange> ranges, Data& data);

  /// A second pass, for trees with closures and mimic joints, which `find` (kLinkages) came first
  /// for: velocity-dependent forces at the velocity in the middle of the step that the first pass
  /// found, and closures aimed at the pose that it leads to (closures.h), in `constraints` too. Of
  /// these trees mean forces are to be set again.
  void refine(const StepContext& at, const Vector3& gravity, ConstraintSet& constraints,
              Data& data);

  /// Covers nothing.
  void forget();

  bool covers(int tree) const { return covered_[tree]; }
  /// Nothing acts on the tree that (q, w) does not tell: it would be covered if it turned.
  bool knows(int tree) const { return known_[tree]; }
  /// nv: at the end of the step [m/s, rad/s]; of covered trees.
  const VectorX& velocity() const { return velocity_; }
  /// nv: what closures and mimic joints change of it [m/s, rad/s]; zero of trees not covered.
  const VectorX& change_by_equalities() const { return equality_change_; }

  // How it came to that, for its derivatives.

  /// A tree is covered.
  bool any() const { return any_; }
  /// The tree has a velocity here: it is covered, or coupled to one that is.
  bool has(int tree) const { return any_ && needed_[tree]; }
  /// Closures and mimic joints of these trees, with the biases that the first pass went by, and of
  /// each pair which of the constraints' closures it is.
  const ConstraintSet& equalities() const { return equalities_; }
  const std::vector<int>& equality_closures() const { return equality_closures_; }
  /// The bias of a closure's rows is aimed.
  bool aims(const Model& model, const PairConstraint& pair) const;
  /// nv: at the end of the first pass.
  const VectorX& first_velocity() const { return first_; }
  /// There was a second pass.
  bool refined() const { return refined_; }

 private:
  bool choose(const Model& model, EffectSet effects, Of of, const ConstraintSet& constraints,
              std::span<const BodyRange> ranges, const Kinematics& data);
  void gather_equalities(const Model& model, const ConstraintSet& constraints);
  bool accelerate(const Model& model, const Tree& tree, double span, const VectorRef& v,
                  const Vector3& gravity, Data& data);
  bool solve_equalities(const Model& model);
  void aim(const StepContext& at, ConstraintSet& constraints, const Kinematics& data);

  std::vector<char> with_servo_;        ///< by tree
  std::vector<char> known_;             ///< by tree: nothing acts on it that (q, w) does not tell
  std::vector<char> covered_;           ///< by tree
  std::vector<char> needed_;            ///< by tree: covered, or coupled to one that is
  ConstraintSet equalities_;            ///< closures and mimic joints of what is needed
  std::vector<int> equality_closures_;  ///< of each pair in equalities_ its index among the
                                        ///< constraints' closures
  VectorX tau_, diagonal_, acceleration_, velocity_, equality_change_;
  std::vector<int> block_of_tree_;
  contact::Problem problem_;
  EqualitySolver equality_solver_;
  bool any_ = false, refined_ = false;
  bool factored_ = false;   ///< problem_, by equality_solver_
  contact::Solver solver_;  ///< where there are too many equalities
  VectorX w_, impulse_;     ///< grown only, see Workspace::Impl

  // the second pass
  MidVelocity mid_velocity_;
  VectorX first_;                ///< nv: the velocity that the first pass found
  std::optional<Data> reached_;  ///< if there are closures: poses
  VectorX q_reached_;
  std::vector<Motion> V_;  ///< by body, of velocity_
};

}  // namespace counterpoint
