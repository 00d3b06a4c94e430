// The bodies of a file in the reference pose, for what MuJoCo scales by their inertia there.
#pragma once

#include <vector>

#include "counterpoint/model/model.h"
#include "counterpoint/model/robot_files.h"

namespace counterpoint::mjcf {

/// Returns the links and joints of a file without shapes and couplings; default_q is the reference
/// pose. @throws InputError naming the joint that moves no inertia.
Model reference_model(const MjcfModel& model);

/// Inverse masses in the reference pose with all joints free: body_invweight0 of MuJoCo.
class InverseMasses {
 public:
  explicit InverseMasses(const MjcfModel& file)
      : model_(reference_model(file)), trees_(model_.num_trees()) {}

  /// Returns the mean over directions of the acceleration of the centre of mass of a link that can
  /// move, per force there [1/kg].
  double of(const LinkSpec& link);

 private:
  struct TreeInertia {
    MatrixX mass, inverse;  ///< empty: not computed yet
  };
  Model model_;
  std::vector<TreeInertia> trees_;
};

}  // namespace counterpoint::mjcf
