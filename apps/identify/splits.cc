#include "identify/splits.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace counterpoint::apps {

Split deal(int count, double share, int shift) {
  Split out;
  for (int i = 0; i < count; ++i) {
    const int at = i + shift;
    const bool train = std::ceil((at + 1) * share - 1e-9) > std::ceil(at * share - 1e-9);
    (train ? out.train : out.test).push_back(i);
  }
  return out;
}

std::vector<Split> folds_of(int count, int folds) {
  if (folds < 2 || folds > count)
    throw InputError(fmt::format(
        "--folds {}: expected 2 or more, and at most the number of recordings, {}", folds, count));
  std::vector<Split> out;
  for (int k = 0; k < folds; ++k) out.push_back(deal(count, 1.0 - 1.0 / folds, folds - 1 - k));
  return out;
}

Json& add_fold(const std::vector<Parameter>& parameters, const std::vector<std::string>& kept_back,
               const Fit& found, Report& report) {
  Json values = Json::object();
  std::string words;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    values[parameters[i].name] = found.parameters[i].value;
    words += fmt::format("{}{}={:.6g}", i == 0 ? "" : " ", parameters[i].name,
                         found.parameters[i].value);
  }
  Json& folds = report["folds"];
  folds.push_back({{"kept_back", kept_back}, {"values", values}});
  report.print("fold {}, without {}: {}\n", folds.size(),
               fmt::format("{}", fmt::join(kept_back, ", ")), words);
  return folds.back();
}

void fill_fold_parameters(const std::vector<Parameter>& parameters, Report& report) {
  const Json folds = report["folds"];  // a copy: new entries move those of a report
  if (folds.size() < 2) return;
  const auto count = static_cast<double>(folds.size());
  Json& list = report["fold_parameters"] = Json::array();
  report.print("mean and standard deviation of the parameters over {} folds\n", folds.size());
  for (const Parameter& p : parameters) {
    double mean = 0.0, squares = 0.0;
    for (const Json& fold : folds) mean += fold["values"][p.name].get<double>() / count;
    for (const Json& fold : folds)
      squares += std::pow(fold["values"][p.name].get<double>() - mean, 2);
    const double deviation = std::sqrt(squares / (count - 1.0));
    list.push_back({{"name", p.name}, {"unit", p.unit}, {"mean", mean}, {"deviation", deviation}});
    report.print("  {:<22} {:>11.6g} {:>11.3g} {}\n", p.name, mean, deviation, p.unit);
  }
}

}  // namespace counterpoint::apps
