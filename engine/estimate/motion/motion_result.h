// Results of a motion estimate: motion, forces, contacts and their standard deviations.
#pragma once

#include "counterpoint/engine/estimate/motion/motion_fit.h"
#include "counterpoint/engine/estimate/motion/recorded_motion.h"
#include "counterpoint/engine/estimate/motion_estimate.h"

namespace counterpoint::estimation {

/// Returns the sums, with one more for each link that has a geometry.
std::vector<ContactSum> with_links(const Model& model, std::vector<ContactSum> sums);

/// A result with these rows, all NaN.
MotionEstimate empty_estimate(const Model& model, const std::vector<double>& time,
                              std::vector<ContactSum> sums);

/// Sets configurations and velocities from frames that are `h` [s] apart.
void set_motion(const Model& model, const std::vector<VectorX>& frames, double h,
                MotionEstimate& out);

/// Sets forces and contacts with standard deviations, parameters, sensors and the cost ratio of
/// each row.
void set_forces(const MotionProblem& problem, MotionFit& fit, MotionEstimate& out);

/// The same without standard deviations (NaN; infinity for parameters), in a tenth of the time, for
/// a search that was stopped.
void set_forces_alone(const MotionProblem& problem, const MotionFit& fit, MotionEstimate& out);

/// Sets forces and contacts of one row from inverse dynamics, with zero standard deviations.
void set_inverse(const Model& model, const Inverse& inverse, int row, MotionEstimate& out);

/// The same with sums, and with unknown standard deviations (NaN).
void set_unsure(const Model& model, const Inverse& inverse, int row, MotionEstimate& out);

/// Sets the contact force sums of a row. covariance: of the forces of all pairs, or null.
void set_sums(const Model& model, int row, const MatrixX* covariance, MotionEstimate& out);

/// Computes MotionEstimate::residual_correlation for these standard deviations; q: nq x rows.
VectorX residual_correlation(const Model& model, const RecordedMotion& recorded, const MatrixX& q,
                             const VectorX& deviation);

/// Collects outliers, means over rows, residual correlation and unexplained forces.
void summarize(const Model& model, const RecordedMotion& recorded, MotionEstimate& out);

/// Drops sums after the first `wanted` whose links never touch anything.
void leave_out_untouched(std::size_t wanted, MotionEstimate& out);

/// Copies the rows of a part, without its first `skip`, to the rows from `first` on; parameters
/// become means weighted by precision.
void append(const MotionEstimate& part, int first, int skip, MotionEstimate& out);

}  // namespace counterpoint::estimation
