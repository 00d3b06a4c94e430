// Actuators of an MJCF file that need a command of their own: those with an internal state
// (filters, muscles, PID plugins), forces at sites, adhesion.
#pragma once

#include <vector>

#include "counterpoint/model/mjcf/forces/actuator_law.h"
#include "counterpoint/model/mjcf/forces/equality.h"

namespace counterpoint::mjcf {

/// Largest gap [m] of a contact at which adhesion pulls: contacts that carry nothing keep a gap of
/// rounding and smoothing.
inline constexpr double kAdhesionReach = 1e-6;

/// An actuator element, with its law and the place where it acts.
struct CommandedElement {
  Document& document;
  const Bodies& bodies;
  const Element& element;
  const std::vector<const Element*>& levels;  ///< law_levels
  const Law& law;
  const Couplings::Reduced& length;  ///< on a joint: its length, c q + constant, without the gear
  const TendonSpec* tendon;          ///< on a tendon, or null
};

/// Whether the actuator is no servo or motor of a joint or tendon.
bool needs_command(const Element& e, const Law& law);

/// Whether the element uses MuJoCo's plugin of PID control.
bool is_pid_plugin(const Document& document, const Element& e);

/// Appends the actuator to model.commanded, with the bounds of `actuator`, and refers to it there.
/// Features without a counterpart are refused with a message.
void read_commanded(const CommandedElement& from, MjcfModel::Actuator& actuator, MjcfModel& model);

}  // namespace counterpoint::mjcf
