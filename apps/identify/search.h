// The fits of `identify`, and their scores.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "identify/splits.h"
#include "input/scene_arguments.h"
#include "recordings/identify_report.h"
#include "tasks/task_arguments.h"

namespace counterpoint::apps {

struct IdentifyArguments {
  SceneArguments scene;
  std::vector<std::string> recordings, test;
  std::string map, parameters, output, page, loss = "cauchy", objective = "score";
  std::optional<int> substeps;
  std::optional<double> train;
  std::string derivatives = "exact";
  int horizon = 0;
  std::optional<int> folds;
  bool swap = false, told_only = false;
  FitOptions fit;
  TorqueFitOptions torques;
  tasks::TaskArguments tasks;
  Report report;
};

/// A fit; `torques` has the rest of a fit of joint forces.
struct Found {
  Fit fit;
  TorqueFit torques;
};

/// The fits of a run, one after another, and their scores.
class IdentifySearch {
 public:
  /// All arguments must outlive this.
  IdentifySearch(IdentifyArguments& arguments, const Experiment& e,
                 const std::vector<Parameter>& parameters, tasks::World& world);

  /// Fits recordings. fold: names the fit among several; empty: the last fit of the run, which
  /// throws tasks::Incomplete for a share. The objectives torque and explain are for rank 0, in all
  /// others every rank takes part.
  Found find(const std::vector<int>& which, const std::string& fold = {});
  /// Fits each fold's other recordings and reports its scores. Returns false, on every rank, if a
  /// fit was stopped; the report then has the folds before it.
  bool find_folds(const std::vector<Split>& folds);
  /// Scores both parts of a split, as `train` and `test`; prints `train` only if `all`. Returns
  /// false if stopped.
  bool score(const Found& found, const Split& parts, bool all, Json& out);

  const VectorX& start() const { return start_; }
  /// Rollouts of the recordings scored last.
  const Rollouts& shown() const { return shown_; }
  /// Forces of the recordings scored last, with --objective torque.
  const std::vector<Chart>& charts() const { return charts_; }
  /// For each channel the largest force at rest in the recordings that were fitted.
  const VectorX& held() const { return held_; }

 private:
  Fit by_predictions(const std::vector<int>& which, const std::string& fold);
  Fit by_motions(const std::vector<int>& which);
  bool score_predictions(const Found& found, const std::vector<int>& which, Json& out);
  void score_torques_of(const Found& found, const std::vector<int>& which, Json& out);
  std::vector<const Recording*> chosen(const std::vector<int>& which) const;

  IdentifyArguments& arguments_;
  const Experiment& e_;
  const std::vector<Parameter>& parameters_;
  tasks::World& world_;
  VectorX start_;
  tasks::RunSeries series_;
  Rollouts shown_;
  std::vector<Chart> charts_;
  VectorX held_;
};

}  // namespace counterpoint::apps
