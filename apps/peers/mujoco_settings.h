// Settings of MuJoCo that decide its accuracy.
#pragma once

namespace counterpoint::peers {

/// Settings of MuJoCo; the members' initial values are its own defaults.
struct MujocoSettings {
  enum class Integrator { kEuler, kRungeKutta4, kImplicit };

  Integrator integrator = Integrator::kEuler;
  bool elliptic = false;      ///< elliptic friction cones instead of pyramids
  double impratio = 1.0;      ///< friction's impedance over that of the normal
  double solref_steps = 0.0;  ///< time constant in its own steps, damping ratio 1; 0: default
  double impedance = 0.0;     ///< constant impedance; 0: default, 0.9 to 0.95
  int noslip_iterations = 0;
  bool tight = false;           ///< tolerance 1e-12 and up to 1000 iterations
  bool several_points = false;  ///< several points for each pair of convex shapes
  bool exact_diagonal = false;  ///< exact diagonal of the constraints' inertia; since 3.12
  int substeps = 1;             ///< steps within a time step of the scene

  static const MujocoSettings kDefault;
  /// The usual choice for accuracy; solref of two steps is the shortest that MuJoCo takes itself.
  static const MujocoSettings kBest;
  static const MujocoSettings kRungeKutta4, kElliptic;

  bool operator==(const MujocoSettings&) const = default;
};

inline const MujocoSettings MujocoSettings::kDefault = {};
inline const MujocoSettings MujocoSettings::kBest = {.integrator = Integrator::kImplicit,
                                                     .elliptic = true,
                                                     .impratio = 100.0,
                                                     .solref_steps = 2.0,
                                                     .impedance = 0.9999,
                                                     .tight = true,
                                                     .several_points = true};
inline const MujocoSettings MujocoSettings::kRungeKutta4 = {.integrator = Integrator::kRungeKutta4};
inline const MujocoSettings MujocoSettings::kElliptic = {.elliptic = true};

}  // namespace counterpoint::peers
