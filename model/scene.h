// A scene: a model, its initial state and its simulation options, read from a YAML file or from a
// single model file (URDF, MJCF, SDF).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "counterpoint/model/model.h"
#include "counterpoint/model/model_builder.h"

namespace counterpoint {

// ---- Effects: forces and constraints by name. A scene needs some of them, and a step computes
// only those; the `effects:` section of a scene file switches any of them off. Equations:
// docs/explanation/effects.md.

enum class Effect : unsigned char {
  // bodies
  kGravity,
  kCoriolis,  ///< all forces quadratic in velocity: Coriolis, centrifugal, gyroscopic
  kDrag,      ///< drag of bodies in still air
  // joints, smooth forces
  kArmature,
  kDamping,
  kSprings,
  kServos,
  kPrescribed,  ///< joints whose motion is given
  // joints, rows of the contact problem
  kDryFriction,
  kBreakawayFriction,  ///< dry friction at rest above that of motion
  kLimits,
  kEffortLimits,
  kVelocityLimits,
  kMimics,
  kTendons,    ///< springs, dampers, friction, limits and servos of tendons
  kActuators,  ///< actuators: motors, muscles, thrusters, adhesion
  // between bodies
  kClosures,
  kContacts,
  kFriction,
  kStaticFriction,
  kFrictionDirections,  ///< two coefficients of sliding; off: their geometric mean
  kSurfaceMotion,       ///< surfaces that move relative to their bodies: belts
  kTorsionalFriction,
  kRollingFriction,
  kRestitution,
  kStiffness,  ///< surfaces that yield like springs
  kTautLinks,  ///< added rotational inertia of light links that tension turns too fast
  // external, present if the input of a step has them
  kAppliedForces,
  kExternalWrenches,
  // no force: resting bodies are skipped, with bitwise equal results
  kSleeping,
};

inline constexpr int kNumEffects = static_cast<int>(Effect::kSleeping) + 1;

/// Returns the name used in scene files: "gravity", "dry_friction", ...
const char* effect_name(Effect effect);
/// Returns the inverse of effect_name; nothing for an unknown name.
std::optional<Effect> effect_from_name(const std::string& name);
/// Returns all names in the order of the enumeration, separated by ", ".
std::string effect_names();

class EffectSet {
 public:
  constexpr EffectSet() = default;
  constexpr EffectSet(std::initializer_list<Effect> effects) {
    for (const Effect effect : effects) set(effect, true);
  }
  static constexpr EffectSet all() {
    EffectSet set;
    set.bits_ = (std::uint32_t{1} << kNumEffects) - 1;
    return set;
  }

  constexpr bool has(Effect effect) const { return (bits_ & bit(effect)) != 0; }
  constexpr void set(Effect effect, bool on) {
    bits_ = on ? bits_ | bit(effect) : bits_ & ~bit(effect);
  }
  constexpr EffectSet without(std::initializer_list<Effect> effects) const {
    EffectSet set = *this;
    for (const Effect effect : effects) set.set(effect, false);
    return set;
  }
  friend constexpr EffectSet operator&(EffectSet a, EffectSet b) {
    a.bits_ &= b.bits_;
    return a;
  }
  constexpr bool operator==(const EffectSet&) const = default;

 private:
  static constexpr std::uint32_t bit(Effect effect) {
    return std::uint32_t{1} << static_cast<int>(effect);
  }
  std::uint32_t bits_ = 0;
};

/// Effects that are on by default. A velocity limit belongs to the motor, not to the mechanism: it
/// is enforced only on request.
inline constexpr EffectSet kDefaultEffects = EffectSet::all().without({Effect::kVelocityLimits});

/// Number of executions of each effect's code.
struct EffectCounts {
  std::array<long, kNumEffects> of{};

