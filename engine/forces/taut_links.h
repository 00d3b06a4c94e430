// Light links under tension turn no faster than steps can follow.
//
// A link that forces F_k pull at arms r_k from its centre of mass resists being turned: by the
// geometric stiffness K = sum (r_k.F_k) 1 - sym(r_k F_k'), at the rate sqrt(eig(K, I)), I its own
// inertia. No motion of a chain or linkage that such forces hold is faster than its fastest link,
// since turning a link moves at least I. Beyond h rate = 2 a step makes energy of it: 40 links of
// 0.1 kg under 100 kg have 1300/s.
//
// So a step of h takes the inertia of such a link about its centre of mass times
//
//   factor = max(1, h^2 eig(K, I))
//
// as if there were a flywheel along: it turns by at most about 1/h, an oscillation that the step
// could not show anyway. Weight, momentum and what hangs still stay as they are; what swings has
// h^2 g / L more inertia than it should. At a constant factor the step is that of another
// linkage, and makes no more energy than any. Where the factor rises the flywheel keeps the angular
// momentum it had, and does not start with one that nobody gave it:
//
//   factor I w+ = kept I w + ...,    kept = min(factor of the last step, factor)
//
// so kinetic energy, the flywheels' included, only falls by a change of factors.
//
// K is that of the last step, as the state's memory has it, or of this one: where its own forces
// ask for more than twice what it was made with it is made again. Forces depend on what is applied,
// so the inverse is told the factors (Input::taut_links), as it is of softer laws.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/constraints.h"
#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

class TautLinks {
 public:
  /// called: a scene calls for them (Effect::kTautLinks).
  TautLinks(const Model& model, bool called);

  /// What a step of h [s] takes, from the memory of the state that it starts from.
  void recall(double h, const std::vector<RememberedForce>& memory);
  /// In place of that: these.
  void set(std::span<const TautLink> links);
  /// The model with the inertias that were set: `model` itself if there are none. It may be one
  /// that this returned.
  const Model& slowed(const Model& model);
  std::span<const TautLink> links() const { return links_; }
  bool loses() const { return loses_; }

  /// What the links lose where factors rise, as torques in W at the velocities in `data`, of a step
  /// of h [s]; add_losses adds them to external.external. Needs compute_poses and compute_velocities.
  void find_losses(const Model& slowed, double h, const Kinematics& data);
  void add_losses(ExternalForces& external) const;

  /// There are links whose forces are those of joints.
  bool needs_joint_forces() const { return !tree_links_.empty(); }
  bool any() const { return !pulled_.empty(); }
  /// Rates of the links from the forces of a step: of closures by their impulses over h [s], of
  /// joints as in data.F (rnea), if needed, and wrenches. Poses of the step in `data`.
  /// Parameters: what it depends on.
  void find_rates(const ConstraintSet& constraints, const contact::Problem& problem,
                  const VectorX& impulse, double h, const std::vector<Force>& joint_force,
                  std::span<const ExternalWrench> wrenches, const Kinematics& data);
  /// Takes more where these rates ask for it. False if they do not.
  bool raise(double h);
  /// Adds what the next step is to know, behind what is in `memory`.
  void remember(double h, std::vector<RememberedForce>& memory) const;

 private:
  void add_force(int body, const Vector3& point, const Vector3& force, const Kinematics& data);
  void clear();
  void list();

  std::optional<Model> model_, slowed_;  ///< as it is, and with the inertias of links_
  std::vector<int> changed_;             ///< bodies whose inertias differ between these

  std::vector<int> pulled_;                     ///< bodies that may be taut
  std::vector<int> tree_links_;                 ///< of these, those with joints that may pull
  std::vector<char> is_pulled_;                 ///< by body
  std::vector<double> before_, factor_, rate_;  ///< by body: rate: square of it [1/s^2]
  std::vector<Matrix3> moments_;                ///< by body: sum r F', in W [N m]
  std::vector<TautLink> links_;
  std::vector<Vector3> loss_;  ///< by links_ [N m]
  bool loses_ = false;
};

}  // namespace counterpoint
