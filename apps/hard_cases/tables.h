// Results of hard cases: as text, as Markdown, for machines.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "report/report.h"
#include "trial.h"

namespace counterpoint::apps {

/// A line for the case, one for each figure, and under it those of the peers.
void print_result(std::FILE* out, const Result& result);

/// A table of all figures and what is said about each case.
std::string markdown(const std::vector<Result>& results);

/// One entry of `cases` (docs/reference/json-reports.md).
Json json_case(const Result& result);

}  // namespace counterpoint::apps
