// Derivatives of a step through the predicted velocity (velocity_predictor.h) of linkages under
// equality constraints (closures, mimic joints).
//
// The prediction w2 takes two passes. The inverse step is the third of three equations of one form,
// with B the velocity-dependent forces at two velocities and b_k the biases of the equalities:
//
//   r_k(q, v, w_in, w_out) = M (w_out - v) / h + B(v, w_in) + gravity + joint forces
//                            + J' inv(R) (J w_out + b_k(q, v, w_in)) / h
//
//   r_1(q, v, v, w1) = 0      b_1 from the acceleration of the closures
//   r_2(q, v, w1, w2) = 0     b_2, b_3 at the predicted pose
//   u = r_3(q, v, w2, v+)     plus contacts, drag, servos
//
// With A = dr_k/dw_out, the same symmetric matrix for k = 1, 2, K_k = dr_k/dw_in, and the adjoints
// X2 = inv(A) K_3' and X1 = inv(A) K_2' X2, the terms of du in addition to dr_3 are
//
//   - X2' (dr_2/dq dq + dr_2/dv dv) + X1' (dr_1/dq dq + dr_1/dv dv)
//
// for each group of trees that equalities couple.
#pragma once

#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/constraints/closure_derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/forces/force_responses.h"
#include "counterpoint/engine/derivatives/inverted_step.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

class EqualityPrediction {
 public:
  explicit EqualityPrediction(const Model& model);

  struct Given {
    const VelocityPredictor& predictor;
    const std::vector<char>& predicted;  ///< per tree: whether it was predicted
    const VectorX& other;                ///< nv: second argument of B(v, .)
    bool at_rest;  ///< the prediction is the limit for trees at rest: it affects dv only
  };
  /// Adds the missing terms to d. On entry d has the results of the sweeps, taken over predicted
  /// trees at (v + other) / 2, with velocity-dependent forces B(v, other), and the responses of the
  /// equalities at their present biases. Returns false if these terms have no closed form.
  bool add(const InverseArguments& of, const Given& given, const InvertedStep& inverted,
           ClosureDerivator& closures, InverseDerivatives& d);

 private:
  struct Stage {
    const VectorX *in, *out;  ///< w_in (null: v) and w_out
  };
  /// Arguments shared by all parts of `add`.
  struct Step {
    const Model& model;
    const SimulationOptions& options;
    EffectSet effects;
    const VectorRef &q, &v;
    const VelocityPredictor& predictor;
    const std::vector<char>& predicted;
    const InvertedStep& inverted;
    ClosureDerivator& closures;
    double h;
    Vector3 gravity;
  };

  void group(const Step& step);
  int root(int tree);
  void differentiate(const Step& step, const Stage& stage, InverseDerivatives& out);
  void add_equalities(const Step& step, const Stage& stage);
  void sweep(const Step& step, const Stage& stage, InverseDerivatives& out);
  void add_between(const Step& step);
  void add_last(const Step& step, const VectorX& other, bool at_rest, InverseDerivatives& d);
  bool close(const Step& step, int first, bool at_rest, InverseDerivatives& d);

  TreeSweep sweep_;
  ForceResponses forces_;
  SparseSolver solver_;
  std::vector<int> group_;  ///< per tree: a tree of the same group; -1: no equalities act on it
  std::vector<Motion> V_;   ///< per body
  VectorX at_, a_, zero_;   ///< nv
  InverseDerivatives first_, second_, between_;
  MatrixX rows_q_, rows_v_;      ///< nv x nv: contributions of the biases of closures
  MatrixX in_second_, in_last_;  ///< nv x nv: K_2, K_3
  // Matrices of one group, over its coordinates in sequence.
  std::vector<int> coordinates_;
  MatrixX A_, X_, Y_, part_;
};

}  // namespace counterpoint
