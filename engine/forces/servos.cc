#include "counterpoint/engine/forces/servos.h"

#include <cmath>

#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {
namespace {

/// Gains, targets and coordinates of one servo in a step.
struct Demand {
  int q_index, v_index;
  double kp, kd;
  double q_target, w_target;

  Demand(const Model& model, const Input& input, int i) {
    const JointServo& servo = model.servos()[i];
    const Body& body = model.body(servo.joint + 1);
    q_index = body.q_index;
    v_index = body.v_index;
    kp = servo.stiffness;
    kd = servo.damping;
    q_target = input.servo_position.size() > 0 ? input.servo_position[i] : servo.position;
    w_target = input.servo_velocity.size() > 0 ? input.servo_velocity[i] : servo.velocity;
  }

  /// Returns s for w_next = w [N, N m].
  double force(double h, const VectorRef& q, const VectorRef& w) const {
    return kp * (q_target - q[q_index] - h * w[v_index]) + kd * (w_target - w[v_index]);
  }
};

int num_servos(const Model& model) { return static_cast<int>(model.servos().size()); }

}  // namespace

bool is_limited(const Model& model, EffectSet effects, const JointServo& servo) {
  return effects.has(Effect::kEffortLimits) && std::isfinite(model.joint(servo.joint).effort_limit);
}

void add_servos(const StepContext& at, double h, const Input& input, VectorOut diagonal,
                VectorOut tau) {
  const Model& model = at.model;
  for (int i = 0; i < num_servos(model); ++i) {
    if (is_limited(model, at.effects, model.servos()[i])) continue;
    const Demand servo(model, input, i);
    diagonal[servo.v_index] += h * (servo.kd + h * servo.kp);
    tau[servo.v_index] += servo.force(h, at.q, at.v);
  }
}

void add_servo_rows(const StepContext& at, double h, const Input& input, SleepMask idle,
                    VectorOut tau, ConstraintSet& constraints) {
  const Model& model = at.model;
  for (int i = 0; i < num_servos(model); ++i) {
    const JointServo& servo = model.servos()[i];
    if (!is_limited(model, at.effects, servo)) continue;
    if (idle(servo.joint + 1)) continue;
    const Demand demand(model, input, i);
    const double gain = demand.kd + h * demand.kp;  // [N s/m, N m s/rad]
    double& applied = tau[demand.v_index];
    JointConstraint row;
    row.law.type = contact::LawType::kDryFriction;
    set_gain(h, gain,
             demand.kp * (demand.q_target - at.q[demand.q_index]) + demand.kd * demand.w_target +
                 applied,
             row.law);
    row.law.bound = h * model.joint(servo.joint).effort_limit;
    constraints.add(row, {{demand.v_index}});
    applied = 0.0;
  }
}

void compute_servo_forces(const Model& model, double h, const VectorRef& q, const VectorRef& w_next,
                          const Input& input, VectorOut force) {
  for (int i = 0; i < num_servos(model); ++i)
    force[i] = Demand(model, input, i).force(h, q, w_next);
}

}  // namespace counterpoint
