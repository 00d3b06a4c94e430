// Results of a motion estimate: motion, forces, contacts and their standard deviations.
#pragma once

#include "counterpoint/engine/estimate/motion/motion_fit.h"
#include "counterpoint/engine/estimate/motion/recorded_motion.h"
#include "counterpoint/engine/estimate/motion_estimate.h"

namespace counterpoint::estimation {

/// Sums, and one more for each link with a geometry.
std::vector<ContactSum> with_links(const Model& model, std::vector<ContactSum> sums);

/// Rows of a result, all unknown yet.
MotionEstimate empty_estimate(const Model& model, const std::vector<double>& time,
                              std::vector<ContactSum> sums);

/// Configurations and velocities of frames that are `h` [s] apart.
void set_motion(const Model& model, const std::vector<VectorX>& frames, double h,
                MotionEstimate& out);

/// Forces and contacts of a fit, with their standard deviations; parameters; and the cost ratio of
/// each row.
void set_forces(const MotionProblem& problem, MotionFit& fit, MotionEstimate& out);

/// The same without standard deviations (NaN; of parameters infinity), in a tenth of the time: what
/// a search that was stopped tells.
void set_forces_alone(const MotionProblem& problem, const MotionFit& fit, MotionEstimate& out);

/// Forces and contacts of one row as an inverse gives them, without deviations.
void set_inverse(const Model& model, const Inverse& inverse, int row, MotionEstimate& out);

/// The same with sums, and deviations that nobody has computed: NaN.
void set_unsure(const Model& model, const Inverse& inverse, int row, MotionEstimate& out);

/// Contact forces on links in a row: sums over its pairs. covariance: of all pairs' forces, or
/// null.
void set_sums(const Model& model, int row, const MatrixX* covariance, MotionEstimate& out);

/// MotionEstimate::residual_correlation of white errors of these deviations; q: nq x rows.
VectorX residual_correlation(const Model& model, const RecordedMotion& recorded, const MatrixX& q,
                             const VectorX& deviation);

/// Outliers, means over the rows, whiteness of residuals, and what is not explained.
void summarize(const Model& model, const RecordedMotion& recorded, MotionEstimate& out);

/// Leaves out sums behind the first `wanted` whose links never touch anything.
void leave_out_untouched(std::size_t wanted, MotionEstimate& out);

/// Puts the rows of a part into those from `first` on, but for `skip` at its start; parameters
/// become means, weighted by their precision.
void append(const MotionEstimate& part, int first, int skip, MotionEstimate& out);

}  // namespace counterpoint::estimation
