// Forces behind a recorded motion, and how much of them no contact can have given.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "coordinate_figures.h"
#include "counterpoint/engine/derivatives.h"
#include "counterpoint/model/scene.h"
#include "recording.h"

namespace counterpoint::apps {

/// What is at work from one row to the next.
struct Explanation {
  /// nv: what moved the scene beyond gravity, joints' own forces, recorded forces and contacts, per
  /// coordinate [N, N m]: of actuated coordinates whose force was not recorded their applied force,
  /// of all others unexplained.
  VectorX force;
  double unexplained_force = 0.0;   ///< of free links, over the weight of their trees
  double unexplained_torque = 0.0;  ///< the same, over weight times reach of the link's geometry
  double unexplained_joint = 0.0;   ///< largest where a force was recorded [N or N m]
  double contact_force = 0.0;       ///< sum of the normal forces over the weight of all that moves
  int contacts = 0;                 ///< within reach
};

/// Finds them step by step. Recorded motions are no solutions of a contact law: a velocity that is
/// off by a millimetre a second would be a blow. So contact forces are those within the friction
/// cones at all contacts within `reach` [m] that leave least unexplained (in the norm of inv(M)).
class Explainer {
 public:
  Explainer(const Scene& scene, const ColumnMap& map, double reach);
  ~Explainer();

  /// From `row` to `row` + 1 of the recording, `interval` [s] apart. @throws InputError where a
  /// recorded number cannot be worked with, std::runtime_error where the solver fails.
  Explanation explain(const Recording& recording, int row, double interval);

  /// nv x parameters: how `force` of the step explained last goes with them. False where contacts
  /// gave a part of it: which then depends on the cones.
  bool derive(ParameterDerivator& derivator, InverseParameterDerivatives& out);

  /// By coordinate, what makes an unexplained force a residual: of free links 1 / weight (and /
  /// reach of the geometry), of others 1; 0 where a motor may have given it.
  VectorX scales() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A whole recording.
struct ExplainedRecording {
  std::string file;
  int rows = 0;
  std::vector<double> time;  ///< of the rows where steps start [s]
  std::vector<Explanation> steps;
  std::vector<std::pair<const char*, double>> figures;  ///< under their names in the report
  bool stopped = false;
};
/// stop: asked at every row; where it says so, the result is marked and has no figures.
ExplainedRecording explain_recording(Explainer& explainer, const ColumnMap& map,
                                     const Recording& recording,
                                     const std::function<bool()>& stop = {});

/// What is left unexplained by coordinate over all steps of some recordings, but for those that a
/// motor may have moved with a force that was not recorded.
std::vector<CoordinateFigures> force_figures(const Explainer& explainer, const Model& model,
                                             const std::vector<const Recording*>& recordings,
                                             const std::vector<ExplainedRecording>& explained);

}  // namespace counterpoint::apps
