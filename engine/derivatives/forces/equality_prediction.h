// Derivatives of a step through the predicted velocity (velocity_predictor.h) of trees under
// equality constraints (closures, mimic joints): linkages under closures and mimic joints.
//
// Their prediction w2 comes in two passes, and so the inverse step is the third of three equations
// of one kind, with B the velocity-dependent forces at two velocities and b their biases:
//
//   r_k(q, v, w_in, w_out) = M (w_out - v) / h + B(v, w_in) + gravity + joint forces
//                            + J' inv(R) (J w_out + b_k(q, v, w_in)) / h
//
//   r_1(q, v, v, w1) = 0      b_1 by the acceleration of the closures
//   r_2(q, v, w1, w2) = 0     b_2, b_3 at the predicted pose
//   u = r_3(q, v, w2, v+)     contacts, drag, servos besides
//
// With A = dr_k/dw_out, the same symmetric matrix for k = 1, 2, K_k = dr_k/dw_in, and the adjoints
// X2 = inv(A) K_3' and X1 = inv(A) K_2' X2, what is left of du once dr_3 is known is
//
//   - X2' (dr_2/dq dq + dr_2/dv dv) + X1' (dr_1/dq dq + dr_1/dv dv)
//
// of each group of trees that equalities couple.
#pragma once

#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/constraints/closure_derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/forces/force_responses.h"
#include "counterpoint/engine/step/step_start.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

class EqualityPrediction {
 public:
  explicit EqualityPrediction(const Model& model);

  struct Given {
    const VelocityPredictor& predictor;
    const std::vector<char>& predicted;  ///< by tree, that it was
    const VectorX& other;                ///< nv: what B(v, .) was taken with
    bool at_rest;  ///< the prediction is one that trees at rest tend to, without effect but for dv
  };
  /// Adds to d what is missing of it. d has what the sweeps gave where those over trees with a
  /// prediction were taken at (v + other) / 2, velocity-dependent forces being B(v, other), and the
  /// equalities' responses at the biases that they have. False if it is not known.
  bool add(const InverseArguments& of, const Given& given, Workspace::Impl& ws,
           ClosureDerivator& closures, InverseDerivatives& d);

 private:
  struct Stage {
    const VectorX *in, *out;  ///< w_in (null: v) and w_out
  };
  /// What every part of `add` looks at.
  struct Step {
    const Model& model;
    const SimulationOptions& options;
    EffectSet effects;
    const VectorRef &q, &v;
    const VelocityPredictor& predictor;
    const std::vector<char>& predicted;
    Workspace::Impl& ws;
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
  std::vector<int> group_;  ///< by tree: a tree of the same group; -1: not under equalities
  std::vector<Motion> V_;   ///< by body
  VectorX at_, a_, zero_;   ///< nv
  InverseDerivatives first_, second_, between_;
  MatrixX rows_q_, rows_v_;      ///< nv x nv: by the biases of closures
  MatrixX in_second_, in_last_;  ///< nv x nv: K_2, K_3
  // Of one group, its coordinates one after the other.
  std::vector<int> coordinates_;
  MatrixX A_, X_, Y_, part_;
};

}  // namespace counterpoint
