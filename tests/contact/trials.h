// Repeats a check over random cases, with the trial number in every message.
#pragma once

#include <gtest/gtest.h>

#include <numeric>
#include <string>

#include "contact/random_problem.h"
#include "counterpoint/contact/solve/island_system.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact::testing {

// For a function that varies on the scale of its argument, central differences with step h have a
// relative error of about 1e-16 / h + h^2; h = 1e-5 gives 1e-11 and 1e-10.
inline constexpr double kDifferenceStep = 1e-5;
inline constexpr double kDifferenceTolerance = 1e-6;

inline constexpr LawType kEveryType[] = {LawType::kUnilateral, LawType::kFrictionCone,
                                         LawType::kEquality, LawType::kDryFriction};

/// Settings that never soften the laws, for statements about their solution.
inline Settings exact_settings() {
  Settings settings;
  settings.soften_after = 0;
  return settings;
}

/// Loads the whole problem as one island, in the problem's numbering.
inline void load_whole(const Problem& problem, IslandSystem& island) {
  std::vector<int> blocks(problem.num_blocks()), constraints(problem.num_constraints());
  std::iota(blocks.begin(), blocks.end(), 0);
  std::iota(constraints.begin(), constraints.end(), 0);
  island.load(problem, blocks, constraints, Factorization::kAutomatic);
}

/// Calls body(random, trial) for trial = 0 ... trials - 1; stops after a fatal failure.
template <class Body>
void for_trials(unsigned seed, int trials, const Body& body) {
  Random random(seed);
  for (int trial = 0; trial < trials; ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    body(random, trial);
    if (::testing::Test::HasFatalFailure()) return;
  }
}

/// Like for_trials, with random problems that have constraints, loaded as one island: body(random,
/// problem, island). choose(random) returns the options of a problem.
template <class Choose, class Body>
void for_islands(unsigned seed, int trials, const Choose& choose, const Body& body) {
  for_trials(seed, trials, [&](Random& random, int) {
    const RandomOptions options = choose(random);
    const Problem problem = random_problem(random, options);
    if (problem.num_constraints() == 0) return;
    IslandSystem island;
    load_whole(problem, island);
    body(random, problem, island);
  });
}

/// Options for for_islands: friction follows the Coulomb or the convex law at random.
inline RandomOptions any_friction(Random& random) {
  RandomOptions options;
  options.coulomb = random.coin();
  return options;
}

}  // namespace counterpoint::contact::testing
