// Forces that springs, dampers, servos and actuators of an MJCF file have here and in MuJoCo, at
// one state under the same controls.
#pragma once

#include <random>
#include <vector>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/scene.h"

struct mjModel_;
struct mjData_;

namespace counterpoint::apps {

/// Length of the step [s] in which forces are taken: laws see it as an instant.
inline constexpr double kInstant = 1e-12;

/// The largest differences of a list of quantities, each relative to its largest size at any state.
class Differences {
 public:
  void add(std::size_t quantity, double ours, double theirs);
  double worst() const;

 private:
  struct Range {
    double difference = 0.0, size = 0.0;
  };
  std::vector<Range> ranges_;
};

/// Coordinates that follow others by `equality`, in terms of those that follow none.
class Followers {
 public:
  explicit Followers(const Model& model);
  /// Sets the coordinates q (nq) and velocities v (nv) of followers.
  void place(VectorX& q, VectorX& v) const;
  /// Moves generalized forces (nv) on followers to the coordinates that they follow.
  void reduce(VectorX& force) const;

 private:
  const Model& model_;
  std::vector<Mimic> order_;  ///< masters before their followers
};

/// A place where both engines have a coordinate: ours, MuJoCo's.
struct Place {
  int ours = 0, theirs = 0;
};

/// Draws controls and activations of all actuators, and compares forces. MuJoCo's model has the
/// time step kInstant.
class ForceComparison {
 public:
  ForceComparison(const MjcfModel& read, const Model& model, const mjModel_& m,
                  const std::vector<Place>& velocities);

  /// Whether both have the same actuators in the same order.
  bool same_actuators() const;
  /// Draws controls within their ranges, and activations. Every other time those of servos are such
  /// that their forces at q, v are within their limits.
  void draw(const VectorX& q, const VectorX& v, std::mt19937_64& random, mjData_& d);
  /// Compares at the state of the last draw, after mj_forward.
  void compare(const Dynamics& dynamics, const mjData_& d);

  /// Generalized forces of springs, dampers, servos and actuators; those on followers act on the
  /// coordinates that they follow.
  Differences joints;
  Differences actuators;  ///< forces of actuators with a command of their own

 private:
  void hold_within_limits(std::size_t i, const VectorX& q, const VectorX& v,
                          std::mt19937_64& random, mjData_& d) const;
  void activate(std::size_t i, std::mt19937_64& random, mjData_& d);
  VectorX forces_of_joints() const;
  VectorX forces_of_tendons(const Dynamics& dynamics) const;
  VectorX forces_of_actuators(const Dynamics& dynamics, const mjData_& d);

  const MjcfModel& read_;
  const Model& model_;
  const mjModel_& m_;
  const std::vector<Place>& velocities_;
  Followers followers_;
  SimulationOptions options_;
  int draws_ = 0;
  VectorX q_, v_, z_, controls_;
};

}  // namespace counterpoint::apps
