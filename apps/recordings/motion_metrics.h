// Results on an estimated motion and its forces: agreement with recorded forces, which bodies carry
// the weight, and unexplained forces.
#pragma once

#include <string>
#include <vector>

#include "recordings/estimation.h"
#include "report/report.h"

namespace counterpoint::apps {

/// Agreement between an estimated force and the recorded one.
struct ForceAgreement {
  std::string name;        ///< name in the table of forces: "plate.contact.fz", "knee.u"
  std::string unit;        ///< "N" or "N m"
  int rows = 0;            ///< number of rows in which both are known
  double rms = 0.0;        ///< root mean square of the difference
  double inside_95 = 0.0;  ///< share of these rows with a difference below 1.96 standard deviations
};

/// Share of the weight that the world carries through a group of links.
struct Carrier {
  std::string name;    ///< name of the recorded contact force, or of the link
  double share = 0.0;  ///< mean over the rows [weight of all moving bodies]
};

/// Row in which a value is largest.
struct WorstRow {
  double value = 0.0;
  double time = 0.0;       ///< [s]
  std::string coordinate;  ///< name of a position or force; may be empty
};

/// Results on one recording.
struct ExplainedMetrics {
  double weight = 0.0;                         ///< weight of all moving bodies [N]
  std::vector<ForceAgreement> contact_forces;  ///< an entry for each recorded component
  std::vector<ForceAgreement> applied_forces;  ///< recorded forces without a standard deviation in
                                               ///< the column map, which the estimate does not use
  std::string support;            ///< the one shape of the world that carries all, or "world"
  std::vector<Carrier> carriers;  ///< in decreasing order of share
  double carried = 0.0;           ///< sum of the shares
  VectorX unexplained;            ///< value for each row [weights]; NaN where no force is known
  bool has_unactuated = false;    ///< some coordinate has no motor
  WorstRow worst_unexplained, worst_cost;
};

ExplainedMetrics explained_metrics(const Scene& scene, const ColumnMap& map,
                                   const Recording& recording, const MotionEstimate& estimate);

/// Interpolates row `row` of `values` linearly at the time t [s].
double recorded_at(const Recording& recording, const MatrixX& values, Eigen::Index row, double t);

/// Names of the positions that the coordinates of v change (nv): "knee.q", "pelvis.z"; "pelvis.wx"
/// for a rotation about an axis of the link.
std::vector<std::string> position_names(const Model& model);
/// Units of the generalized forces (nv): "N" or "N m".
std::vector<std::string> force_units(const Model& model);
/// Names of the sums of contact forces (MotionEstimate::sums), made unique: a link with the name of
/// a recorded contact force becomes NAME.link.
std::vector<std::string> sum_names(const ColumnMap& map, const std::vector<ContactSum>& sums);

/// Returns the recording's entry of the report (docs/reference/json-reports.md).
Json motion_entry(const Model& model, const MotionEstimate& estimate,
                  const ExplainedMetrics& metrics);
/// Returns the results as text; the last line says which links carry the weight.
std::string motion_text(const Model& model, const MotionEstimate& estimate,
                        const ExplainedMetrics& metrics);
/// Returns the last line of motion_text.
std::string weight_in_words(const MotionEstimate& estimate, const ExplainedMetrics& metrics);
/// Returns the reason why an estimate should not be trusted; empty if there is none.
std::string motion_complaint(const MotionEstimate& estimate, const ExplainedMetrics& metrics);

}  // namespace counterpoint::apps
