// All that was found about a scene, and how it is shown.
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
  std::vector<Recommendation> recommendations;  ///< one a wanted error
  std::vector<double> wants;
  int repeats = 0;
  std::string replay = {};  ///< a page beside the report that shows settings; or empty

  const Point& at(const Place& place) const { return measured[place.family].points[place.point]; }
  bool on_front(const Place& place) const;
};

// In words.
std::string reference_words(const Findings& findings);
/// One line a curve over the time step: its order, or why there is none.
std::vector<std::string> order_lines(const Findings& findings);
/// Points that failed, families that were refused, items left out.
std::vector<std::string> omission_lines(const Findings& findings);

/// What this engine and others take for the same error, if any were measured.
std::vector<std::string> comparison_lines(const Findings& findings);

// As tables.
PageTable work_precision_table(const Findings& findings, const MeasuredFamily& measured);
/// Of all settings of the family that this engine ran; empty if there are none.
PageTable physics_table(const MeasuredFamily& measured);

/// For the terminal: tables, orders, physics, the recommendation.
void print(std::FILE* out, const Findings& findings);

/// accuracy.csv, accuracy.html, accuracy.svg and one picture an item, into a folder that is made.
/// @throws InputError if it cannot be written.
void write_report(const std::filesystem::path& folder, const Findings& findings);

/// Into the report (docs/reference/json-reports.md).
void add_to(Report& report, const Findings& findings);

}  // namespace counterpoint::apps::accuracy
