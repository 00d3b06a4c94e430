// A scene: a model, where it starts, and how it is to be stepped. Read from YAML, or from a lone
// URDF.
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

// ---- Effects: forces and constraints by name. A scene calls for some of them; a step runs those
// and no others; a scene file's `effects:` section switches any of them off. Equations:
// docs/explanation/effects.md.

enum class Effect : unsigned char {
  // of all bodies
  kGravity,
  kCoriolis,  ///< all forces quadratic in velocity: Coriolis, centrifugal, gyroscopic
  kDrag,      ///< of bodies in still air
  // of joints, smooth
  kArmature,
  kDamping,
  kSprings,
  kServos,
  // of joints, rows of the contact problem
  kDryFriction,
  kLimits,
  kEffortLimits,
  kVelocityLimits,
  kMimics,
  // between bodies
  kClosures,
  kContacts,
  kFriction,
  kTorsionalFriction,
  kRollingFriction,
  kRestitution,
  kTautLinks,  ///< light links under tension turn no faster than steps follow
  // from outside, called for by the input of a step
  kAppliedForces,
  kExternalWrenches,
  // of none: resting bodies are left out of the step, to the same bits
  kSleeping,
};

inline constexpr int kNumEffects = static_cast<int>(Effect::kSleeping) + 1;

/// As in scene files: "gravity", "dry_friction", ...
const char* effect_name(Effect effect);
/// The reverse; nothing for an unknown name.
std::optional<Effect> effect_from_name(const std::string& name);
/// All names, in the order of the enumeration, separated by ", ".
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

/// What is on unless a scene says otherwise. A velocity limit is the motor's, not the mechanism's:
/// it is enforced only where that is asked for.
inline constexpr EffectSet kDefaultEffects = EffectSet::all().without({Effect::kVelocityLimits});

/// How often the code of each effect ran.
struct EffectCounts {
  std::array<long, kNumEffects> of{};

  void add(Effect effect) { ++of[static_cast<std::size_t>(effect)]; }
  long operator[](Effect effect) const { return of[static_cast<std::size_t>(effect)]; }
};

// ---- The scene and its options.

/// How friction and normal motion are coupled: docs/explanation/concepts.md, contact/README.md.
///   kConvex   relaxed complementarity: a sliding contact hovers at h mu |v_T|
///   kLagged   the shift mu |v_T| is taken from the last velocity
///   kCoulomb  exact Coulomb friction
enum class FrictionModel { kConvex, kLagged, kCoulomb };

/// "convex", "lagged", "coulomb".
const char* friction_model_name(FrictionModel model);
/// The reverse; nothing for an unknown name.
std::optional<FrictionModel> friction_model_from_name(const std::string& name);

/// How a step goes from (q, w) to (q+, w+): docs/explanation/concepts.md.
///   kSemiImplicitEuler  order 1, every effect, sleeping
///   kImplicitMidpoint   order 2, no drift of energy; order 1 with constraints
///   kRungeKutta4        order 4, smooth effects only, no inverse
enum class Integrator { kSemiImplicitEuler, kImplicitMidpoint, kRungeKutta4 };

/// "semi_implicit_euler", "implicit_midpoint", "runge_kutta_4".
const char* integrator_name(Integrator integrator);
/// The reverse; nothing for an unknown name.
std::optional<Integrator> integrator_from_name(const std::string& name);

/// Everything that shapes the physics of contact. A change here changes the motion, and the inverse
/// must be given the same values as the forward step.
struct ContactOptions {
  FrictionModel friction_model = FrictionModel::kCoulomb;
  /// eps [-]: regularizer r = eps * (inverse mass at the contact). Creep on a slope is eps g h
  /// sin(theta).
  double compliance = 1e-6;
  /// delta [m]: smoothing as a length. A resting body hovers about delta above the ground.
  double smoothing = 1e-13;
  /// beta [-]: share of a penetration that is to be recovered in one step, 0 ... 1.
  double stabilization = 0.2;
  /// The recovery of a penetration is no faster than this [m/s].
  double max_recovery_speed = 1.0;
  /// Contacts exist up to this gap [m] at most, plus what the bodies can travel within a step,
  double margin = 0.01;
  /// and up to the gap that bodies close within a step h under this acceleration [m/s^2], h^2 a:
  /// what applied forces may add to the velocities of (q, w), which say nothing of them.
  double reach_acceleration = 500.0;
  /// [s]: exact Coulomb friction of bodies whose fastest contact slides at s [m/s] reaches its
  /// bound at a slip of s h / slip_time more (engine/constraints/friction_slip.h); infinite: no
  /// more.
  double slip_time = 2.0;

  bool operator==(const ContactOptions&) const = default;
};

