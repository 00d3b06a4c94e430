// Derivatives of the smooth forces of an inverse step by its parameters: inertia, gravity, and
// forces on single coordinates.
#pragma once

#include "counterpoint/engine/derivatives/dynamics/inertia_regressor.h"
#include "counterpoint/engine/derivatives/dynamics/sparse_solve.h"
#include "counterpoint/engine/derivatives/dynamics/sweep.h"
#include "counterpoint/engine/derivatives/inverted_step.h"
#include "counterpoint/engine/derivatives/parameters/prepared_parameter.h"
#include "counterpoint/engine/step/step_start.h"

namespace counterpoint {

/// Velocities at which forces of a tree that are quadratic in velocity are taken.
enum class TreeTerms {
  kNone,       ///< there are none, or it is one free body (free_flight.h)
  kPlain,      ///< velocity at the start
  kPredicted,  ///< velocities at both ends (mid_velocity.h)
  kProjected,  ///< under energy projection (energy_projection.h)
};
TreeTerms tree_terms(const Model& model, int t, const InvertedStep& inverted);

class ParameterDynamics {
 public:
  ParameterDynamics(const Model& model, size_t num_parameters);

  /// Adds the derivatives to du (nv x parameters), after step_inverse with these arguments. For
  /// trees under energy projection velocity-dependent forces are left out.
  void add(const std::vector<PreparedParameter>& parameters, const InverseArguments& of,
           const InvertedStep& inverted, MatrixX& du);

 private:
  using Parameters = std::vector<PreparedParameter>;
  void add_inertias(const Parameters& parameters, const Model& model, const Tree& tree,
                    const Kinematics& data, double factor, MatrixX& out) const;
  void add_gravity(const Parameters& parameters, const Model& model, BodyRange bodies,
                   const Kinematics& data, MatrixX& out) const;
  void add_prediction(const Parameters& parameters, const InverseArguments& of, const Tree& tree,
                      const Vector3& gravity, const InvertedStep& inverted, MatrixX& du);
  void find_prediction(const Parameters& parameters, const InverseArguments& of, const Tree& tree,
                       const Vector3& gravity, const InvertedStep& inverted);
  void add_flyers(const Parameters& parameters, const InverseArguments& of, const Vector3& gravity,
                  const Vector3& down, const InvertedStep& inverted, MatrixX& du) const;

  TreeSweep sweep_;
  InertiaRegressor regressor_;
  SparseSolver solver_;
  VectorX zero_, at_, acceleration_;  ///< nv
  MatrixX by_prediction_;             ///< nv x parameters: derivatives of the prediction's equation
  MatrixX dq_, dv_, M_;               ///< nv x nv
};

}  // namespace counterpoint
