// Recordings to fit, and recordings that are kept back to score the fit.
#pragma once

#include <string>
#include <vector>

#include "recordings/estimation.h"
#include "report/report.h"

namespace counterpoint::apps {

/// Indices of the recordings to fit, and of those to predict with the parameters found.
struct Split {
  std::vector<int> train, test;
};

/// Deals out recordings 0 ... count - 1 in their order, without random numbers: this share of them
/// is fitted, spread evenly. shift: recordings that the pattern begins with elsewhere.
Split deal(int count, double share, int shift = 0);
/// Splits into folds: the recordings k, k + folds, ... are kept back by fold k. @throws InputError
/// for fewer than 2 folds or recordings than folds.
std::vector<Split> folds_of(int count, int folds);

/// Prints a fold and appends it to `folds` of the report. kept_back: files. Returns its entry.
Json& add_fold(const std::vector<Parameter>& parameters, const std::vector<std::string>& kept_back,
               const Fit& found, Report& report);
/// Writes and prints mean and standard deviation of each parameter over the folds, if there are
/// two or more.
void fill_fold_parameters(const std::vector<Parameter>& parameters, Report& report);

}  // namespace counterpoint::apps