  void add(Effect effect) { ++of[static_cast<std::size_t>(effect)]; }
  long operator[](Effect effect) const { return of[static_cast<std::size_t>(effect)]; }
};

// ---- The scene and its options.

/// Coupling of friction and normal motion (docs/explanation/concepts.md, contact/README.md):
///   kConvex   relaxed complementarity: a sliding contact hovers at the gap h mu |v_T|
///   kLagged   the offset mu |v_T| is computed from the previous velocity
///   kCoulomb  regularized, non-associated Coulomb friction, without hovering
enum class FrictionModel { kConvex, kLagged, kCoulomb };

/// Returns "convex", "lagged" or "coulomb".
const char* friction_model_name(FrictionModel model);
/// Returns the inverse of friction_model_name; nothing for an unknown name.
std::optional<FrictionModel> friction_model_from_name(const std::string& name);

/// Scheme of a step from (q, w) to (q+, w+) (docs/explanation/concepts.md):
///   kSemiImplicitEuler  order 1; supports every effect, and sleeping
///   kImplicitMidpoint   order 2, no energy drift; order 1 with constraints
///   kRungeKutta4        order 4; smooth effects only, no inverse
enum class Integrator { kSemiImplicitEuler, kImplicitMidpoint, kRungeKutta4 };

/// Returns "semi_implicit_euler", "implicit_midpoint" or "runge_kutta_4".
const char* integrator_name(Integrator integrator);
/// Returns the inverse of integrator_name; nothing for an unknown name.
std::optional<Integrator> integrator_from_name(const std::string& name);

/// Parameters of the contact law. They change the motion, and the inverse must be given the same
/// values as the forward step.
struct ContactOptions {
  FrictionModel friction_model = FrictionModel::kCoulomb;
  /// Compliance eps [-]: regularizer r = eps * (inverse mass at the contact). A body creeps down a
  /// slope at eps g h sin(theta).
  double compliance = 1e-6;
  /// Smoothing length delta [m]: a resting body hovers about delta above the ground.
  double smoothing = 1e-13;
  /// Stabilization beta [-], 0 ... 1: fraction of the penetration that is recovered in one step.
  double stabilization = 0.2;
  /// Largest speed of the recovery of a penetration [m/s].
  double max_recovery_speed = 1.0;
  /// Largest gap [m] up to which contacts of bodies at rest exist; moving bodies add the distance
  /// that they can travel within a step.
  double margin = 0.01;
  /// Contacts of bodies at rest exist up to the gap h^2 a that bodies close within a step h under
  /// this acceleration a [m/s^2], at most `margin`: it allows for applied forces, which are unknown
  /// at (q, w).
  double reach_acceleration = 500.0;
  /// Slip time [s]: with kCoulomb, friction of bodies whose fastest contact slides at speed s [m/s]
  /// reaches its bound at an additional slip of s h / slip_time
  /// (engine/constraints/friction_slip.h); infinity: no additional slip.
  double slip_time = 2.0;

  bool operator==(const ContactOptions&) const = default;
};

/// Presets of contact stiffness; they set friction_model and compliance only.
///   kFast     as soft as MuJoCo's defaults (compliance 0.1), convex friction: low cost
///   kDefault  stiff (1e-6), Coulomb friction
///   kHard     stiffer (1e-8), for mass ratios of a million; recovered forces are 100 times coarser
enum class ContactPreset { kFast, kDefault, kHard };
/// Returns "fast", "default" or "hard".
const char* contact_preset_name(ContactPreset preset);
/// Returns the inverse of contact_preset_name; nothing for an unknown name.
std::optional<ContactPreset> contact_preset_from_name(const std::string& name);
/// Sets friction_model and compliance of `options` to those of a preset.
void apply_contact_preset(ContactPreset preset, ContactOptions& options);

/// Default bound of speeds [m/s]: no mechanism moves at 100 km/s; the rim of a 1 m flywheel at
/// 10000 rad/s moves at 10 km/s.
inline constexpr double kDefaultMaxSpeed = 1e5;

/// Adaptive steps: their length follows from an error estimate instead of time_step
/// (engine/simulator.h).
struct StepControlOptions {
  /// Absolute tolerance: error per second of motion, for every coordinate [m/s, rad/s].
  double tolerance = 1e-3;
  /// Relative tolerance, added to it: fraction of the coordinate's speed [-].
  double relative_tolerance = 0.0;
  /// Largest step [s] in which an impact may occur.
  double event_tolerance = 1e-6;
  double min_step = 1e-8;  ///< [s], at most event_tolerance
  double max_step = 0.1;   ///< [s]
  /// If positive, steps end at every multiple of this time [s].
  double interval = 0.0;
  /// True: a step of min_step whose error exceeds the tolerance fails. False: it is only counted.
  bool strict = false;

