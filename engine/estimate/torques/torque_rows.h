// Recorded joint forces and those of inverse dynamics, with derivatives, after the same low-pass
// filter.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/torque_fit.h"

namespace counterpoint::estimation {

/// Properties of a recorded force: recorded(t) = gain modelled(t - delay) + offset.
struct ChannelValues {
  double offset = 0.0, gain = 1.0;
  double delay = 0.0;  ///< [s]
};

/// Rows of one channel. Modelled forces are those at the delay of ChannelValues, before its gain
/// and offset.
struct ChannelRows {
  int coordinate = 0;  ///< index into v
  VectorX recorded, modelled;
  VectorX slope;               ///< derivative of `modelled` by the delay [N/s, N m/s]
  MatrixX derivatives;         ///< rows x step parameters: derivatives of `modelled`
  std::vector<char> rests;     ///< 1: the joint is slower than rest_speed
  std::vector<int> recording;  ///< index of the recording
};

/// Options of steps of h [s] in which only gravity and the joints' springs and friction act beside
/// the applied forces: these are those of the motors, and a recorded motion may pass the limits of
/// the model.
SimulationOptions free_steps(SimulationOptions options, double h);

/// Coordinates whose force is recorded.
std::vector<int> recorded_forces(const ColumnMap& map);

/// The parts of the task that all passes over the recordings share.
struct TorqueTask {
  const ColumnMap& map;
  const std::vector<const Recording*>& recordings;
  const TorqueFitOptions& options;
  double longest_delay = 0.0;  ///< [s]
};

/// @throws InputError as fit_torques, for the model and the recordings
void check_torques(const Scene& scene, const TorqueTask& task);

/// Computes the rows of all channels. channels: values by channel. Returns fewer rows if
/// options.stop ends it.
std::vector<ChannelRows> torque_rows(const Scene& scene, const TorqueTask& task,
                                     const std::vector<StepParameter>& parameters,
                                     const std::vector<ChannelValues>& channels);

}  // namespace counterpoint::estimation
