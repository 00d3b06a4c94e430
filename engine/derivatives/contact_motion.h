// How a contact's place, normal and gap follow the motion of the two shapes.
#pragma once

#include "counterpoint/collision/candidate.h"
#include "counterpoint/engine/data.h"

namespace counterpoint {

/// By a displacement (angular [rad], linear [m], in W, of the point at the contact) of body B
/// against A. When both move alike the contact is carried along, and its gap stays.
struct ContactMotion {
  Eigen::Matrix<double, 3, 6> point, normal;
  Eigen::Matrix<double, 1, 6> gap;
};

/// Of a contact as ConstraintFinder makes it: towards_b is the share of the gap by which the place
/// was moved from the middle towards B. In closed form for spheres, capsules, boxes and meshes on
/// planes; else by central differences of the two shapes' contacts in their relative pose. False if
/// these contacts, as their poses alone tell, do not hold this one (pair_motion.h,
/// corner_contacts.h), or a neighbouring pose has no such contact.
bool find_contact_motion(const Model& model, const Data& data, const collision::Candidate& contact,
                         double towards_b, ContactMotion& out);

}  // namespace counterpoint
