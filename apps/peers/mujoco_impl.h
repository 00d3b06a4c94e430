// Implementation of Mujoco: the scene as a MuJoCo model. Compiled in mujoco_build.cc, stepped and
// read in mujoco.cc.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <string>
#include <vector>

#include "counterpoint/engine/step.h"
#include "mujoco.h"

namespace counterpoint::peers {

/// Copies a vector into three numbers of MuJoCo (mjtNum).
template <typename Number>
void set_numbers(const Vector3& v, Number* out) {
  std::copy(v.data(), v.data() + 3, out);
}

struct Mujoco::Impl {
  Impl(const Scene& scene, MujocoSettings settings);
  ~Impl() { clear(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void clear();

  /// Compiles the model with room for max_contacts contacts.
  void build();

  /// Sets the time step of the scene [s], and the softness, which depends on it.
  void set_time_step(double h);

  /// Compiles the model; doubles the stack until MuJoCo's trial step during compilation fits.
  mjModel_* compile_with_room();
  static bool lacks_stack(const std::string& message);

  /// Size of arena or stack for a step, because MuJoCo's own estimate is too small for large
  /// scenes.
  std::string size_element() const;
  void number_alike();

  /// Sets the second anchors and the lengths of rods, which MJCF would derive from the start pose.
  void set_closures();
  void set_servos();

  /// Sets the linear drag of free bodies about their origin, as damping of their joint.
  void set_drag();
  void set_state(const State& to);
  void read_state();
  void apply(const Input& input);

  /// True if MuJoCo gave one of these warnings since the last reset.
  bool warned(std::initializer_list<int> kinds) const;
  std::string try_steps(const Input& input, long count);

  /// True if the step failed for lack of memory; then the size for the next build is doubled.
  bool needs_room(const std::string& failure);
  MujocoStep step(const Input& input);
  std::string run(long count);
  int iterations() const;
  void read_forces();
  void read_closure_forces();

  /// Anchor of a closure in W, at the start of the step.
  Vector3 anchor(int body, const Pose& X_BC) const;

  /// Computes kinematics, velocities and inertias of the current state, without contacts and their
  /// forces.
  void look();

  Model model;
  EffectSet on;
  MujocoSettings chosen;
  std::string document;
  std::size_t body_of_line = 0;
  int max_contacts = 0;
  double stack_factor = 1.0;
  double time_step = 0.0;
  mjModel_* m = nullptr;
  mjData_* d = nullptr;
  State state;
  bool forces_read = true;
  std::vector<ContactForce> contacts;
  std::vector<ClosureForce> closures;
  std::vector<int> geometry_of, closure_of;  ///< our index by MuJoCo's index
};

}  // namespace counterpoint::peers
