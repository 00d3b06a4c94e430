// Actuators: control inputs with a name, the law of their force, and the place where it acts.
//
//   command -> delay -> slew limit -> lag -> integral -> law -> joint, tendon, link, contacts
//
// With x = gear times the coordinate (or tendon length), y its rate, u the command after its
// filters, and the force F clamped to [least, most], which acts on the coordinate as gear F:
//
//   kAffine     F = gain u + bias - stiffness x - (damping + command_damping u) y
//   kPid        F = kp (u - x) + ki I + kd (du/dt - y),  dI/dt = u - x,  |ki I| <= integral_limit
//   kDcMotor    F = K i,  L di/dt + R i = u - K y,  |i| <= current_limit
//   kMuscle     F = -force of the muscle at activation a, length x, speed y; u excites it
//   kPropeller  F = gain w |w| with the rate w of a joint [rad/s]; no command
//
// Affine, PID and DC laws are implicit in y (backward Euler); the muscle's force is linear in y
// about the speed at the start of a step, and a propeller takes w there.
#pragma once

#include <limits>
#include <string>

#include "counterpoint/model/parts/muscle.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {

enum class ActuatorLaw : unsigned char { kAffine, kPid, kDcMotor, kMuscle, kPropeller };

/// The place where an actuator acts.
enum class Transmission : unsigned char {
  kJoint,     ///< a joint of one coordinate
  kTendon,    ///< the length of a tendon
  kLink,      ///< a wrench fixed to a link
  kAdhesion,  ///< attraction along the normals of a link's contacts, which share the force
};

/// An actuator. Units [N, m] are [N m, rad] where it acts on an angle.
struct Actuator {
  std::string name;  ///< unique
  Transmission transmission = Transmission::kJoint;
  int joint = -1;                   ///< kJoint, kPropeller: index into Model::joints
  int tendon = -1;                  ///< kTendon: index into Model::tendons
  int body = -1;                    ///< kLink, kAdhesion
  int frame = -1;                   ///< kLink, kAdhesion: the link, index into Model::frames
  Vector3 point = Vector3::Zero();  ///< kLink: where the force acts, in the body frame [m]
  /// kLink: force and torque per unit of F, in axes of the body, about `point` [-, m].
  Force direction;
  double reach = 0.0;  ///< kAdhesion: largest gap of a contact that attracts [m]
  double gear = 1.0;   ///< [-], or [rad/m]

  double command = 0.0;  ///< where an input gives none
  double least_command = -std::numeric_limits<double>::infinity();
  double most_command = std::numeric_limits<double>::infinity();
  double delay = 0.0;     ///< [s]
  int delay_samples = 0;  ///< commands kept, one each delay / delay_samples; 0: no delay
  double slew = std::numeric_limits<double>::infinity();  ///< largest rate of the command [1/s]
  double lag = 0.0;                                       ///< time constant, first order [s]
  /// The law takes the integral of the command behind its filters, within these bounds.
  bool integrates = false;
  double least_setpoint = -std::numeric_limits<double>::infinity();
  double most_setpoint = std::numeric_limits<double>::infinity();

  ActuatorLaw law = ActuatorLaw::kAffine;
  /// kAffine: [N per unit of the command], [N]; kPropeller: [N s^2/rad^2], unused.
  double gain = 1.0, bias = 0.0;
  double stiffness = 0.0, damping = 0.0;  ///< kAffine: [N/m], [N s/m], not negative
  double command_damping = 0.0;           ///< kAffine: damping per unit of u, u >= 0 [N s/m]
  double kp = 0.0, ki = 0.0, kd = 0.0;    ///< kPid: [N/m], [N/(m s)], [N s/m]
  double integral_limit = std::numeric_limits<double>::infinity();  ///< kPid [N]
  double torque_constant = 0.0;  ///< kDcMotor: K [N m/A] = [V s/rad]
  double resistance = 0.0;       ///< kDcMotor: R [Ohm]
  double inductance = 0.0;       ///< kDcMotor: L [H]
  double current_limit = std::numeric_limits<double>::infinity();  ///< kDcMotor [A]
  Muscle muscle;                                                   ///< kMuscle
  double least = -std::numeric_limits<double>::infinity();         ///< bounds of F [N]
  double most = std::numeric_limits<double>::infinity();

  int z_index = 0;  ///< first of its internal states (Model::nz)

  bool has_slew() const { return slew < std::numeric_limits<double>::infinity(); }
  /// Whether the law has an internal state: an integral, a current, an activation.
  bool has_law_state() const {
    return (law == ActuatorLaw::kPid && ki > 0.0) ||
           (law == ActuatorLaw::kDcMotor && inductance > 0.0) || law == ActuatorLaw::kMuscle;
  }
  bool keeps_setpoint() const { return has_slew() || (law == ActuatorLaw::kPid && kd > 0.0); }
  /// Returns the number of internal states: commands in the delay line, the next one out first, and
  /// the part of a sample's time that has passed; the command behind the slew limit; behind the
  /// lag; its integral; the state of the law.
  int num_states() const {
    return (delay_samples > 0 ? delay_samples + 1 : 0) + (keeps_setpoint() ? 1 : 0) +
           (lag > 0.0 ? 1 : 0) + (integrates ? 1 : 0) + (has_law_state() ? 1 : 0);
  }
};

}  // namespace counterpoint
