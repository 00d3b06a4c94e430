#include "counterpoint/engine/derivatives/step/smooth_derivator.h"

#include "counterpoint/engine/derivatives/forces/body_forces.h"
#include "counterpoint/engine/step/step_forces.h"

namespace counterpoint {
SmoothDerivator::SmoothDerivator(const Model& model)
    : stiffness(VectorX::Zero(model.nv())),
      damping(stiffness),
      sweep_(model),
      forces_(model),
      w_(stiffness),
      zero_(stiffness) {
  for (MatrixX* m : {&dq, &dw, &mass}) m->setZero(model.nv(), model.nv());
}

void SmoothDerivator::compute(const Model& model, EffectSet effects, const VectorRef& w,
                              const VectorRef& a, const std::vector<ExternalWrench>& wrenches,
                              const StageMotion& stage, const VectorX& rotors) {
  forces_.begin();
  if (effects.has(Effect::kExternalWrenches))
    add_wrench_responses(model, wrenches, stage.at, forces_);
  if (effects.has(Effect::kDrag)) add_drag_responses(model, stage.at, forces_);
  w_ = w;
  SweepInput in;
  in.v = stage.velocity.has_coriolis ? w_.data() : zero_.data();
  in.a = a.data();
  if (effects.has(Effect::kGravity)) in.gravity = model.gravity();
  forces_.put_into(in);
  in.v_start = in.v_next = w_.data();
  for (const Tree& tree : model.trees()) sweep_.run(model, tree, stage.at, in, {dq, dw, mass});
  mass.diagonal() += rotors;
  stiffness.setZero();
  damping.setZero();
  if (effects.has(Effect::kDamping)) damping += model.damping();
  if (effects.has(Effect::kSprings))
    for (const JointSpring& spring : model.springs())
      stiffness[model.body(spring.joint + 1).v_index] += spring.stiffness;
  if (!effects.has(Effect::kServos)) return;
  for (const JointServo& servo : model.servos()) {
    stiffness[model.body(servo.joint + 1).v_index] += servo.stiffness;
    damping[model.body(servo.joint + 1).v_index] += servo.damping;
  }
}

}  // namespace counterpoint
