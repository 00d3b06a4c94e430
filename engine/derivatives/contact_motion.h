// How a contact's place, normal and gap follow the motion of the two shapes.
#pragma once

#include <array>

#include "counterpoint/collision/candidate.h"
#include "counterpoint/collision/pair_contacts.h"
#include "counterpoint/engine/data.h"

namespace counterpoint {

/// By a displacement (angular [rad], linear [m], in W, of the point at the contact) of body B
/// against A. When both move alike the contact is carried along, and its gap stays.
struct ContactMotion {
  Eigen::Matrix<double, 3, 6> point, normal;
  Eigen::Matrix<double, 1, 6> gap;
};

/// Scratch of one thread: contacts of a pair of shapes are asked for one after the other.
class ContactMotionFinder {
 public:
  /// Of other poses than the last time.
  void begin() { geometry_a_ = geometry_b_ = -1; }

  /// Of a contact as ConstraintFinder makes it: towards_b is the share of the gap by which the
  /// place was moved from the middle towards B. In closed form for spheres, capsules, boxes and
  /// meshes on planes, and for spheres and capsules among one another; else by central differences
  /// of the two shapes' contacts in their relative pose. False if these contacts, as their poses
  /// alone tell, do not hold this one (pair_motion.h), or a neighbouring pose has no such contact.
  bool find(const Model& model, const Data& data, const collision::Candidate& contact,
            double towards_b, ContactMotion& out);

 private:
  /// Two shapes, one of which stays; neighbouring poses of the other.
  struct Pair {
    const Shape* a = nullptr;
    const Shape* b = nullptr;
    Pose X_WA, X_WB;
    double size = 0.0;  ///< [m]
  };
  int index_here(const Pair& pair, const collision::Candidate& contact,
                 const Vector3& middle) const;
  void move_pair(const Pair& pair, const collision::Candidate& contact);
  bool difference(const Pair& pair, const collision::Candidate& contact, int index,
                  double towards_b, ContactMotion& out);
  bool difference_balls(const Pair& pair, const collision::Candidate& contact, double towards_b,
                        ContactMotion& out);

  int geometry_a_ = -1, geometry_b_ = -1;  ///< of what is below
  Vector3 about_ = Vector3::Zero();        ///< what B was turned about
  double step_ = 0.0;                      ///< [m]
  collision::Manifold here_;
  std::array<std::array<collision::Manifold, 2>, 6> moved_;
};

}  // namespace counterpoint