/// How contacts behave in one word; only friction_model and compliance differ.
///   kFast     as soft as MuJoCo's defaults (compliance 0.1), convex friction: cheap motion
///   kDefault  stiff (1e-6), exact Coulomb friction
///   kHard     stiffer (1e-8): for mass ratios of a million; the inverse resolves a hundred times
///   less
enum class ContactPreset { kFast, kDefault, kHard };
/// "fast", "default", "hard".
const char* contact_preset_name(ContactPreset preset);
/// The reverse; nothing for an unknown name.
std::optional<ContactPreset> contact_preset_from_name(const std::string& name);
void apply_contact_preset(ContactPreset preset, ContactOptions& options);

/// No mechanism on Earth moves at 100 km/s; a flywheel of 1 m at 10 000 rad/s does 10 km/s.
inline constexpr double kDefaultMaxSpeed = 1e5;

/// Steps as long as their error allows, in place of time_step (engine/simulator.h).
struct StepControlOptions {
  /// Error that a second of motion may add, of any coordinate [m/s, rad/s].
  double tolerance = 1e-3;
  /// The same as a share of the coordinate's speed [-], in addition.
  double relative_tolerance = 0.0;
  /// The step that an impact falls into is no longer than this [s].
  double event_tolerance = 1e-6;
  double min_step = 1e-8;  ///< [s], at most event_tolerance
  double max_step = 0.1;   ///< [s]
  double interval = 0.0;   ///< Steps end at every multiple of this time [s]; 0: wherever they do.
  /// A step of min_step whose error is above the tolerance fails; else it is counted.
  bool strict = false;

  bool operator==(const StepControlOptions&) const = default;
};
/// Says what is wrong with them, or nothing.
std::string step_control_flaw(const StepControlOptions& options);

struct SimulationOptions {
  double time_step = 0.002;  ///< [s]
  Integrator integrator = Integrator::kSemiImplicitEuler;
  double duration = 2.0;  ///< [s]
  /// A step fails (diverged) that leaves a coordinate faster than this [m/s]; an angle's speed
  /// counts at the far end of what it moves (engine/diagnosis/state_check.h). Infinity: no bound.
  double max_speed = kDefaultMaxSpeed;
  /// A run fails (no progress) in which a closure or mimic joint is far open and comes no closer
  /// for this time [s] (engine/simulator.h). Infinity: it may.
  double closing_time = 1.0;
  ContactOptions contact;
  /// Effects that are on where the scene calls for them.
  EffectSet effects = kDefaultEffects;
  /// Velocity-dependent forces of trees of several bodies are those in the middle of the step, and
  /// keep its energy (engine/forces/mid_velocity.h, energy_projection.h). False: those at its
  /// start; cheaper, and with derivatives in closed form. Of semi_implicit_euler.
  bool mean_velocity_forces = true;
  /// Velocities push apart what overlaps, however deep, as `optimize` needs to find its way out of
  /// the ground. False: what is deep is parted by displacement (engine/constraints/contact_law.h).
  bool push_deep = false;
  /// If set, controlled steps (Simulator::step_controlled) are of the length that it asks for, the
  /// first one tried being time_step. step_forward does not look at it.
  std::optional<StepControlOptions> step_control = std::nullopt;

  bool operator==(const SimulationOptions&) const = default;
};

/// Without anything: the world alone. In code: scene_of.
struct Scene {
  std::string name;
  Model model = ModelBuilder().build();
  VectorX q, v;  ///< where it starts: nq, nv
  SimulationOptions options;
};

/// The scene of a model that was built in code (model_builder.h): at its default configuration, at
/// rest, with the default options.
Scene scene_of(Model model, std::string name = "");

/// What a command line may say about a scene that its file does not.
struct SceneOverrides {
  std::map<std::string, std::filesystem::path> packages;
  std::optional<Base> base;  ///< a lone URDF only; default fixed
  bool ground =
      false;  ///< a lone URDF only: a ground plane z = 0; a floating base then starts just above it
  std::optional<double> ground_friction;
  bool repair_inertias = false;
  bool repair_joints = false;  ///< UrdfOptions
  double fill_inertia = 0.0;   ///< ModelBuilder::fill_inertia [kg]; 0: no
  std::filesystem::path
      srdf;               ///< a lone URDF only: an SRDF file, whose disabled pairs never collide
  int hull_vertices = 0;  ///< a lone URDF only: limit of every hull, 4 or more; 0: none
};

/// Reads a scene (.yaml, .yml) or a lone robot (.urdf). @throws InputError naming file, line,
/// element, what was expected and what to do.
Scene load_scene(const std::filesystem::path& file, const SceneOverrides& overrides = {});

// ---- A scene as bytes, all of it, to be read by the same version of this library: for copies in
// other processes. To keep a scene, use scene files.

/// Model, start and options, meshes and terrains included (each once).
std::string archive_scene(const Scene& scene);

/// The same scene: equal bits in every figure. @throws InputError for bytes that archive_scene of
/// this version has not written, or that are cut short.
Scene restore_scene(std::string_view bytes);

}  // namespace counterpoint
