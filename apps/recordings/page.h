// Results of compare and identify as a folder with an HTML page and its pictures: --report DIR.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "recordings/estimation.h"
#include "report/chart.h"
#include "report/html_page.h"
#include "report/report.h"

namespace counterpoint::apps {

/// Predictions of one scene, under a name.
struct NamedPredictions {
  std::string name;
  const std::vector<Prediction>* predictions;
};

/// Charts of error over time since the start of each recording: the median over the recordings, and
/// for a single set also the quartiles. Errors are those of position and rotation, or of joints.
std::vector<Chart> error_charts(const std::vector<NamedPredictions>& sets, Compared by);

/// Charts of recorded and simulated values, one for each position that the column map names.
std::vector<Chart> coordinate_charts(const Model& model, const Recording& recording,
                                     const Prediction& prediction, const ColumnMap& map);

/// Table with a row per recording.
PageTable prediction_table(const std::vector<Prediction>& predictions, Compared by);
/// The results by coordinate, as entries of reports and as a table.
Json coordinate_list(const std::vector<CoordinateMetrics>& metrics);
PageTable coordinate_table(const std::vector<CoordinateMetrics>& metrics);
PageTable explanation_table(const std::vector<ExplainedRecording>& recordings);
/// Chart of unexplained force over time: median and quartiles over the recordings.
Chart unexplained_chart(const std::vector<ExplainedRecording>& recordings);

/// Writes DIR/index.html and its pictures that have a file as DIR/chart0.svg, ... @throws
/// InputError if the folder cannot be written.
void write_page(const std::filesystem::path& folder, const HtmlPage& page);

}  // namespace counterpoint::apps
