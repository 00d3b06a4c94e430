// Muscles of MJCF files: <muscle>, and <general> with dyntype, gaintype and biastype "muscle".
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/model/mjcf/document/document.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint::mjcf {

/// The joint of one coordinate, or else the tendon, at which a muscle pulls. The length of the
/// muscle in MuJoCo is gear times the coordinate or the tendon's length, plus an offset.
struct MusclePath {
  const JointSpec* joint = nullptr;    ///< a joint of MjcfModel::robot
  const TendonSpec* tendon = nullptr;  ///< with its limits
  double gear = 1.0, offset = 0.0;
};

/// Returns the muscle of an element as MuJoCo makes it, for lengths without the offset. `levels`:
/// the elements of its default classes, the outermost first, and last itself. The lengths are those
/// of `lengthrange`; where it is missing, those of the limits of joint or tendon. A negative force
/// becomes scale / acc0, acc0 = |inv(M) J'| of a joint in the reference pose (call after
/// read_inertias). Returns nothing after a refusal: neither joint nor tendon, neither lengthrange
/// nor limits, a negative force on a tendon, different parameters of active and passive force.
/// @throws InputError naming the attribute for values out of range.
std::optional<Muscle> read_muscle(Document& document, const std::vector<const Element*>& levels,
                                  const MusclePath& path, const MjcfModel& model);

}  // namespace counterpoint::mjcf
