// Feedback gains along an optimized motion, and the motion repeated for a number of cycles.
#pragma once

#include <filesystem>
#include <vector>

#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

// ---- Feedback along a motion: a correction of the planned forces for deviations of the state.
//
//   u = u_t - K_t x,    x = (q (-) q_t, v - v_t)
//
// K_t is the gain of the finite-horizon linear-quadratic regulator (Kwakernaak and Sivan, Linear
// Optimal Control Systems, 1972, section 6.4) for x_{t+1} = A_t x_t + B_t du, with A and B from the
// derivatives of the step (engine/derivatives.h).

struct FeedbackSettings {
  double position_weight = 1.0;  ///< weight of position deviations [1/rad, 1/m], squared in the
                                 ///< cost
  double velocity_weight = 0.1;  ///< weight of velocity deviations [s/rad, s/m]
  double effort_weight = 1.0;  ///< weight of forces relative to their effort limit, or to 100 N, N
                               ///< m
  /// Smoothing [m] of the contacts in the linearization: with hard contacts the linear model is
  /// valid only within their gaps.
  double smoothing = 1e-4;
  int cycles = 8;  ///< backward passes over a periodic motion, until the gains repeat
};

/// Feedback gains of a motion.
struct Feedback {
  std::vector<MatrixX> gains;
  /// Number of steps without derivatives, whose gain is that of the following step.
  int missing = 0;
};

/// Computes the gains: one nv x 2 nv matrix per step; rows without a motor are zero. @throws
/// InputError as check_problem.
Feedback compute_feedback(const Problem& problem, const Settings& settings, const Result& result,
                          const FeedbackSettings& feedback);

/// A periodic motion repeated for a number of cycles, with the problem's mirror and displacement:
/// frames, velocities, forces and gains. A motion that is not periodic is copied once.
struct RepeatedMotion {
  std::vector<VectorX> q, v, applied_force;
  std::vector<MatrixX> gains;
};
RepeatedMotion repeated(const Problem& problem, const Result& result, const Feedback* feedback,
                        int cycles);

/// Writes gains as CSV: one row per step and coordinate with a motor, with the columns step,
/// v_index, and those of dq and dv.
void write_feedback(const std::filesystem::path& file, const Model& model,
                    const std::vector<MatrixX>& gains);
/// Reads gains written by write_feedback. @throws InputError naming file, line and column.
std::vector<MatrixX> read_feedback(const std::filesystem::path& file, const Model& model);

/// Returns the feedback force at the state (q, v), within effort limits, from frame, velocity,
/// force and gain of the plan (the gain may be empty).
VectorX following_force(const Model& model, const VectorX& q_plan, const VectorX& v_plan,
                        const VectorX& u_plan, const MatrixX& gain, const VectorX& q,
                        const VectorX& v);

}  // namespace counterpoint::optimization
