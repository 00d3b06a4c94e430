// Light links under tension turn no faster than steps can resolve.
//
// Forces F_k that pull on a link at arms r_k from its centre of mass resist its rotation with the
// geometric stiffness K = sum (r_k.F_k) 1 - sym(r_k F_k'). Its rate is sqrt(eig(K, I)), I the
// link's own inertia. No motion of a chain or linkage held by such forces is faster than its
// fastest link, since turning a link moves at least I. For h rate > 2 a step adds energy: 40 links
// of 0.1 kg under 100 kg have a rate of 1300/s.
//
// Therefore a step of h multiplies the inertia of such a link about its centre of mass by
//
//   factor = max(1, h^2 eig(K, I))
//
// The link then behaves as if it carried a flywheel and turns at a rate of at most about 1/h, an
// oscillation that the step could not resolve anyway. Weight, momentum and equilibria do not
// change; a swinging link has h^2 g / L more inertia than it should. At a constant factor the step
// is that of a different linkage and adds no more energy than for any other. If the factor rises,
// the flywheel keeps its angular momentum, and the added part starts at rest:
//
//   factor I w+ = kept I w + ...,    kept = min(factor of the last step, factor)
//
// A change of factors can therefore only reduce kinetic energy, including that of the flywheels.
//
// K is that of the last step, from the state's memory, or of this step: if its own forces ask for
// more than twice the factor used, the step is repeated. These forces depend on the applied forces,
// so the inverse is given the factors (Input::taut_links), as it is given softened laws.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "counterpoint/contact/problem.h"
#include "counterpoint/engine/constraints/constraint_set.h"
#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

class TautLinks {
 public:
  /// called: the scene enables taut links (Effect::kTautLinks).
  TautLinks(const Model& model, bool called);

  /// Sets the factors of a step of h [s] from the memory of the state in which it starts.
  void recall(double h, const std::vector<RememberedForce>& memory);
  /// Sets these factors instead.
  void set(std::span<const TautLink> links);
  /// Returns the model with the inertias of links(); `model` itself if there are none. `model` may
  /// be a model that an earlier call returned.
  const Model& slowed(const Model& model);
  std::span<const TautLink> links() const { return links_; }
  bool loses() const { return loses_; }

  /// Finds the angular momentum that links lose over a step of h [s] where their factors rise, as
  /// torques in W at the velocities in `data`; add_losses adds them to external.external. Needs
  /// compute_poses and compute_velocities.
  void find_losses(const Model& slowed, double h, const Kinematics& data);
  void add_losses(ExternalForces& external) const;

  /// True if there are links that joints may pull, so find_rates needs joint forces.
  bool needs_joint_forces() const { return !tree_links_.empty(); }
  bool any() const { return !pulled_.empty(); }
  /// Computes the rates of the links from the forces of a step: closures by their impulses over h
  /// [s], joints by joint_force as in data.F (rnea) if needed, and wrenches. Poses of the step in
  /// `data`.
  void find_rates(const ConstraintSet& constraints, const contact::Problem& problem,
                  const VectorX& impulse, double h, const std::vector<Force>& joint_force,
                  std::span<const ExternalWrench> wrenches, const Kinematics& data);
  /// Raises factors where the rates ask for it. False if none changes.
  bool raise(double h);
  /// Appends to `memory` the factors and rates that the next step needs.
  void remember(double h, std::vector<RememberedForce>& memory) const;

 private:
  void add_force(int body, const Vector3& point, const Vector3& force, const Kinematics& data);
  void clear();
  void list();

  std::optional<Model> model_, slowed_;  ///< the model as it is, and with the inertias of links_
  std::vector<int> changed_;             ///< bodies whose inertias differ between the two

  std::vector<int> pulled_;                     ///< bodies that may be taut
  std::vector<int> tree_links_;                 ///< the subset of pulled_ with joints that may pull
  std::vector<char> is_pulled_;                 ///< for each body: it is in pulled_
  std::vector<double> before_, factor_, rate_;  ///< for each body; squared rates [1/s^2]
  std::vector<Matrix3> moments_;                ///< for each body: sum r F', in W [N m]
  std::vector<TautLink> links_;
  std::vector<Vector3> loss_;  ///< for each of links_: torque in W [N m]
  bool loses_ = false;
};

}  // namespace counterpoint
