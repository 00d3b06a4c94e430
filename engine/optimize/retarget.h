// Retargeting: the motion of a man, of another robot or of an animation, given by kinematics alone,
// becomes a motion that a robot can do (docs/guide/retarget.md).
//
//   ProblemFile file = load_problem("walk.yaml", {}, {"recording.csv", "man.yaml"});
//   fit_motion(file);
//   Result result = optimize(file.problem, file.guess, file.settings);
//
// Step one fits the robot's configurations to the recorded ones or to places and orientations of
// the recorded links, joints (BVH) or markers, without forces. Step two is an ordinary problem
// whose terms follow the fit.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "counterpoint/engine/optimize/optimize.h"

namespace counterpoint::optimization {

/// Files of the motion to follow, in place of those that the problem file names; may be empty.
struct SourceFiles {
  std::filesystem::path motion;  ///< table with the coordinates of `scene`, or points, over time
  std::filesystem::path scene;   ///< scene of the coordinates
};

/// The key `retarget` of a problem file.
struct Retargeting {
  std::filesystem::path motion_file, scene_file;
  Problem fit;                         ///< terms of step one, without forces
  std::vector<std::size_t> followers;  ///< indices of the problem's terms with `target: fit`
};

/// Deviation of the fitted motion from what a group of terms wants.
struct FitError {
  std::string name;
  Quantity quantity = Quantity::kPosition;
  double rms = 0.0;  ///< over frames, terms of this name and weighted rows [m, rad]
};

struct Fit {
  std::vector<VectorX> q;  ///< frames 0 ... N
  int iterations = 0;      ///< Gauss-Newton steps
  std::vector<FitError> errors;
};

/// Loads a problem as load_problem (optimize.h) does, with the motion to follow from these files.
/// @throws InputError as that, and if the file has no key `retarget` while files are given.
ProblemFile load_problem(const std::filesystem::path& file, std::optional<int> steps,
                         const SourceFiles& source);

/// Fits frames to the motion to follow, and makes them the guess, the targets of terms with
/// `target: fit`, and start and speed at the start, if these are fixed. @throws InputError if the
/// file has no key `retarget`, or the fit does not converge.
Fit fit_motion(ProblemFile& file);

/// Root mean square [rad, m] over frames of the deviation of each coordinate (nv) between two
/// motions of the same length.
VectorX rms_deviation(const Model& model, const std::vector<VectorX>& from,
                      const std::vector<VectorX>& to);

}  // namespace counterpoint::optimization
