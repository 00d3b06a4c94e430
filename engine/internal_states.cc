// Internal states of recorded motions, by the inverse of their steps.
#include <utility>

#include "counterpoint/engine/step.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint {

void find_internal_states(const Model& model, const SimulationOptions& options,
                          const std::vector<double>& lengths, Trajectory& trajectory) {
  if (model.nz() == 0 || trajectory.z.cols() > 0) return;
  SimulationOptions of_step = options;
  Workspace workspace(model);
  Inverse inverse;
  Input known;
  MatrixX z = model.default_z().replicate(1, trajectory.num_rows());
  for (int k = 0; k < trajectory.num_steps(); ++k) {
    of_step.time_step = lengths[static_cast<size_t>(k)];
    trajectory.set_known(model, k, known);
    known.z = z.col(k);
    step_inverse(model, of_step, trajectory.q.col(k), trajectory.v.col(k), trajectory.q.col(k + 1),
                 trajectory.v.col(k + 1), known, workspace, inverse);
    z.col(k + 1) = inverse.fault.any() ? z.col(k) : inverse.z_next;
  }
  trajectory.z = std::move(z);
}

}  // namespace counterpoint
