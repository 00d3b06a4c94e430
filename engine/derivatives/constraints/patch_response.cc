#include "counterpoint/engine/derivatives/constraints/patch_response.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/inverse.h"

namespace counterpoint {
namespace {

/// Relative step of the differences: share of the gap at which a contact leaves the patch, and of
/// the speed of the patch (at least ContactPatch::at_rest).
constexpr double kStep = 3e-4;

/// Strength and friction point of a contact (PairConstraint): 1 + 3 numbers.
using Figures = Eigen::Vector4d;
using Slopes = Eigen::Matrix<double, 4, 6>;

/// A direction of differentiation: displacement `moved` of B relative to A, and change of the
/// velocity at the start, both at a place.
struct Direction {
  Vector6 moved = Vector6::Zero();
  Motion speed;                              ///< at the place
  PlaceMotion ContactMotion::*by = nullptr;  ///< set: `moved` is a change of a body's velocity
};

class PatchSlopes {
 public:
  PatchSlopes(const MovingPatch& moving, int index, const Vector3& place)
      : moving_(moving), index_(index), place_(place) {
    const ContactPatch& patch = moving.patch;
    for (int k = 0; k < patch.size; ++k) size_ = std::max(size_, (patch.place[k] - place).norm());
    const Vector3 across = patch.motion.at(place);
    speed_ = std::max(patch.at_rest, std::max(across.norm(), size_ * patch.motion.angular.norm()));
  }

  /// Differentiates by six motions; make(d) is the Direction of d (angular, linear).
  template <class Make>
  Slopes by(double step, Make make) const {
    Slopes out;
    for (int k = 0; k < 6; ++k) {
      const double h = k < 3 ? step / size_ : step;
      Vector6 unit = Vector6::Zero();
      unit[k] = h;
      out.col(k) = (at(make(unit)) - at(make(Vector6(-unit)))) / (2.0 * h);
    }
    return out;
  }
  double place_step() const { return kStep * moving_.patch.reach; }
  double speed_step() const { return kStep * speed_; }

 private:
  Figures at(const Direction& d) const {
    ContactPatch patch = moving_.patch;
    for (int k = 0; k < patch.size; ++k) {
      const ContactMotion& motion = moving_.motions[k];
      const PlaceMotion& by = d.by == nullptr ? motion : motion.*d.by;
      Vector6 moved = d.moved;  // at this contact's place
      moved.tail<3>() += moved.head<3>().cross(patch.place[k] - place_);
      patch.place[k] += by.point * moved;
      patch.gap[k] += (by.gap * moved).value();
      if (k == 0) patch.normal = (patch.normal + by.normal * moved).normalized();
    }
    patch.motion.angular += d.speed.angular;
    patch.motion.linear += d.speed.at(-place_);
    PatchFriction friction;
    Figures out(1.0, 0.0, 0.0, 0.0);
    if (!find_friction(patch, friction)) return out;
    out << friction.strength[index_], friction.friction_point[index_];
    return out;
  }

  const MovingPatch& moving_;
  int index_;
  Vector3 place_;
  double size_ = 0.0, speed_ = 0.0;  ///< [m, m/s]
};

/// Derivatives of the wrench by the strength and by the point where friction acts.
Eigen::Matrix<double, 6, 4> by_figures(const PairConstraint& pair, const PairBodies& bodies) {
  const ContactRows at(pair, bodies);
  Eigen::Matrix<double, 6, 4> out;
  const contact::Sensitivity law = contact::compute_sensitivity(pair.law, at.y);
  contact::Rows by_strength = contact::Rows::Zero(pair.law.rows);
  for (int k = 0; k < 2; ++k)
    by_strength += pair.law.friction[static_cast<size_t>(k)] / pair.strength * law.friction.col(k);
  out.col(0) = at.R * by_strength;
  const Vector3 omega = bodies.next_b.angular - bodies.next_a.angular;
  const contact::Rows f = contact::impulse(pair.law, at.y);
  const Vector3 friction = f[1] * pair.frame.col(1) + f[2] * pair.frame.col(2);
  for (int k = 0; k < 3; ++k) {
    const Vector3 v = omega.cross(Vector3::Unit(k));
    contact::Rows dy = contact::Rows::Zero(pair.law.rows);
    for (int i = 1; i < 3; ++i) dy[i] = pair.frame.col(i).dot(v);
    out.col(1 + k) = at.R * (law.velocity * dy);
    out.col(1 + k).head<3>() += Vector3::Unit(k).cross(friction);
  }
  return out;
}

}  // namespace

void add_patch_response(const MovingPatch& moving, int index, const PairConstraint& pair,
                        const PairBodies& bodies, PairResponse& out) {
  const PatchSlopes slopes(moving, index, pair.position);
  const Eigen::Matrix<double, 6, 4> W = by_figures(pair, bodies);
  const Matrix3 across = skew(Vector3(pair.frame.col(0)));
  // The contact's own response already turns friction with the normal.
  const auto less_turned = [&](Slopes by, const PlaceMotion& motion) {
    by.bottomRows<3>() += skew(pair.friction_point) * across * motion.normal;
    return by;
  };
  const ContactMotion& own = moving.motions[index];
  const auto displaced = [](const Vector6& d) { return Direction{d, {}, nullptr}; };
  out.still += W * less_turned(slopes.by(slopes.place_step(), displaced), own);
  const auto faster = [](const Vector6& d) {
    return Direction{Vector6::Zero(), {d.head<3>(), d.tail<3>()}, nullptr};
  };
  const Matrix6 by_speed = W * slopes.by(slopes.speed_step(), faster);
  out.v_b += by_speed;
  out.v_a -= by_speed;
  out.by_v = true;
  if (!own.by_v) return;
  const auto ahead = [&](PlaceMotion ContactMotion::*by) {
    const auto moved = [by](const Vector6& d) { return Direction{d, {}, by}; };
    return less_turned(slopes.by(slopes.place_step(), moved), own.*by);
  };
  out.v_a += W * ahead(&ContactMotion::v_a);
  out.v_b += W * ahead(&ContactMotion::v_b);
}

}  // namespace counterpoint
