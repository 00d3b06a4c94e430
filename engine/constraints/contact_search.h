// Contact search of a step: margins within which bodies may touch, and the candidates within them.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "counterpoint/engine/constraints/constraint_set.h"

namespace counterpoint {

/// Largest factor by which an impact raises the speed of the fastest point of a body: the far end
/// of a rod hit at one end, by conservation of kinetic energy, since the end of a rod carries a
/// quarter of its mass.
inline constexpr double kImpactSpeedUp = 2.0;

/// Finds the candidates for contact in a step, from the poses and velocities at its start. Holds
/// scratch memory: use one per thread.
class ContactSearch {
 public:
  /// inverse_mass: per body, as the contacts' compliance takes it (inverse_weights.h) [1/kg].
  ContactSearch(const Model& model, std::vector<double> inverse_mass);

  /// Finds the candidates of every pair that may touch within the step. Pairs so far apart that
  /// all their contacts would be parked are listed in `far` instead. Pairs of idle bodies are left
  /// out. The result is valid until the next search.
  std::vector<collision::Candidate>& find(const StepContext& at, const Kinematics& data,
                                          SleepMask idle, std::vector<FarPair>& far);
  /// Finds the candidates of one pair of geometries within the margins of the last find().
  std::vector<collision::Candidate>& find_pair(const StepContext& at, const Kinematics& data,
                                               const std::pair<int, int>& geometries);
  /// Forgets the last find(): no body is in reach of a fast one.
  void forget();

  /// Per tree: a fast body may reach it this step, so contacts were searched out to that body's
  /// travel.
  std::span<const char> in_reach_of_fast() const { return in_reach_; }
  /// Upper bound of the speed of a body's geometry [m/s].
  double fastest_point(int body) const { return fastest_point_[body]; }
  /// h^2 |w|^2 / 2 of a body: the displacement of a point by the rotation within the step differs
  /// from h w x arm by at most this fraction of |arm|, since |(exp(a) - 1 - a x) arm| <= |a|^2
  /// |arm| / 2.
  double turn_share(int body) const { return turn_share_[body]; }
  /// Radius [m] of each body's geometry about the body origin.
  const std::vector<double>& radii() const { return radius_; }
  double inverse_mass(int body) const { return inverse_mass_[body]; }  ///< [1/kg]
  const collision::Collider& collider() const { return collider_; }

 private:
  void set_margins(const StepContext& at, const Kinematics& data, SleepMask idle);
  bool spread_travel(const Model& model, std::span<const std::pair<int, int>> close,
                     double threshold, double own_threshold);
  FarPair locate(const Model& model, const std::pair<int, int>& pair,
                 const collision::Collider::Whereabouts& where, EffectSet effects,
                 const Kinematics& data) const;

  std::vector<double> inverse_mass_;
  collision::Collider collider_;
  std::vector<double> radius_;
  std::vector<double> travel_;  ///< upper bound of each body's surface travel within the step [m]
  std::vector<double> slack_;   ///< allowance for impacts and applied forces beyond travel_ [m]
  std::vector<double> margin_;  ///< travel_ + slack_ [m]
  std::vector<char> in_reach_;
  Eigen::ArrayXd turn_share_, fastest_point_;  ///< per body
  std::vector<collision::Candidate> candidates_;
};

/// Whether the options let contacts be parked: the midpoint rule solves for a velocity at other
/// poses than q.
bool parks_contacts(const SimulationOptions& options);

/// Whether contacts that stay open may be without rows.
bool may_deactivate_contacts(const SimulationOptions& options);

/// Returns the material of a pair with the coefficients of inactive effects set to zero.
Material active_material(Material pair, EffectSet effects);

}  // namespace counterpoint
