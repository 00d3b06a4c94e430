// Terms of problem files. Internal header.
#pragma once

#include <vector>

#include "counterpoint/engine/optimize/files/source_motion.h"
#include "counterpoint/engine/optimize/files/target_reader.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::optimization {

/// Sources of targets over time.
struct TargetSources {
  TargetReader tables;
  std::optional<SourceMotion> motion;
};

/// True for an entry whose targets are the fitted motion (fit_motion).
inline bool follows_fit(const YamlValue& in) {
  return in.has("target") && in.at("target").is_text("fit");
}

/// Reads one entry of `terms`: a term, or one for each of its links and points. start, goal: poses
/// that targets may refer to (nq; goal may be empty). Uses model, steps and motors of the problem.
std::vector<Term> read_terms(const YamlValue& in, const Problem& problem, const VectorX& start,
                             const VectorX& goal, TargetSources& targets);

}  // namespace counterpoint::optimization
