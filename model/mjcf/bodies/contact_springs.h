// Contacts that yield like springs: solref in its negative form.
#pragma once

#include <optional>
#include <vector>

#include "counterpoint/model/mjcf/bodies/bodies.h"
#include "counterpoint/model/mjcf/bodies/reference_model.h"
#include "counterpoint/model/mjcf/document/switches.h"

namespace counterpoint::mjcf {

/// Returns the parameters of a contact of two geoms with the same priority: the larger condim and
/// friction, solref and solimp by solmix.
ContactParameters combined(const ContactParameters& a, const ContactParameters& b);

/// Springs and dampers with the force of MuJoCo's contacts at a given depth and speed, where the
/// depth is at least the width of solimp and the contact does not accelerate.
class ContactSprings {
 public:
  ContactSprings(const Bodies& bodies, const Switches& switches, const MjcfModel& model)
      : bodies_(bodies), switches_(switches), model_(model), known_(bodies.bodies.size(), -1.0) {}

  /// Returns the surface of a pair of bodies (indices into Bodies::bodies). It is hard if solref is
  /// not in its negative form, or from kHardStiffness on.
  Material between(int body_a, int body_b, const ContactParameters& contact);

 private:
  double inverse_mass_of(int body);  ///< [1/kg], 0 where it is fixed to the world

  const Bodies& bodies_;
  const Switches& switches_;
  const MjcfModel& model_;
  std::optional<InverseMasses> inverse_masses_;
  std::vector<double> known_;  ///< inverse mass of each body [1/kg]; negative: not computed yet
};

}  // namespace counterpoint::mjcf
