// Frictional contact problems as files: a folder with W.csv and q_mu.csv.
#pragma once

#include <filesystem>

#include "counterpoint/contact/solver.h"

namespace counterpoint::apps {

/// Reads W.csv (row, col, value: nonzero entries of A) and q_mu.csv (q_n, q_t1, q_t2, mu: one row
/// per contact). @throws InputError naming file and line
contact::ContactSpaceProblem read_contact_problem(const std::filesystem::path& folder);

}  // namespace counterpoint::apps
