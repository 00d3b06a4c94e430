// Derivatives of the mean velocity-dependent forces of linkages whose energy is kept
// (energy_projection.h).
//
// Of a share s they are (1 - s) n - (M + R) s (r - v) / h with r = scale (v + p) and p = -h inv(M +
// R) n, so that (M + R) dp / h is minus the derivative of the dynamics at the acceleration p / h: a
// sweep. The scale solves an equation in one variable, the energy of r that of v, each at the pose
// where it counts, whose gradients kinetic_gradient.h has.
// With a prediction f, B(v, f - s (v + p)) stands for (1 - s) n.
#pragma once

#include <optional>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/kinetic_gradient.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/step/step_start.h"
#include "counterpoint/engine/step/step_workspace.h"

namespace counterpoint {

class ProjectionTerms {
 public:
  explicit ProjectionTerms(const Model& model);

  /// Adds what a tree's share changes by, as the inverse step left it in `ws`, beyond that of
  /// (M + R)(a - change / h) + (1 - s) n, or with a prediction (predicted) B at fixed f.
  void add(const InverseArguments& of, int t, bool predicted, const Workspace::Impl& ws,
           InverseDerivatives& d);

 private:
  /// Of the energy and the momentum that count for velocities x, the energy's first.
  struct Gradients {
    explicit Gradients(const Model& model) : at(model) {}
    KineticGradient at;
    MatrixX by_q, by_x;  ///< nv x 4, transposed
  };
  static int fastest(const Tree& tree, const Kinematics& data);
  static void add_turn_gradient(const Model& model, const Tree& tree, int body, double by,
                                const Kinematics& data, VectorX& dq,
                                VectorX& dv);  // Parameters: all it depends on
  void find_share_gradient(const Model& model, const Tree& tree, double h, bool predicted,
                           const Kinematics& data);
  void find_gradients(const InverseArguments& of, const Tree& tree, double from, bool predicted,
                      const VectorX& x, const VectorX& rotors,
                      Gradients& out);  // Parameters: all it depends on
  void find_scale_gradient(const InverseArguments& of, const Tree& tree, double scale,
                           bool predicted, const VectorX& rotors);
  bool solve_rows(const Eigen::Ref<const MatrixX>& M, const Eigen::Ref<const MatrixX>& dyn_v,
                  int columns, bool both);
  void close_gradients(const Eigen::Ref<const MatrixX>& dyn_q,
                       const Eigen::Ref<const MatrixX>& dyn_v, int columns, double by,
                       const Eigen::Matrix<double, 4, 1>& grows);

  TreeSweep sweep_;
  SparseSolver solver_;
  VectorX zero_, at_, a_, other_, half_, changed_;  ///< nv
  MatrixX dq_, dv_, da_, solved_;                   ///< nv x nv
  /// In the end's by_x finally inv(M + R) of it.
  Gradients start_, end_;
  std::optional<Data> at_pose_;
  VectorX q_at_, moved_, turned_;
  MatrixX by_q_, by_v_;  ///< nv x 4: transposed, of the scale and of the momentum left
  VectorX share_q_, share_v_;
};

}  // namespace counterpoint
