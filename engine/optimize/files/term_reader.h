// Terms of problem files. Not for users.
#pragma once

#include <vector>

#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::optimization {

/// One entry of `terms`: a term, or one for each of its links and points. start, goal: poses that a
/// target may be (nq; goal may be empty). Of the problem: its model, steps and motors.
std::vector<Term> read_terms(const YamlValue& in, const Problem& problem, const VectorX& start,
                             const VectorX& goal);

}  // namespace counterpoint::optimization
