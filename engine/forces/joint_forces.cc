#include "counterpoint/engine/forces/joint_forces.h"

#include "counterpoint/engine/dynamics.h"

namespace counterpoint {

void add_joint_forces(const Model& model, EffectSet effects, double h, const VectorRef& q,
                      const VectorRef& w, VectorOut diagonal, VectorOut tau, EffectCounts& counts) {
  if (effects.has(Effect::kArmature)) {
    counts.add(Effect::kArmature);
    diagonal += model.armature();
  }
  if (effects.has(Effect::kDamping)) {
    counts.add(Effect::kDamping);
    diagonal += h * model.damping();
    tau -= model.damping().cwiseProduct(w);
  }
  if (effects.has(Effect::kSprings)) {
    counts.add(Effect::kSprings);
    add_springs(model, h, q, w, diagonal, tau);
  }
}

void add_joint_forces_inverse(const Model& model, EffectSet effects, double h, const VectorRef& q,
                              const VectorRef& w, const VectorRef& w_next, VectorOut tau,
                              EffectCounts& counts) {
  if (effects.has(Effect::kArmature)) {
    counts.add(Effect::kArmature);
    tau += model.armature().cwiseProduct(w_next - w) / h;
  }
  if (effects.has(Effect::kDamping)) {
    counts.add(Effect::kDamping);
    tau += model.damping().cwiseProduct(w_next);
  }
  if (effects.has(Effect::kSprings)) {
    counts.add(Effect::kSprings);
    add_springs_inverse(model, h, q, w_next, tau);
  }
}

}  // namespace counterpoint
