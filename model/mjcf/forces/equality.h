// <equality>: loop closures and coupled joints; <tendon>: linear functions of joints.
#pragma once

#include <map>
#include <string>

#include "counterpoint/model/mjcf/bodies/bodies.h"
#include "counterpoint/model/mjcf/forces/couplings.h"

namespace counterpoint::mjcf {

/// A fixed tendon is a sum of joint coordinates, a spatial one a path.
struct TendonElement {
  const Element* element = nullptr;
  std::string name;
  bool fixed = true;
  Couplings::Sum sum;
  double reference = 0.0;  ///< length in the reference pose
  TendonSpec spec;         ///< without forces
};
using Tendons = std::map<std::string, TendonElement>;

/// Reads the tendons without their springs, dampers, friction and limits.
Tendons read_tendons(Document& document, const Bodies& bodies, const MjcfModel& model);

void read_equalities(Document& document, const Defaults& defaults, const Bodies& bodies,
                     const Tendons& tendons, Couplings& couplings, MjcfModel& model);

/// Adds the springs, dampers, friction and limits of each tendon to the single joint that it acts
/// on; adds the others to model.tendons. Call after read_equalities.
void apply_tendon_forces(Document& document, const Defaults& defaults, const Tendons& tendons,
                         const Couplings& couplings, MjcfModel& model);

/// Index into Bodies::joints of a joint with one coordinate. @throws InputError naming `user` if
/// there is none.
int find_scalar_joint(const Document& document, const Bodies& bodies, const MjcfModel& model,
                      const Element& user, const std::string& name);

}  // namespace counterpoint::mjcf
