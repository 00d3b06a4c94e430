// Effects: forces and constraints by name. A scene calls for some of them; a step runs those and no
// others; a scene file's `effects:` section switches any of them off. Equations:
// docs/explanation/effects.md.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>

namespace counterpoint {

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

}  // namespace counterpoint
