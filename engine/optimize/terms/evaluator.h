// Residuals of one instant of a motion and their derivatives; one object per thread.
#pragma once

#include <utility>
#include <vector>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/optimize/terms/frames.h"
#include "counterpoint/engine/optimize/terms/kinematic_terms.h"
#include "counterpoint/engine/optimize/terms/tangent_map.h"

namespace counterpoint::optimization {

/// Settings of a stage of the continuation.
struct Stage {
  SimulationOptions options;
  double penalty = 1.0;  ///< rho: a condition costs rho / 2 |c + lambda|^2
  double late = 0.0;     ///< exponent of Term::late_weight, 0 ... 1
  /// Restoration: only conditions have residuals, without multipliers. Other terms stay in the
  /// Gauss-Newton matrix as a metric, so that steps towards feasibility are cheapest in it.
  bool restoring = false;
  double contact_damping = 0.0;  ///< Continuation::contact_damping
  DerivativeMethod derivatives = DerivativeMethod::kAnalytic;
};

/// The rows of one term at an instant.
struct Span {
  int term = 0;
  int first = 0, rows = 0;
};

/// Assigns rows of the instants to terms.
class Layout {
 public:
  explicit Layout(const Problem& problem);
  const std::vector<Span>& spans(int instant) const {
    return spans_[static_cast<std::size_t>(instant)];
  }
  int rows(int instant) const { return rows_[static_cast<std::size_t>(instant)]; }

 private:
  std::vector<std::vector<Span>> spans_;
  std::vector<int> rows_;
};

/// Values of an instant.
struct InstantValues {
  VectorX residual;       ///< rows; NaN if inverse dynamics fails
  VectorX violation;      ///< rows: weight (value - target) of conditions, 0 of other terms
  VectorX applied_force;  ///< nv [N, N m]; empty at frame N
};

/// J'J and J'r of an instant's rows over three frames: before, at and after it.
struct NormalEquations {
  MatrixX gram;      ///< 3 nv x 3 nv, lower triangle
  VectorX gradient;  ///< 3 nv
  /// With s = log h and the frames held: J' dr/ds (3 nv), |dr/ds|^2, r' dr/ds and r' d^2r/ds^2;
  /// found only if the duration is free.
  VectorX by_time;
  double time_gram = 0.0, time_gradient = 0.0, time_curvature = 0.0;
  /// nv x nv, for the frame after it: contact_damping penalty sum of (dlog f / dq)^2 over contacts
  /// with the normal force f; empty without contact_damping.
  MatrixX metric;
};

class Evaluator {
 public:
  explicit Evaluator(const Problem& problem);

  /// Evaluates an instant. multiplier: lambda by row. normal: the linearization, or null.
  void evaluate(const Layout& layout, const Frames& frames, const Stage& stage, int instant,
                const VectorX& multiplier, InstantValues& out, NormalEquations* normal);

 private:
  void gather(const Frames& frames, int instant, bool step);
  void find_forces(const Stage& stage, NormalEquations* normal);
  void evaluate_coordinates(const Term& term, const Span& span, double factor,
                            const VectorX& multiplier, InstantValues& out, NormalEquations* normal);
  void evaluate_forces(const Term& term, const Span& span, double factor, const VectorX& multiplier,
                       InstantValues& out, bool derivatives);
  void evaluate_dense(const Term& term, const Span& span, double factor, const VectorX& multiplier,
                      InstantValues& out, NormalEquations* normal);
  void take_contact_rows(const Term& term);
  void differentiate_by_time(const Stage& stage);
  std::pair<Vector3, Vector3> contact_force_by_time(int body) const;
  void differentiate_angular_momentum();
  void find_metric(const Stage& stage, MatrixX& out);
  void set_rows(const Term& term, const Span& span, double factor, const VectorX& multiplier,
                const VectorRef& value, InstantValues& out) const;
  bool restoring_ = false;
  int instant_ = 0;
  double h_ = 0.0;  ///< [s]
  void add_coordinate_rows(const Span& span, const InstantValues& out,
                           const TangentMap* const (&maps)[3], NormalEquations& normal) const;
  void add_dense_rows(NormalEquations& normal);

  const Problem* problem_;
  const Model* model_;
  std::vector<int> rotations_;
  Workspace workspace_;
  Inverse inverse_;
  InverseDerivatives derivatives_;
  Input nothing_;
  Data before_, at_, scratch_data_;
  KinematicScratch scratch_;
  VectorX q_before_, q_, q_next_, v_, w_, difference_;
  TangentMap v_by_before_, v_by_at_, w_by_at_, w_by_next_, by_target_, by_q_, sum_;
  VectorX value_, weight_;                  ///< nv: of the current term of coordinates or forces
  MatrixX by_before_[3], by_at_[3];         ///< rows x nv, of terms of 1, 2 and 3 rows
  MatrixX by_q_v_w_[3];                     ///< rows x nv: derivatives with respect to q, v, v_next
  VectorX force_weight2_, force_gradient_;  ///< nv: sums over all terms of applied forces
  MatrixX force_rows_;                      ///< nv x 3 nv: derivatives of the applied force
  MatrixX dense_;  ///< rows x 3 nv, weighted; the first num_dense_ rows are used
  VectorX dense_residual_, dense_by_time_;
  VectorX by_time_;  ///< nv: derivatives of the current term of coordinates by log h, weighted
  VectorX force_by_time_, force_curvature_;  ///< nv: derivatives of the applied force by log h
  SimulationOptions changed_options_;
  Inverse quick_, slow_;  ///< the same frames in less and in more time
  Eigen::Index num_dense_ = 0;
};

}  // namespace counterpoint::optimization
