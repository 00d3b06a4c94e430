// A model as another one with other figures: same bodies, joints and names, so that a state of one
// is a state of the other. For those who look for the figures (identification, sensitivities).
#pragma once

#include <tuple>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// Starts from a built model and changes values in it; structure stays. Every function @throws
/// InputError for a value that is not finite or that no model may have; indices are the caller's.
class ModelEditor {
 public:
  explicit ModelEditor(Model model) : model_(std::move(model)) {}

  void set_gravity(const Vector3& gravity);  ///< [m/s^2] in W
  void set_material(int geometry, const Material& material);
  /// Pose in the frame of its body, for the ground that of the world.
  void set_pose(int geometry, const Pose& X_BG);
  /// Mass [kg] of a body; carried weight (GravityCompensation) and the centre stay, the rotational
  /// inertia keeps its ratio to the mass.
  void set_mass(int body, double mass);
  /// All of it; the mass must be positive, whether a real body has the rest is the caller's.
  void set_inertia(int body, const SpatialInertia& inertia);
  /// Rotational inertia about the centre of mass, times `factor`.
  void scale_inertia(int body, double factor);
  /// All lengths of a body from its origin, times `factor`: shapes and where they are, centre of
  /// mass, radii of gyration; the mass stays. @throws InputError where another joint or a closure
  /// is mounted on it, or its shape is terrain.
  void scale_size(int body, double factor);
  void set_damping(int v_index, double value);       ///< [N m s/rad or N s/m]
  void set_dry_friction(int v_index, double value);  ///< [N m or N]
  void set_armature(int v_index, double value);      ///< [kg m^2 or kg]

  /// The model; the editor is empty afterwards.
  Model take() { return std::move(model_); }

 private:
  friend class ModelArchive;  // scene_archive.cc
  /// All that a model is.
  static auto parts(Model& m) {
    return std::tie(m.nq_, m.nv_, m.bodies_, m.trees_, m.joints_, m.frames_, m.geometries_,
                    m.pair_materials_, m.mimics_, m.springs_, m.servos_, m.drags_,
                    m.gravity_compensations_, m.closures_, m.notes_, m.excluded_pairs_,
                    m.exclusion_reasons_, m.gravity_, m.default_q_, m.damping_, m.armature_,
                    m.dry_friction_);
  }

  Model model_;
};

}  // namespace counterpoint
