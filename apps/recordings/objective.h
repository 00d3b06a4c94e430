// Objectives of a fit: distances of predictions from recordings.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fit/fit.h"
#include "parameters.h"
#include "prediction.h"
#include "unexplained.h"

namespace counterpoint::apps {

/// The recordings to be explained, and how they are predicted.
struct Experiment {
  Scene scene;
  ColumnMap map;
  std::vector<Recording> recordings;
  int num_given = 0;  ///< the first of these, without those given to be scored
  PredictionOptions prediction;
  /// Residuals are the mean deviations of each recording, else deviations at every row.
  bool by_score = false;
  double reach = 0.01;  ///< of contacts, for forces [m]
};

/// Predictions of some of the recordings by a scene.
std::vector<Prediction> predict_all(const Experiment& experiment, const Scene& scene,
                                    const std::vector<int>& which);

/// What turns a difference of coordinates (nv) into lengths: 1 for lengths of what is compared, for
/// rotations of a free link the distance of its farthest point from its origin [m]; 1 for the
/// mapped coordinates where no link is free [rad or m]; 0 for all others.
VectorX deviation_weights(const Model& model, const ColumnMap& map);

/// Residuals of each recording at given values: by score the mean deviations; else at every row
/// predicted the difference of coordinates, over the root of the number of rows. Both weighted as
/// above; rows that a failed step left out count 1 m (1 rad). Of impacts the error of the
/// velocities after in the norm of M [m/s], by score its length.
GroupedResiduals prediction_residuals(const Experiment& experiment,
                                      const std::vector<Parameter>& parameters,
                                      const VectorX& values, const std::vector<int>& which);

/// Residuals of each recording at given values: at every step the force that is unexplained
/// (unexplained.h), of free links over weight (and reach), of others in N or N m, over the root of
/// the number of steps.
GroupedResiduals force_residuals(const Experiment& experiment,
                                 const std::vector<Parameter>& parameters, const VectorX& values,
                                 const std::vector<int>& which);

/// Row by row: the residual of a prediction at a row that `state` stands for is
/// share * weights * (state - recorded).
struct RowWeights {
  VectorX by_coordinate;  ///< nv (deviation_weights)
  std::vector<Eigen::Index> used;
  double turning = 1.0;  ///< [m] a radian of a free link
};
RowWeights row_weights(const Experiment& experiment);

/// The residual of one recording's prediction (prediction_residuals).
VectorX prediction_residual(const Experiment& experiment, const Model& model,
                            const Recording& recording, const Prediction& prediction,
                            const RowWeights& by_row);

/// What identification solves: residuals of some of the recordings as a function of the parameters,
/// which start where the scene has them. by_force: force_residuals, else prediction_residuals. All
/// arguments must outlive it.
FitProblem fit_problem(const Experiment& experiment, const std::vector<Parameter>& parameters,
                       const std::vector<int>& which, bool by_force);

/// What a scene leaves unexplained by coordinate, over some of the recordings.
std::vector<CoordinateFigures> unexplained_figures(const Experiment& experiment, const Scene& scene,
                                                   const std::vector<int>& which);

}  // namespace counterpoint::apps
