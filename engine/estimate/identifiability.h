// Identifiability of parameters: directions that recordings tell, and directions that they do not.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "counterpoint/engine/estimate/estimate.h"

namespace counterpoint::estimation {

/// A change of parameters that the recordings do not tell: it has less effect than the noise.
struct UntoldDirection {
  /// Parameters, by their index, and their changes in their units. The largest is a whole range.
  std::vector<std::pair<int, double>> parts;
  /// Its standard deviation, in ranges of the parameters (upper minus lower bound); above kTold.
  double deviation = 0.0;
  std::string words;  ///< the same in a sentence
};

/// A parameter counts as told if its standard deviation, without a prior, is at most this share of
/// its range.
inline constexpr double kTold = 0.3;

struct Identifiability {
  /// Singular values of the sensitivity, descending: by how many standard deviations of the noise
  /// the recordings change along a direction over the ranges of the parameters.
  VectorX spectrum;
  std::vector<UntoldDirection> untold;
  /// Parameters x recordings: share of the information about each parameter (without the others).
  MatrixX shares;
};

/// Analyses the information matrix of the search coordinates (logarithms of logarithmic
/// parameters): J' J of residuals over their standard deviations, without priors. values: of the
/// parameters; by_recording: its diagonals, parameters x recordings.
Identifiability identifiability(const std::vector<Parameter>& parameters, const VectorX& values,
                                const MatrixX& information, const MatrixX& by_recording);

/// The same of a fit that was not stopped.
Identifiability identifiability(const std::vector<Parameter>& parameters, const Fit& fit);

/// The combinations of inertial parameters that motions of a model can tell at all, whatever the
/// recording (base parameters: Gautier, "Numerical Calculation of the Base Inertial Parameters of
/// Robots", J. Robotic Systems 1991).
struct BaseParameters {
  /// Combinations x 10 (num_bodies - 1): base = combinations inertial_parameters(model). Each has
  /// one parameter of its own with coefficient 1.
  MatrixX combinations;
  std::vector<std::string> names;  ///< "Izz(upper) + 0.09 m(lower) ...", at most a few terms
};
/// Finds them from the regressor at states spread over the model's configurations.
BaseParameters base_parameters(const Model& model);

}  // namespace counterpoint::estimation