  bool operator==(const StepControlOptions&) const = default;
};
/// Returns a description of the first invalid value, or "".
std::string step_control_flaw(const StepControlOptions& options);

struct SimulationOptions {
  double time_step = 0.002;  ///< [s]
  Integrator integrator = Integrator::kSemiImplicitEuler;
  double duration = 2.0;  ///< [s]
  /// Bound of speeds [m/s]: a step that leaves a coordinate faster fails (diverged). The speed of
  /// an angle counts at the far end of the links that it moves (engine/diagnosis/state_check.h).
  /// Infinity: no bound.
  double max_speed = kDefaultMaxSpeed;
  /// A closure or mimic joint that is far open and comes no closer for this time [s] is a fault (no
  /// progress, engine/simulator.h). Infinity: no such check.
  double closing_time = 1.0;
  /// Newton steps [-] after which a step is left unfinished: its contact impulses then obey their
  /// laws only roughly, as the step's report says, and its inverse counts them as applied. 0: no
  /// bound. See docs/explanation/failures.md.
  int step_budget = 0;
  ContactOptions contact;
  /// Effects that are computed if the scene needs them.
  EffectSet effects = kDefaultEffects;
  /// semi_implicit_euler only. True: velocity-dependent forces of trees of several bodies are taken
  /// at the mid-step velocity and conserve energy (engine/forces/mid_velocity.h,
  /// energy_projection.h). False: they are taken at the start of the step; cheaper, and with
  /// closed-form derivatives.
  bool mean_velocity_forces = true;
  /// True: overlaps of any depth are recovered by velocities, which `optimize` needs to leave the
  /// ground. False: deep overlaps are corrected by displacement (engine/constraints/contact_law.h).
  bool push_deep = false;
  /// Adaptive step control for Simulator::step_controlled, which tries time_step first;
  /// step_forward ignores it.
  std::optional<StepControlOptions> step_control = std::nullopt;

  bool operator==(const SimulationOptions&) const = default;
};

/// Sets an option by its key in scene files, such as "time_step", "contact.smoothing" or
/// "effects.drag", and the text of its value. @throws InputError, and changes nothing, if there is
/// no such option or the value is not valid.
void set_option(const std::string& key, const std::string& value, SimulationOptions& options);

/// A scene; by default an empty one. scene_of makes one from a model.
struct Scene {
  std::string name;
  Model model = ModelBuilder().build();
  VectorX q, v;  ///< initial state: nq, nv
  SimulationOptions options;
};

/// Returns the scene of a model built in code (model_builder.h): default configuration, at rest,
/// with default options.
Scene scene_of(Model model, std::string name = "");

/// Command-line options that add to a scene file or model file.
struct SceneOverrides {
  std::map<std::string, std::filesystem::path> packages;
  std::optional<Base> base;  ///< single URDF only; default: fixed
  /// Single URDF only: adds a ground plane z = 0; a floating base then starts just above it.
  bool ground = false;
  std::optional<double> ground_friction;
  bool repair_inertias = false;
  bool repair_joints = false;  ///< see UrdfOptions
  double fill_inertia = 0.0;   ///< see ModelBuilder::fill_inertia [kg]; 0: off
  /// Single URDF only: an SRDF file, whose disabled pairs never collide.
  std::filesystem::path srdf;
  /// Single model file only: largest number of vertices of every hull, 4 or more; 0: no limit.
  int hull_vertices = 0;
  MeshCollision meshes;  ///< single model file only: how its meshes collide
};

/// Reads a scene (.yaml, .yml) or a single model (.urdf, .mjcf, .sdf, .world, or .xml by its root
/// element). @throws InputError naming file, line, element, the expected input and a remedy.
Scene load_scene(const std::filesystem::path& file, const SceneOverrides& overrides = {});

// ---- A complete scene as bytes, readable by the same version of this library only: for copies in
// other processes. Use scene files for storage.

/// Returns model, initial state and options as bytes, including meshes and terrains (each once).
std::string archive_scene(const Scene& scene);

/// Returns the archived scene, with bitwise equal numbers. @throws InputError for bytes that
/// archive_scene of this version did not write, or that are damaged.
Scene restore_scene(std::string_view bytes);

}  // namespace counterpoint
