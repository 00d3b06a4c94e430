#include "counterpoint/engine/forces/joint_forces.h"

#include "counterpoint/engine/dynamics.h"

namespace counterpoint {

void add_joint_forces(const StepContext& at, double h, VectorOut diagonal, VectorOut tau,
                      EffectCounts& counts) {
  const Model& model = at.model;
  const EffectSet effects = at.effects;
  if (effects.has(Effect::kArmature)) {
    counts.add(Effect::kArmature);
    diagonal += model.armature();
  }
  if (effects.has(Effect::kDamping)) {
    counts.add(Effect::kDamping);
    diagonal += h * model.damping();
    tau -= model.damping().cwiseProduct(at.v);
  }
  if (effects.has(Effect::kSprings)) {
    counts.add(Effect::kSprings);
    add_springs(model, h, at.q, at.v, diagonal, tau);
  }
}

void add_joint_forces_inverse(const StepContext& at, double h, const VectorRef& w_next,
                              VectorOut tau, EffectCounts& counts) {
  const Model& model = at.model;
  const EffectSet effects = at.effects;
  if (effects.has(Effect::kArmature)) {
    counts.add(Effect::kArmature);
    tau += model.armature().cwiseProduct(w_next - at.v) / h;
  }
  if (effects.has(Effect::kDamping)) {
    counts.add(Effect::kDamping);
    tau += model.damping().cwiseProduct(w_next);
  }
  if (effects.has(Effect::kSprings)) {
    counts.add(Effect::kSprings);
    add_springs_inverse(model, h, at.q, w_next, tau);
  }
}

}  // namespace counterpoint
