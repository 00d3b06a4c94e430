// Figures of an estimated motion and the forces behind a recording: how far they are from those
// that were recorded, who carries the weight, and what nothing explains.
#pragma once

#include <string>
#include <vector>

#include "recordings/estimation.h"
#include "report/report.h"

namespace counterpoint::apps {

/// How far an estimated force is from the one that was recorded.
struct ForceAgreement {
  std::string name;        ///< as in the table of forces: "plate.contact.fz", "knee.u"
  std::string unit;        ///< "N" or "N m"
  int rows = 0;            ///< in which both are known
  double rms = 0.0;        ///< root mean square of the difference
  double inside_95 = 0.0;  ///< share of the rows in which it lies within 1.96 standard deviations
};

/// A share of the weight that the world carries through some links.
struct Carrier {
  std::string name;    ///< the recorded contact force's, or the link's
  double share = 0.0;  ///< mean over the rows [weights of all that moves]
};

/// Where a figure is largest.
struct WorstRow {
  double value = 0.0;
  double time = 0.0;       ///< [s]
  std::string coordinate;  ///< name of a position or of a force; empty where there is none
};

/// Figures of one recording.
struct ExplainedFigures {
  double weight = 0.0;                         ///< weight of all that moves [N]
  std::vector<ForceAgreement> contact_forces;  ///< a recorded component each
  std::vector<ForceAgreement> applied_forces;  ///< mapped without a deviation, so not used
  std::string support;            ///< the one shape of the world that carries, or "world"
  std::vector<Carrier> carriers;  ///< in falling order of share
  double carried = 0.0;           ///< their sum
  VectorX unexplained;            ///< a row each [weights]; NaN where no force is known
  bool has_unactuated = false;    ///< some coordinate has no motor
  WorstRow worst_unexplained, worst_cost;
};

ExplainedFigures explained_figures(const Scene& scene, const ColumnMap& map,
                                   const Recording& recording, const MotionEstimate& estimate);

/// Row of `values` at the time t [s], between two rows of the recording where it has none there.
double recorded_at(const Recording& recording, const MatrixX& values, Eigen::Index row, double t);

/// Names of the positions that coordinates of v change (nv): "knee.q", "pelvis.z"; of a turn about
/// an axis of the link "pelvis.wx".
std::vector<std::string> position_names(const Model& model);
/// Units of forces (nv): "N" or "N m".
std::vector<std::string> force_units(const Model& model);
/// Names of sums of contact forces (MotionEstimate::sums), each once: a link that is called as a
/// recorded contact force is NAME.link.
std::vector<std::string> sum_names(const ColumnMap& map, const std::vector<ContactSum>& sums);

/// An entry of the report (docs/reference/json-reports.md).
Json motion_entry(const Model& model, const MotionEstimate& estimate,
                  const ExplainedFigures& figures);
/// The same for people; its last line says in words who carries the weight.
std::string motion_text(const Model& model, const MotionEstimate& estimate,
                        const ExplainedFigures& figures);
/// The last line of motion_text.
std::string weight_in_words(const MotionEstimate& estimate, const ExplainedFigures& figures);
/// Why an estimate is not to be trusted; empty: nothing speaks against it.
std::string motion_complaint(const MotionEstimate& estimate, const ExplainedFigures& figures);

}  // namespace counterpoint::apps
