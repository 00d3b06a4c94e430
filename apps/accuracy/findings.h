// All results of a scene, and their output.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "measure.h"
#include "recommendation.h"
#include "report/html_page.h"
#include "report/report.h"

namespace counterpoint::apps::accuracy {

struct Findings {
  const Scene& scene;
  Plan plan;
  Reference reference;
  std::vector<MeasuredFamily> measured;
  std::vector<std::string> left_out;
  std::vector<Place> front;
  std::vector<Recommendation> recommendations;  ///< one for each wanted error
  std::vector<double> wants;
  int repeats = 0;
  std::string replay = {};  ///< page beside the report that plays the motion; or empty

  const Point& at(const Place& place) const { return measured[place.family].points[place.point]; }
  bool on_front(const Place& place) const;
};

// Results in words.
std::string reference_words(const Findings& findings);
/// One line for each curve over the time step: its order, or why there is none.
std::vector<std::string> order_lines(const Findings& findings);
/// Points that failed, families that were refused, items left out.
std::vector<std::string> omission_lines(const Findings& findings);

/// Cost of this engine and of others for the same error; empty if no others were measured.
std::vector<std::string> comparison_lines(const Findings& findings);

// Results as tables.
PageTable work_precision_table(const Findings& findings, const MeasuredFamily& measured);
/// Physics of all settings of the family that this engine ran; empty if there are none.
PageTable physics_table(const MeasuredFamily& measured);

/// Prints tables, orders, physics and the recommendation for the terminal.
void print(std::FILE* out, const Findings& findings);

/// Writes accuracy.csv, accuracy.html, accuracy.svg and one picture for each item into a folder,
/// which is created. @throws InputError if it cannot be written.
void write_report(const std::filesystem::path& folder, const Findings& findings);

/// Adds the results to the JSON report (docs/reference/json-reports.md).
void add_to(Report& report, const Findings& findings);

}  // namespace counterpoint::apps::accuracy
