// Physical residuals of a setting, beside its error: contact residuals on the
// scene itself, energy, the inverse, and three blocks whose behaviour is known.
#pragma once

#include <optional>
#include <vector>

#include "pieces.h"
#include "reference.h"

namespace counterpoint::apps::accuracy {

/// Against rigid Coulomb contact, the largest over all contacts and steps of all pieces; forces are
/// means over the step, velocities those that they are functions of. Of pairs without torsional and
/// rolling friction.
struct ContactResiduals {
  double primal = 0.0;           ///< distance of a force from its friction cone [N]
  double dual = 0.0;             ///< by which a contact closes faster than it may [m/s]
  double complementarity = 0.0;  ///< |f . (v + shift)|, shift = mu |v_T| n [W]
};

/// A block of 0.2 m and 1 kg with friction 0.5 on a plane, at the setting's own step and contact.
struct BlockFigures {
  double creep = 0.0;  ///< held on a slope of tan 0.4, mean speed [m/s]
  double hover = 0.0;  ///< sliding at 2 m/s to its stop, largest height above the plane [m]
  double rest = 0.0;   ///< at rest on the level: height above the plane, negative: in it [m]
};

struct Physics {
  std::optional<ContactResiduals> contact;  ///< of scenes with contacts
  double penetration = 0.0;                 ///< deepest overlap at the start of any step [m]
  double energy_error = 0.0;  ///< at the ends of pieces, to that of the reference, mean [J]
  /// Largest force that the inverse finds where none was applied, over the largest at work or, if
  /// that is more, the scene's weight (an N m counted as an N; 1 N without gravity); NaN: the
  /// integrator has no inverse.
  double inverse_error = 0.0;
  std::optional<BlockFigures> block;  ///< of scenes with contacts; empty if one of its steps fails
};

/// All pieces once more, with the forces of every step. `contacts`: the scene has some; then the
/// figures of the block too. Throws Stopped where `stop`, asked before every step, says so.
// Parameters: what it depends on, and when to end.
Physics measure_physics(const Scene& scene, const EngineSetting& setting, const Plan& plan,
                        const std::vector<Piece>& pieces, bool contacts,
                        const std::function<bool()>& stop = {});

/// The block alone; nothing if a step fails.
std::optional<BlockFigures> measure_block(const EngineSetting& setting);

}  // namespace counterpoint::apps::accuracy
