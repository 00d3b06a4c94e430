// Repeating a check over random cases, with the number of the trial in every message.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "contact/random_problem.h"

namespace counterpoint::contact::testing {

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

}  // namespace counterpoint::contact::testing
