// Verification of a motion: does a forward step from each frame reach the next?
#pragma once

#include <utility>
#include <vector>

#include "counterpoint/engine/optimize/problem.h"
#include "counterpoint/engine/step.h"

namespace counterpoint::optimization {

/// What was found over all steps of a motion.
struct Verification {
  /// Largest difference of any coordinate [m, rad] between frame t + 1 and where step_forward leads
  /// from frame t under the force that the inverse recovered.
  double forward_check_max = 0.0;
  int forward_failures = 0;         ///< steps that could not be done, or were softened
  double unactuated_max = 0.0;      ///< forces where no motor is, as of unactuated_weights
  double unactuated_mean = 0.0;     ///< over the steps, of the largest in each
  double overlap_max = 0.0;         ///< [m]
  double cone_violation_max = 0.0;  ///< friction beyond mu times the normal force, over the weight
  /// How far a contact that carries more than kLoaded of the weight slides in a step [m]; of a pair
  /// that carried in the step before as well, it stands, and of one that did not, it lands.
  double stance_slip_max = 0.0, landing_slip_max = 0.0;
  double effort_max = 0.0;         ///< largest applied force over its effort limit
  double contact_force_max = 0.0;  ///< normal, over the weight
};

/// A contact is loaded that carries this share of the scene's weight.
inline constexpr double kLoaded = 0.05;

/// Needs q_{-1} for the velocity of frame 0: v_0 (nv). Frames are options.time_step apart.
Verification verify(const Model& model, const SimulationOptions& options,
                    const std::vector<char>& motors, const std::vector<VectorX>& q,
                    const VectorX& v_0);

/// The same of one step after the other, with what the inverse recovered there; in `out` worse
/// figures go before better ones.
class Verifier {
 public:
  Verifier(const Model& model, const SimulationOptions& options, const std::vector<char>& motors);
  /// A step from (q, v) to (q_next, v_next). Returns the recovered force's Inverse.
  const Inverse& add_step(const VectorX& q, const VectorX& v, const VectorX& q_next,
                          const VectorX& v_next, Verification& out);

 private:
  void check_forward(const VectorX& q, const VectorX& v, const VectorX& q_next, Verification& out);
  void check_contacts(const VectorX& q, const VectorX& v_next, Verification& out);
  void check_forces(Verification& out);

  const Model* model_;
  SimulationOptions options_;
  Workspace workspace_;
  Inverse inverse_;
  VectorX unactuated_;                                       ///< nv: weights
  double weight_;                                            ///< [N]
  std::vector<std::pair<int, int>> loaded_, loaded_before_;  ///< pairs of geometries
  int steps_ = 0;
};

/// Forces of an inverse as a state's memory, which step_forward starts from: where a step has
/// several solutions it then finds that of the plan. h [s]; needs the workspace of that inverse.
std::vector<RememberedForce> memory_of(const Model& model, const VectorX& q,
                                       const Inverse& inverse);

}  // namespace counterpoint::optimization
