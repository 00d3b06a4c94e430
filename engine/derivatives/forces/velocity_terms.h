// Derivatives of the mean velocity-dependent forces of linkages: predicted (velocity_predictor.h)
// or with their energy kept (energy_projection.h).
//
// With n = B(v, v) the forces at one velocity, f the predicted one, a_f its acceleration:
//
//   B(v, f) = n((v + f) / 2) - n((v - f) / 2),     (M + D) da_f = -d(inverse dynamics at a_f)
//
// A sweep each gives n at (v + f) / 2 and (v - f) / 2 and the dynamics at a_f; one solve the rest.
// Where energy is kept: projection_terms.h. Trees under closures and mimic joints:
// equality_prediction.h. Of trees at rest, for which the engine makes no prediction because the
// forces vanish, the limit of the prediction is taken: the derivatives of these forces do not
// vanish.
#pragma once

#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/derivatives/forces/equality_prediction.h"
#include "counterpoint/engine/derivatives/forces/projection_terms.h"
#include "counterpoint/engine/step/step_start.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

class VelocityTerms {
 public:
  explicit VelocityTerms(const Model& model);

  /// Of an inverse step as it left `ws`.
  void begin(const InverseArguments& of, Workspace::Impl& ws);

  /// What the sweep over tree t is to take v and a at: v, a (nv), changed in place, and in.
  void prepare(const InverseArguments& of, int t, const Workspace::Impl& ws, VectorX& v_at,
               VectorX& a_at, SweepInput& in);

  /// Adds what is left, after that sweep.
  void add(const InverseArguments& of, int t, Workspace::Impl& ws, InverseDerivatives& d);

  /// Adds what is left of trees under equalities, after all sweeps; of closures' rows where their
  /// bias is aimed. False if it is not known.
  bool add_equalities(const InverseArguments& of, Workspace::Impl& ws, ClosureDerivator& closures,
                      InverseDerivatives& d);
  /// The bias of a closure's rows is aimed; or would be, were it not at rest.
  bool aims(const Model& model, const PairConstraint& pair, const Workspace::Impl& ws) const {
    return mean_ && ws.start.predictor().aims(model, pair);
  }
  bool aims_at_rest(const Model& model, const PairConstraint& pair) const {
    return resting_.aims(model, pair);
  }

 private:
  enum class Kind : unsigned char { kPlain, kPredicted, kProjected, kBoth };

  void predict_resting(const InverseArguments& of, Workspace::Impl& ws);
  void add_prediction(const InverseArguments& of, const Tree& tree, Workspace::Impl& ws,
                      InverseDerivatives& d);

  TreeSweep sweep_;
  SparseSolver solver_;
  std::vector<int> parents_;  ///< by coordinate
  EqualityPrediction equality_prediction_;
  std::vector<Kind> kind_;                           ///< by tree
  bool mean_ = false;                                ///< forces are taken at more than v
  std::vector<const VelocityPredictor*> predictor_;  ///< by tree; null: none
  std::vector<char> has_ties_;                       ///< by tree: in that prediction
  std::vector<char> predicted_;                      ///< by tree, scratch
  VelocityPredictor resting_;                        ///< of trees that do not turn
  std::vector<BodyRange> ranges_;                    ///< theirs
  ConstraintSet constraints_;                        ///< and what holds them
  ProjectionTerms projection_;
  VectorX zero_;             ///< nv
  VectorX other_;            ///< nv: what B(v, .) is taken with
  VectorX f_, a_f_, half_;   ///< nv: prediction, its acceleration, scratch
  MatrixX dq_, dv_, da_;     ///< nv x nv: of one sweep
  MatrixX factor_, solved_;  ///< nv x nv
};

}  // namespace counterpoint
