// Physical residuals of a setting besides its error: contact residuals on the scene itself, energy,
// the inverse, and three tests of a block with known behaviour.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pieces.h"
#include "reference.h"

namespace counterpoint::apps::accuracy {

/// Residuals against rigid Coulomb contact, the largest over all contacts and steps of all pieces.
/// Forces are means over the step; velocities are the arguments of the contact law. Pairs with
/// torsional or rolling friction are left out.
struct ContactResiduals {
  double primal = 0.0;           ///< distance of a force from its friction cone [N]
  double dual = 0.0;             ///< excess of the closing velocity over the allowed one [m/s]
  double complementarity = 0.0;  ///< |f . (v + shift)|, shift = mu |v_T| n [W]
};

/// A block of edge 0.2 m and mass 1 kg with friction 0.5 on a plane, at the setting's own step and
/// contact.
struct BlockMetrics {
  double creep = 0.0;  ///< mean speed while held on a slope of tangent 0.4 [m/s]
  double hover = 0.0;  ///< largest height above the plane while sliding from 2 m/s to rest [m]
  double rest = 0.0;   ///< height at rest on the level plane, negative: overlap [m]
};

struct Physics {
  std::optional<ContactResiduals> contact;  ///< empty for scenes without contacts
  double penetration = 0.0;                 ///< deepest overlap at the start of any step [m]
  double energy_error = 0.0;  ///< difference of energy to the reference at the ends of pieces, mean
                              ///< [J]
  /// Largest force that the inverse finds where none was applied, divided by the larger of the
  /// largest force at work and the scene's weight (a N m counts as a N; 1 N without gravity); NaN:
  /// the integrator has no inverse.
  double inverse_error = 0.0;
  std::optional<BlockMetrics> block;  ///< empty without contacts, or if one of its steps fails
};

/// A figure of physics in files and tables.
struct PhysicsColumn {
  const char* key;                                 ///< name in files, with the SI unit
  const char* heading;                             ///< column heading in tables
  double scale;                                    ///< factor from the SI unit to that of tables
  std::optional<double> (*value)(const Physics&);  ///< empty: not measured
};
std::span<const PhysicsColumn> physics_columns();

/// Repeats all pieces with the forces of every step. `contacts`: the scene has contacts, so the
/// block is measured too. @throws Stopped where `stop`, called before every step, returns true.
Physics measure_physics(const Scene& scene, const EngineSetting& setting, const Plan& plan,
                        const std::vector<Piece>& pieces, bool contacts,
                        const std::function<bool()>& stop = {});

/// Measures the block only; empty if a step fails.
std::optional<BlockMetrics> measure_block(const EngineSetting& setting);

}  // namespace counterpoint::apps::accuracy
