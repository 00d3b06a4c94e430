// Derivatives of a contact's place, normal and gap by the motion of the two shapes.
#pragma once

#include <array>
#include <vector>

#include "counterpoint/collision/collider.h"
#include "counterpoint/collision/pairs/pair_contacts.h"
#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Derivatives by the six components (angular, linear) of a motion.
struct PlaceMotion {
  Eigen::Matrix<double, 3, 6> point, normal;
  Eigen::Matrix<double, 1, 6> gap;

  void set_zero();
};

/// Derivatives by a displacement (angular [rad], linear [m], in W, of the point at the contact) of
/// body B relative to A. If both move alike the contact is carried along, and its gap stays.
struct ContactMotion : PlaceMotion {
  /// True for contacts taken at the end of the step's motion (pair_motion.h). v_a, v_b are then the
  /// derivatives by the velocities of A and B at the start of the step, at the contact, in axes
  /// that move with A; else they are not set.
  bool by_v = false;
  PlaceMotion v_a, v_b;
};

/// Finds derivatives of contacts. Scratch memory inside: one object per thread. Contacts of one
/// pair of shapes share their differences if they are asked for one after the other.
class ContactMotionFinder {
 public:
  /// Forgets the last pair; call it when poses have changed.
  void begin() { geometry_a_ = geometry_b_ = -1; }

  /// Finds the derivatives of a contact as ConstraintFinder makes it, from the candidates that
  /// `collider` found last, with these motions. towards_b: share of the gap by which the place was
  /// moved from the middle towards B. Closed forms: spheres, capsules, boxes and meshes on planes
  /// and on faces of terrain; spheres and capsules among one another and on edges of terrain. All
  /// others: central differences of the two shapes' contacts in their relative pose, which is the
  /// one after the motion for contacts taken there (pair_motion.h). Returns false if a neighbouring
  /// pose has no such contact.
  bool find(const Model& model, const Kinematics& data, const collision::Collider& collider,
            const collision::BodyMotions& motions, const collision::Candidate& contact,
            double towards_b, ContactMotion& out);

 private:
  /// Two shapes. Differences move B and keep A.
  struct Pair {
    const Shape* a = nullptr;
    const Shape* b = nullptr;
    Pose X_WA, X_WB;
    double size = 0.0;  ///< length that scales the differences [m]
  };
  /// A contact, and its place before it was moved towards B.
  struct Contact {
    const collision::Candidate& candidate;
    Vector3 middle;
    double towards_b;
  };

  bool touch(const Pair& pair, const Contact& contact, bool keep, ContactMotion& out);
  bool touch_stand_ins(const Pair& pair, const Contact& contact, ContactMotion& out);
  int index_ahead(const Pair& pair, const Pair& after, const Contact& contact,
                  const collision::PairMotion& motion);
  bool touch_ahead(const Pair& pair, const Contact& contact, const collision::PairMotion& motion,
                   const Motion& V_a, const Motion& V_b, double h, ContactMotion& out);
  bool touch_terrain(const Pair& pair, const Contact& contact, ContactMotion& out);
  bool touch_face(const Pair& pair, const Contact& contact, int triangle, ContactMotion& out);
  bool touch_edge(const Pair& pair, const Contact& contact, int triangle, int edge,
                  ContactMotion& out);

  int index_here(const Pair& pair, const Contact& contact) const;
  void move_pair(const Pair& pair, const Vector3& about, double gap);
  bool difference(const Pair& pair, int index, PlaceMotion& out) const;

  int geometry_a_ = -1, geometry_b_ = -1;  ///< pair of the contacts in here_ and moved_, or -1
  bool ahead_ = false;                     ///< their poses are those after the motion
  Vector3 about_ = Vector3::Zero();        ///< point about which B was rotated, in W [m]
  double step_ = 0.0;                      ///< difference step [m]
  collision::Manifold here_;
  std::array<std::array<collision::Manifold, 2>, 6> moved_;
  std::vector<int> triangles_;
};

}  // namespace counterpoint
