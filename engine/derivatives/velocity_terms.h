// Derivatives of the mean velocity-dependent forces of linkages: forecast (forecast.h) or with
// their energy kept (fast_trees.h).
//
// With n = B(v, v) the forces at one velocity, f the forecast one, a_f its acceleration:
//
//   B(v, f) = n((v + f) / 2) - n((v - f) / 2),     (M + D) da_f = -d(inverse dynamics at a_f)
//
// A sweep each gives n at (v + f) / 2 and (v - f) / 2 and the dynamics at a_f; one solve the rest.
// Where energy is kept, of a share s: (1 - s) n - (M + R) s (r - v) / h with r = scale (v + p) and
// p = -h inv(M + R) n, so that (M + R) dp / h is minus the derivative of the dynamics at the
// acceleration p / h, by one more sweep; the scale solves an equation in one variable, whose
// gradient kinetic_gradient.h has. With both, B(v, f - s (v + p)) stands for (1 - s) n.
#pragma once

#include <optional>

#include "counterpoint/engine/derivatives/kinetic_gradient.h"
#include "counterpoint/engine/derivatives/sparse_solve.h"
#include "counterpoint/engine/derivatives/sweep.h"
#include "counterpoint/engine/step_derivatives.h"
#include "counterpoint/engine/step_workspace.h"

namespace counterpoint {

class VelocityTerms {
 public:
  explicit VelocityTerms(const Model& model);

  /// What the sweep over tree t is to take v and a at: v, a (nv), changed in place, and in.
  /// False if the tree's forces are not known here.
  bool prepare(const Model& model, int t, EffectSet effects, double h, const VectorRef& q,
               const VectorRef& v, Workspace::Impl& ws, VectorX& v_at, VectorX& a_at,
               SweepInput& in);

  /// Adds what is left, after that sweep.
  void add(const Model& model, int t, EffectSet effects, double h, const VectorRef& q,
           const VectorRef& v, Workspace::Impl& ws, InverseDerivatives& d);

 private:
  enum class Kind : unsigned char { kPlain, kForecast, kProjected, kBoth };

  bool turns_far(const Model& model, const Tree& tree, double h, double scale, const VectorRef& q,
                 const VectorRef& v, const Workspace::Impl& ws);

  bool forecast_at_rest(const Model& model, const Tree& tree, EffectSet effects, double h,
                        const VectorRef& q, const VectorRef& v, Workspace::Impl& ws);
  void add_forecast(const Model& model, const Tree& tree, EffectSet effects, double h,
                    const VectorRef& v, Workspace::Impl& ws, InverseDerivatives& d);
  void add_projected(const Model& model, int t, EffectSet effects, double h, const VectorRef& q,
                     const VectorRef& v, Workspace::Impl& ws, InverseDerivatives& d);
  void find_scale_gradient(const Model& model, const Tree& tree, double h, double scale,
                           const VectorRef& q, const VectorRef& v, const VectorX& rotors,
                           const Data& data);
  void find_share_gradient(const Model& model, const Tree& tree, double h, bool foreseen,
                           const Data& data);
  bool solve_rows(const Eigen::Ref<const MatrixX>& M, const Eigen::Ref<const MatrixX>& dyn_v,
                  int columns, bool both);
  void close_gradients(const Eigen::Ref<const MatrixX>& dyn_q,
                       const Eigen::Ref<const MatrixX>& dyn_v, int columns, double by,
                       const Eigen::Matrix<double, 4, 1>& grows);

  TreeSweep sweep_;
  SparseSolver solver_;
  std::vector<Kind> kind_;   ///< by tree
  VectorX zero_, ones_;      ///< nv
  VectorX other_;            ///< nv: what B(v, .) is taken with
  VectorX f_, a_f_, half_;   ///< nv: forecast, its acceleration, scratch
  MatrixX dq_, dv_, da_;     ///< nv x nv: of one sweep
  MatrixX factor_, solved_;  ///< nv x nv
  KineticGradient start_, end_;
  std::vector<AddedInertia> added_;  ///< empty
  std::optional<Data> reached_;
  VectorX q_reached_, moved_;
  MatrixX rows_;         ///< nv x 4: gradients by velocity at the end, then inv(M + R) of them
  MatrixX by_q_, by_v_;  ///< nv x 4: transposed, of the scale and of the momentum left
  VectorX share_q_, share_v_;
};

}  // namespace counterpoint
