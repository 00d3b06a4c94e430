// Frictional contact problems as files: a folder with W.csv and q_mu.csv.
#pragma once

#include <filesystem>

#include "counterpoint/contact/solver.h"

namespace counterpoint::apps {

/// Reads W.csv (row, col, value: entries of A that are not zero) and q_mu.csv (q_n, q_t1, q_t2, mu:
/// a row per contact). @throws InputError naming file and line.
contact::ContactSpaceProblem read_contact_problem(const std::filesystem::path& folder);

}  // namespace counterpoint::apps
