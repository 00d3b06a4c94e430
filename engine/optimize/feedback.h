// Feedback along a motion: what to add to its forces where the robot is not where the plan says.
//
//   u = u_t - K_t x,    x = (q (-) q_t, v - v_t)
//
// K_t of the finite-horizon linear-quadratic regulator (Kwakernaak and Sivan, Linear Optimal
// Control Systems, 1972, section 6.4) for x_{t+1} = A_t x_t + B_t du, A and B from the derivatives
// of the step (engine/step_derivatives.h).
#pragma once

#include <filesystem>
#include <vector>

#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

struct FeedbackSettings {
  double position_weight = 1.0;  ///< of x [1/rad, 1/m], squared in the cost
  double velocity_weight = 0.1;  ///< [s/rad, s/m]
  double effort_weight = 1.0;    ///< of forces over their effort limit, or over 100 N, N m
  /// Contacts as soft as at this smoothing [m]: at hard ones the linear model holds for no more
  /// than their gaps.
  double smoothing = 1e-4;
  int cycles = 8;  ///< of a periodic motion, until gains repeat
};

/// Gains of a motion: by step, nv x 2 nv; rows without a motor are zero.
struct Feedback {
  std::vector<MatrixX> gains;
  /// Steps whose derivatives could not be had: their gain is that of the step behind.
  int missing = 0;
};

/// @throws InputError as check_problem.
Feedback compute_feedback(const Problem& problem, const Settings& settings, const Result& result,
                          const FeedbackSettings& feedback);

/// A motion repeated: frames, velocities, forces and gains of so many cycles, mirrored and
/// displaced as the problem says. Of motions that are not periodic: as they are.
struct RepeatedMotion {
  std::vector<VectorX> q, v, applied_force;
  std::vector<MatrixX> gains;
};
RepeatedMotion repeated(const Problem& problem, const Result& result, const Feedback* feedback,
                        int cycles);

/// Gains as CSV: a row for each step and coordinate with a motor: step, v_index, then the columns
/// of dq and dv.
void write_feedback(const std::filesystem::path& file, const Model& model,
                    const std::vector<MatrixX>& gains);
/// @throws InputError naming file, line and column.
std::vector<MatrixX> read_feedback(const std::filesystem::path& file, const Model& model);

/// u at a state: from the plan's frame, velocity, force and gain (which may be empty), within
/// effort limits.
VectorX following_force(const Model& model, const VectorX& q_plan, const VectorX& v_plan,
                        const VectorX& u_plan, const MatrixX& gain, const VectorX& q,
                        const VectorX& v);  // Parameters: what it depends on, one by one

}  // namespace counterpoint::optimization
