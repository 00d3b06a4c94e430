// Terms of problem files. Internal header.
#pragma once

#include <vector>

#include "counterpoint/engine/optimize/files/target_reader.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::optimization {

/// Reads one entry of `terms`: a term, or one for each of its links and points. start, goal: poses
/// that targets may refer to (nq; goal may be empty). Uses model, steps and motors of the problem.
std::vector<Term> read_terms(const YamlValue& in, const Problem& problem, const VectorX& start,
                             const VectorX& goal, TargetReader& targets);

}  // namespace counterpoint::optimization
