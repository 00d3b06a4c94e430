// Repeating a check over random cases, with the number of the trial in every message.
#pragma once

#include <gtest/gtest.h>

#include <numeric>
#include <string>

#include "contact/random_problem.h"
#include "counterpoint/contact/solve/island_system.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact::testing {

// Central differences with step h on functions whose scale of change is the velocity y itself lose
// about (1e-16 / h) + h^2 relative; 1e-5 steps leave 1e-9 and 1e-10.
inline constexpr double kDifferenceStep = 1e-5;
inline constexpr double kDifferenceTolerance = 1e-6;

inline constexpr LawType kEveryType[] = {LawType::kUnilateral, LawType::kFrictionCone,
                                         LawType::kEquality, LawType::kDryFriction};

/// The laws as they are given, never softer ones: for statements about their solution.
inline Settings exact_settings() {
  Settings settings;
  settings.soften_after = 0;
  return settings;
}

/// All of a problem as one island, in the problem's numbering.
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

/// The same with random problems that have constraints, loaded as a whole:
/// body(random, problem, island). choose(random): their options.
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

/// Options of for_islands: friction is exact Coulomb or convex.
inline RandomOptions any_friction(Random& random) {
  RandomOptions options;
  options.coulomb = random.coin();
  return options;
}

}  // namespace counterpoint::contact::testing
