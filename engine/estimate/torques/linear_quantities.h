// Search coordinates of a fit of joint forces, and the quantities in which these are linear.
#pragma once

#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/estimate/torques/torque_rows.h"

namespace counterpoint::estimation {

/// Search coordinates: values of parameters, their logarithms, or the excess of breakaway friction
/// over dry friction; with bounds and priors.
struct Coordinates {
  /// parameters: must outlive this; start: values in the scene; dry_friction (nv): of the scene.
  /// @throws InputError for breakaway friction of joints with different dry frictions
  Coordinates(const std::vector<Parameter>& parameters, const VectorX& start,
              const VectorX& dry_friction);

  double range(Eigen::Index i) const { return ranges[i]; }
  VectorX values(const VectorX& x) const;
  /// Returns the covariance of values, or of their logarithms, from that of the coordinates.
  MatrixX covariance_of_values(MatrixX covariance) const;
  /// Returns the information on values, or on their logarithms, from that on the coordinates.
  MatrixX information_of_values(MatrixX information) const;
  /// Returns these coordinates with bounds that let Stribeck speeds change by a factor of exp(most)
  /// from those at x.
  Coordinates near(const VectorX& x, double most) const;

  const std::vector<Parameter>& parameters;
  VectorX lower, upper, prior, ranges;
  VectorX prior_weights;  ///< inverse squares of the standard deviations
  /// For breakaway friction: the index of its joints' dry friction among the parameters, or -1 and
  /// its value in the scene.
  std::vector<Eigen::Index> sliding;
  VectorX level;
};

/// Whether a parameter belongs to a recorded force, not to the scene.
bool is_channel(ParameterKind kind);

/// Whether joint forces without contact are linear in a parameter of the scene, or in inertial
/// parameters that follow from it; or nearly, for small changes (Stribeck speeds).
bool is_linear(ParameterKind kind);

/// Returns the properties of each channel (coordinate of v) at these values.
std::vector<ChannelValues> channel_values(const std::vector<int>& coordinates,
                                          const std::vector<Parameter>& parameters,
                                          const VectorX& values);

/// The quantities in which inverse dynamics is linear: ten of each body with an inertial parameter,
/// then one for each other parameter of the scene.
class LinearQuantities {
 public:
  /// parameters: must outlive this.
  LinearQuantities(const Scene& scene, const std::vector<Parameter>& parameters);

  const std::vector<int>& bodies() const { return bodies_; }
  Eigen::Index num_inertial() const { return 10 * static_cast<Eigen::Index>(bodies_.size()); }
  Eigen::Index size() const { return num_inertial() + static_cast<Eigen::Index>(others_.size()); }

  /// The quantities as parameters of steps.
  std::vector<StepParameter> step_parameters(const Model& model) const;
  VectorX at(const VectorX& values) const;
  /// Derivatives of the quantities by the search coordinates.
  MatrixX derivatives(const Coordinates& coordinates, const VectorX& x) const;

 private:
  const std::vector<Parameter>& parameters_;
  Model model_;  ///< the scene's
  std::vector<int> bodies_;
  std::vector<Eigen::Index> others_;  ///< parameters
};

}  // namespace counterpoint::estimation
