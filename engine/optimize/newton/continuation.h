// Continuation of an optimization from large to small smoothing.
#pragma once

#include "counterpoint/engine/optimize/newton/newton.h"
#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

class Continuing {
 public:
  Continuing(const Problem& problem, const std::vector<VectorX>& start, const Settings& settings);
  Result run();

 private:
  enum class Next { kGoOn, kStop };
  Outcome go();
  Next minimize(double tolerance, int most_steps);
  Next run_stage(bool last);
  Next polish();
  Next restore(double tolerance);
  void begin_stage();
  void extrapolate(const Variables& last);
  bool has_got_worse(const Spread& found, double objective) const;
  void settle_ends();
  double objective() const;
  Result result(Outcome outcome) const;

  const Problem* problem_;
  const Settings* settings_;
  Newton newton_;
  Stage stage_;
  Workspace workspace_;
  double start_seconds_;
  double smoothing_ = 0.0, last_good_ = 0.0, last_mean_ = 0.0, last_objective_ = 0.0, factor_;
  int stages_ = 0, refused_ = 0, refused_in_row_ = 0, stage_iterations_ = 0;
  bool stopped_ = false;
  Variables previous_;               ///< at the end of the accepted stage before the last one
  double previous_smoothing_ = 0.0;  ///< [m]
  std::vector<Progress> history_;
};

}  // namespace counterpoint::optimization
