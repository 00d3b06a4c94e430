// How a contact's place, normal and gap follow the motion of the two shapes.
#pragma once

#include <array>
#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// By six numbers each (angular, linear).
struct PlaceMotion {
  Eigen::Matrix<double, 3, 6> point, normal;
  Eigen::Matrix<double, 1, 6> gap;

  void set_zero();
};

/// By a displacement (angular [rad], linear [m], in W, of the point at the contact) of body B
/// against A. When both move alike the contact is carried along, and its gap stays.
struct ContactMotion : PlaceMotion {
  /// Where the contact is one that the motion leads to: by the velocities at the start of the step
  /// of A and B, at the contact, seen from A as it moves. Else not set.
  bool by_v = false;
  PlaceMotion v_a, v_b;
};

/// Scratch of one thread: contacts of a pair of shapes are asked for one after the other.
class ContactMotionFinder {
 public:
  /// Of other poses than the last time.
  void begin() { geometry_a_ = geometry_b_ = -1; }

  /// Of a contact as ConstraintFinder makes it, of candidates that `collider` found last, with
  /// these motions: towards_b is the share of the gap by which the place was moved from the middle
  /// towards B. In closed form for spheres, capsules, boxes and meshes on planes and on the faces
  /// of terrain, and for spheres and capsules among one another and on its edges; else by central
  /// differences of the two shapes' contacts in their relative pose, at that which the motion leads
  /// to where they were taken there (pair_motion.h). False if a neighbouring pose has no such
  /// contact.
  bool find(const Model& model, const Kinematics& data, const collision::Collider& collider,
            const collision::BodyMotions& motions, const collision::Candidate& contact,
            double towards_b, ContactMotion& out);  // Parameters: what it depends on, one by one

 private:
  /// Two shapes, one of which stays; neighbouring poses of the other.
  struct Pair {
    const Shape* a = nullptr;
    const Shape* b = nullptr;
    Pose X_WA, X_WB;
    double size = 0.0;  ///< of what gives the scale of the differences [m]
  };
  /// A contact, and where it was before it was moved towards B.
  struct Contact {
    const collision::Candidate& candidate;
    Vector3 middle;
    double towards_b;
  };

  bool touch(const Pair& pair, const Contact& contact, bool keep, ContactMotion& out);
  bool touch_stand_ins(const Pair& pair, const Contact& contact, ContactMotion& out);
  int index_ahead(const Pair& pair, const Pair& after, const Contact& contact,
                  const collision::PairMotion& motion);
  /// Parameters: what it depends on, one by one.
  bool touch_ahead(const Pair& pair, const Contact& contact, const collision::PairMotion& motion,
                   const Motion& V_a, const Motion& V_b, double h, ContactMotion& out);
  bool touch_terrain(const Pair& pair, const Contact& contact, ContactMotion& out);
  bool touch_face(const Pair& pair, const Contact& contact, int triangle, ContactMotion& out);
  bool touch_edge(const Pair& pair, const Contact& contact, int triangle, int edge,
                  ContactMotion& out);

  int index_here(const Pair& pair, const Contact& contact) const;
  void move_pair(const Pair& pair, const Vector3& about, double gap);
  bool difference(const Pair& pair, int index, PlaceMotion& out) const;

  int geometry_a_ = -1, geometry_b_ = -1;  ///< of what is below
  bool ahead_ = false;                     ///< it is where the motion leads
  Vector3 about_ = Vector3::Zero();        ///< what B was turned about
  double step_ = 0.0;                      ///< [m]
  collision::Manifold here_;
  std::array<std::array<collision::Manifold, 2>, 6> moved_;
  std::vector<int> triangles_;
};

}  // namespace counterpoint
