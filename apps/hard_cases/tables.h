// Results of hard cases as text, Markdown and JSON.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "report/report.h"
#include "trial.h"

namespace counterpoint::apps {

/// Prints one line for the case and one for each figure, then those of the other engines.
void print_result(std::FILE* out, const Result& result);

/// Table of all figures, and the remarks on each case.
std::string markdown(const std::vector<Result>& results);

/// JSON entry of `cases` (docs/reference/json-reports.md).
Json json_case(const Result& result);

}  // namespace counterpoint::apps
