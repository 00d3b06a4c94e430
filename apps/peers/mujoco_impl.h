// What a Mujoco holds: the scene as it is in MuJoCo. Compiled in mujoco_build.cc, stepped and read
// in mujoco.cc.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <string>
#include <vector>

#include "counterpoint/engine/step.h"
#include "mujoco.h"

namespace counterpoint::peers {

/// Into three numbers of MuJoCo's (mjtNum).
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

  /// Compiles with room for max_contacts.
  void build();

  /// MuJoCo tries a step when it compiles, and that may take more stack than was guessed.
  mjModel_* compile_with_room();
  static bool lacks_stack(const std::string& message);

  /// Room for what a step needs, as MuJoCo's own guess of the stack does not fit large scenes.
  std::string size_element() const;
  void number_alike();

  /// What MJCF would take from the start: the second anchors, and the lengths of rods.
  void set_closures();

  /// Linear drag of a free body about its origin is damping of its joint.
  void set_drag();
  void set_state(const State& to);
  void read_state();
  void apply(const Input& input);

  /// How often MuJoCo warned of this since the last reset.
  bool warned(std::initializer_list<int> kinds) const;
  std::string try_step(const Input& input);

  /// Did the step lack room that more memory gives? Asks for twice as much then.
  bool needs_room(const std::string& failure);
  MujocoStep step(const Input& input);
  std::string run(long count);
  int iterations() const;
  void read_forces();
  void read_closure_forces();

  /// In W, at the start of the step.
  Vector3 anchor(int body, const Pose& X_BC) const;

  /// Everything of the state as it is now that does not touch contacts and their forces.
  void look();

  Model model;
  EffectSet on;
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
  std::vector<int> geometry_of, closure_of;  ///< by MuJoCo's index: ours
};

}  // namespace counterpoint::peers
