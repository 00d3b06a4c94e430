// The report of `identify`: parameters, identifiability and scores, as JSON, text and a page.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/estimate/torque_fit.h"
#include "recordings/estimation.h"
#include "report/chart.h"
#include "report/report.h"

namespace counterpoint::apps {

/// Predictions of whole recordings, by the scene before and after the fit.
struct Rollouts {
  std::vector<Prediction> before, after;
};

Rollouts roll_out(Experiment e, const Scene& found, const std::vector<int>& which);

/// Returns the median errors of the rollouts, and how many recordings are predicted better.
Json score(const Rollouts& rollouts, Compared by);
void print_score(const char* title, const Json& score, const Report& report);
/// Prints lists of coordinates (coordinate_list) under the keys `scene` and `found`.
void print_coordinates(const Json& coordinates, const Report& report);

/// Writes and prints the parameters found. start: their values in the scene.
void fill_report(const std::vector<Parameter>& parameters, const VectorX& start, const Fit& found,
                 Report& report);
/// Writes the parameters found to a file that --set @FILE takes, one a line, with their units and
/// intervals as comments.
void write_settings(const std::string& file, const std::string& scene_file, const Json& parameters);

/// Writes and prints the unknown constants of sensors, which were found with the parameters.
void fill_constants(const std::vector<EstimatedParameter>& constants, Report& report);

/// Writes and prints which directions of the parameters the recordings tell, and which not.
void fill_told(const std::vector<Parameter>& parameters, const Fit& found, Report& report);
/// Writes the base parameters and the channels of a fit of torques.
void fill_torques(const Model& model, const TorqueFit& found, Report& report);

/// Writes the page of a fit of predictions: parameters, scores, and errors of the rollouts over
/// time.
void write_identify_page(const std::string& folder, const std::string& scene_file,
                         const Rollouts& rollouts, Compared by, const Json& report);
/// Charts of the recorded force of each channel, and of those predicted before and after the fit.
std::vector<Chart> force_charts(const TorqueScore& before, const TorqueScore& after);
/// Writes the page of a fit of torques: parameters, identifiability, scores and these charts.
void write_torque_page(const std::string& folder, const std::string& scene_file,
                       const std::vector<Chart>& charts, const Json& report);

}  // namespace counterpoint::apps
