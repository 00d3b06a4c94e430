// Derivatives of the mean velocity-dependent forces of linkages: at a predicted velocity
// (velocity_predictor.h) or under energy projection (energy_projection.h).
//
// With n = B(v, v) the forces at one velocity, f the predicted velocity and a_f its acceleration:
//
//   B(v, f) = n((v + f) / 2) - n((v - f) / 2),     (M + D) da_f = -d(inverse dynamics at a_f)
//
// Three sweeps give n at (v + f) / 2, n at (v - f) / 2 and the dynamics at a_f; one solve gives the
// rest. Energy projection: projection_terms.h. Trees under closures and mimic joints:
// equality_prediction.h. For trees at rest the engine makes no prediction, since these forces
// vanish; their derivatives do not, and are those of the limit of the prediction.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/derivatives/forces/equality_prediction.h"
#include "counterpoint/engine/derivatives/forces/projection_terms.h"
#include "counterpoint/engine/derivatives/inverted_step.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

class VelocityTerms {
 public:
  explicit VelocityTerms(const Model& model);

  /// Starts with an inverse step as it was left in `inverted`.
  void begin(const InverseArguments& of, const InvertedStep& inverted);

  /// Sets the arguments of the sweep over tree t: v_at = v and a_at = a (nv) on entry, changed in
  /// place.
  void prepare(const InverseArguments& of, int t, const InvertedStep& inverted, VectorX& v_at,
               VectorX& a_at, SweepInput& in);

  /// Adds the remaining terms of tree t after that sweep.
  void add(const InverseArguments& of, int t, const InvertedStep& inverted, InverseDerivatives& d);

  /// Adds the remaining terms of trees under equalities after all sweeps, and those of closure rows
  /// with aimed bias. Returns false if they have no closed form.
  bool add_equalities(const InverseArguments& of, const InvertedStep& inverted,
                      ClosureDerivator& closures, InverseDerivatives& d);
  /// Whether the bias of a closure's rows is aimed (aims), or would be if its tree were not at
  /// rest.
  bool aims(const Model& model, const PairConstraint& pair, const InvertedStep& inverted) const {
    return mean_ && inverted.start.predictor().aims(model, pair);
  }
  bool aims_at_rest(const Model& model, const PairConstraint& pair) const {
    return resting_.aims(model, pair);
  }

 private:
  enum class Kind : unsigned char { kPlain, kPredicted, kProjected, kBoth };

  void predict_resting(const InverseArguments& of, const InvertedStep& inverted);
  void add_prediction(const InverseArguments& of, const Tree& tree, const InvertedStep& inverted,
                      InverseDerivatives& d);

  TreeSweep sweep_;
  SparseSolver solver_;
  std::vector<int> parents_;  ///< per coordinate
  EqualityPrediction equality_prediction_;
  std::vector<Kind> kind_;  ///< per tree
  bool mean_ = false;       ///< forces are taken at other velocities than v alone
  std::vector<const VelocityPredictor*> predictor_;  ///< per tree; null: none
  std::vector<char> has_ties_;                       ///< per tree: equalities act in its prediction
  std::vector<char> predicted_;                      ///< per tree, scratch
  VelocityPredictor resting_;                        ///< prediction of trees at rest
  std::optional<Data> resting_data_;                 ///< kinematics and forces of that prediction
  std::vector<BodyRange> ranges_;                    ///< bodies of these trees
  ConstraintSet constraints_;                        ///< constraints on them
  ProjectionTerms projection_;
  VectorX zero_;             ///< nv
  VectorX other_;            ///< nv: second argument of B(v, .)
  VectorX f_, a_f_, half_;   ///< nv: prediction, its acceleration, scratch
  MatrixX dq_, dv_, da_;     ///< nv x nv: results of one sweep
  MatrixX factor_, solved_;  ///< nv x nv
};

}  // namespace counterpoint
