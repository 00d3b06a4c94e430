// Derivatives of the mean velocity-dependent forces of linkages under energy projection
// (energy_projection.h).
//
// With a share s of energy projection the forces are (1 - s) n - (M + R) s (r - v) / h, where R are
// the rotor inertias, r = scale (v + p) and p = -h inv(M + R) n. Hence (M + R) dp / h is minus the
// derivative of the dynamics at the acceleration p / h: one sweep. The scale solves a scalar
// equation, energy of r = energy of v, each at the pose where it counts; kinetic_gradient.h has the
// gradients. With a predicted velocity f, B(v, f - s (v + p)) replaces (1 - s) n.
#pragma once

#include <optional>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/kinetic_gradient.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/derivatives/inverted_step.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

class ProjectionTerms {
 public:
  explicit ProjectionTerms(const Model& model);

  /// Adds the derivatives of the forces of tree t, as the inverse step left them in `ws`, beyond
  /// those of (M + R)(a - change / h) + (1 - s) n; predicted: with B at fixed f
  /// in place of (1 - s) n.
  void add(const InverseArguments& of, int t, bool predicted, const InvertedStep& inverted,
           InverseDerivatives& d);

 private:
  /// Gradients of the quantities kept for velocities x: energy (first column), then momentum.
  struct Gradients {
    explicit Gradients(const Model& model) : at(model) {}
    KineticGradient at;
    MatrixX by_q, by_x;  ///< nv x 4, transposed
  };
  static int fastest(const Tree& tree, const Kinematics& data);
  static void add_turn_gradient(const Model& model, const Tree& tree, int body, double by,
                                const Kinematics& data, VectorX& dq, VectorX& dv);
  void find_share_gradient(const Model& model, const Tree& tree, double h, bool predicted,
                           const Kinematics& data);
  void find_gradients(const InverseArguments& of, const Tree& tree, double from, bool predicted,
                      const VectorX& x, const VectorX& rotors, Gradients& out);
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
  /// At the end end_.by_x holds inv(M + R) times the gradient.
  Gradients start_, end_;
  std::optional<Data> at_pose_;
  VectorX q_at_, moved_, turned_;
  MatrixX by_q_, by_v_;  ///< nv x 4, transposed: by scale and by missing momentum
  VectorX share_q_, share_v_;
};

}  // namespace counterpoint
