// <equality>: closures and coupled joints; <tendon>: coupled joints.
#pragma once

#include <map>
#include <string>

#include "counterpoint/model/mjcf/bodies/bodies.h"
#include "counterpoint/model/mjcf/forces/couplings.h"

namespace counterpoint::mjcf {

struct Tendon {
  const Element* element = nullptr;
  bool fixed =
      true;  ///< a sum of joint coordinates; else a path through space, of which nothing is known
  Couplings::Sum sum;
  double reference = 0.0;  ///< its length in the reference pose
};
using Tendons = std::map<std::string, Tendon>;

/// The tendons that there are, without what acts in them.
Tendons read_tendons(Document& document, const Bodies& bodies);

void read_equalities(Document& document, const Defaults& defaults, const Bodies& bodies,
                     const Tendons& tendons, Couplings& couplings, MjcfModel& model);

/// Springs, dampers, friction and limits of tendons go to the one joint that they pull at; others
/// are refused. After the equalities.
void apply_tendon_forces(Document& document, const Defaults& defaults, const Tendons& tendons,
                         const Couplings& couplings, MjcfModel& model);

/// The index into Bodies::joints of a joint of one coordinate. @throws InputError naming `user`.
int find_scalar_joint(const Document& document, const Bodies& bodies, const MjcfModel& model,
                      const Element& user, const std::string& name);

}  // namespace counterpoint::mjcf
