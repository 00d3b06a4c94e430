// Results of compare and identify, as a folder with one HTML page and its pictures: --report DIR.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "recordings/estimation.h"
#include "report/chart.h"
#include "report/html_page.h"
#include "report/report.h"

namespace counterpoint::apps {

/// Some predictions under one name: a scene as it is, or as found.
struct NamedPredictions {
  std::string name;
  const std::vector<Prediction>* predictions;
};

/// Error against time from the start of each recording: the median over recordings, of a single set
/// the quartiles beside it. Position and rotation, or joints.
std::vector<Chart> error_charts(const std::vector<NamedPredictions>& sets, Compared by);

/// Recorded and simulated over each other, a chart for each position that the map names.
std::vector<Chart> coordinate_charts(const Model& model, const Recording& recording,
                                     const Prediction& prediction, const ColumnMap& map);

/// A row a recording.
PageTable prediction_table(const std::vector<Prediction>& predictions, Compared by);
/// The figures of coordinates as reports have them, and as a table.
Json coordinate_list(const std::vector<CoordinateFigures>& figures);
PageTable coordinate_table(const std::vector<CoordinateFigures>& figures);
PageTable explanation_table(const std::vector<ExplainedRecording>& recordings);
/// Unexplained force against time, median and quartiles over recordings.
Chart unexplained_chart(const std::vector<ExplainedRecording>& recordings);

/// Writes DIR/index.html, and each chart as DIR/NAME0.svg, ... beside it. @throws InputError where
/// the folder cannot be written.
void write_page(const std::filesystem::path& folder, const HtmlPage& page,
                const std::vector<Chart>& charts);

}  // namespace counterpoint::apps
