#include "counterpoint/engine/forces/actuators.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {
namespace {

/// Places of an actuator's internal states in z; meaningless where it has no such state.
struct Places {
  int delay, setpoint, lag, integral, law;
  explicit Places(const Actuator& a)
      : delay(a.z_index),
        setpoint(delay + (a.delay_samples > 0 ? a.delay_samples + 1 : 0)),
        lag(setpoint + (a.keeps_setpoint() ? 1 : 0)),
        integral(lag + (a.lag > 0.0 ? 1 : 0)),
        law(integral + (a.integrates ? 1 : 0)) {}
};

/// Moves the delay line on by h [s] under a constant command; `line` is its first state in z_next.
void advance_delay(const Actuator& a, double command, double h, double* line) {
  double& phase = line[a.delay_samples];
  phase += h * a.delay_samples / a.delay;
  const double whole = std::min(std::floor(phase), static_cast<double>(a.delay_samples));
  phase -= std::floor(phase);
  const int moved = static_cast<int>(whole);
  std::copy(line + moved, line + a.delay_samples, line);
  std::fill(line + a.delay_samples - moved, line + a.delay_samples, command);
}

/// Velocity terms of a row on a joint or tendon, without the gear.
std::span<const RowTerm> terms_of(const Model& model, const Actuator& a, const Tendons& tendons,
                                  RowTerm& joint_term) {
  if (a.tendon >= 0) return tendons.arms(a.tendon);
  joint_term = {model.body(a.joint + 1).v_index, 1.0};
  return {&joint_term, 1};
}

bool has_row(const Actuator& a) {
  return a.transmission == Transmission::kJoint || a.transmission == Transmission::kTendon;
}

}  // namespace

Actuators::Actuators(const Model& model)
    : drives_(model.actuators().size()), z_next_(model.default_z()) {
  const auto has_form = [&](const Actuator& a) {
    const bool bends = a.tendon >= 0 && model.tendons()[static_cast<size_t>(a.tendon)].is_spatial();
    return has_row(a) && a.law != ActuatorLaw::kMuscle && !bends;
  };
  closed_forms_ = std::all_of(model.actuators().begin(), model.actuators().end(), has_form);
}

/// Returns the command behind delay, slew limit, lag and integral at the start of the step, and
/// moves their states on.
double Actuators::find_command(const Actuator& a, double given, const StepContext& at) {
  const double h = at.h();
  const Places place(a);
  double command = std::clamp(given, a.least_command, a.most_command);
  if (a.delay_samples > 0) {
    const double delayed = at.z[place.delay];
    advance_delay(a, command, h, z_next_.data() + place.delay);
    command = delayed;
  }
  if (a.keeps_setpoint()) {
    const double last = at.z[place.setpoint];
    command = std::clamp(command, last - h * a.slew, last + h * a.slew);
    z_next_[place.setpoint] = command;
  }
  if (a.lag > 0.0) {
    const double lagged = at.z[place.lag];
    z_next_[place.lag] = lagged - std::expm1(-h / a.lag) * (command - lagged);
    command = lagged;
  }
  if (a.integrates) {
    const double sum = at.z[place.integral];
    z_next_[place.integral] = std::clamp(sum + h * command, a.least_setpoint, a.most_setpoint);
    command = sum;
  }
  return command;
}

void Actuators::find_length(const Actuator& a, const StepContext& at, const Tendons& tendons,
                            Drive& drive) const {
  RowTerm joint_term;
  const double length =
      a.tendon >= 0 ? tendons.length(a.tendon) : at.q[at.model.body(a.joint + 1).q_index];
  drive.length = a.gear * length;
  drive.rate = a.gear * row_velocity(terms_of(at.model, a, tendons, joint_term), at.v);
}

void Actuators::find_law(const Actuator& a, const StepContext& at, Drive& drive) const {
  const double h = at.h(), u = drive.command, x = drive.length;
  const Places place(a);
  drive.least = a.least;
  drive.most = a.most;
  drive.gain = 0.0;
  switch (a.law) {
    case ActuatorLaw::kAffine:
      drive.force = a.gain * u + a.bias - a.stiffness * x;
      drive.stiffness = a.stiffness;
      drive.gain = a.damping + a.command_damping * u + h * a.stiffness;
      break;
    case ActuatorLaw::kPid: {
      double rate = 0.0;  // rate of the command; a lag gives that of the step that begins
      if (a.kd > 0.0) rate = (a.lag > 0.0 ? z_next_[place.lag] - u : u - at.z[place.setpoint]) / h;
      const double integral = a.ki > 0.0 ? a.ki * at.z[place.law] : 0.0;
      drive.force = a.kp * (u - x) + a.kd * rate + integral;
      drive.stiffness = a.kp;
      drive.gain = a.kd + h * a.kp;
      break;
    }
    case ActuatorLaw::kDcMotor: {
      const double back = a.inductance / h, resistance = a.resistance + back;
      const double current = a.inductance > 0.0 ? at.z[place.law] : 0.0;
      drive.force = a.torque_constant * (u + back * current) / resistance;
      drive.gain = a.torque_constant * a.torque_constant / resistance;
      const double most = a.torque_constant * a.current_limit;
      drive.least = std::max(a.least, -most);
      drive.most = std::min(a.most, most);
      break;
    }
    case ActuatorLaw::kMuscle: {
      const MuscleForce pull = muscle_force(a.muscle, at.z[place.law], x, drive.rate);
      // A spring that stiffens is implicit; one that yields as it lengthens is not.
      drive.gain = pull.by_speed + h * std::max(pull.by_length, 0.0);
      drive.force = pull.by_speed * drive.rate - pull.force;
      drive.most = 0.0;
      break;
    }
    case ActuatorLaw::kPropeller: {
      const double w = at.v[at.model.body(a.joint + 1).v_index];
      drive.force = a.gain * w * std::abs(w);
      break;
    }
  }
}

void Actuators::add_wrench(const Actuator& a, double force, const Kinematics& data) {
  const Matrix3& R = data.X_WB[static_cast<size_t>(a.body)].rotation;
  ExternalWrench out;
  out.body = a.body;
  out.point = a.point;
  out.frame = a.frame;
  out.wrench = {R * a.direction.torque * force, R * a.direction.force * force};
  wrenches_.push_back(out);
}

/// Attracts the link to the bodies that it touches: the force is shared by its contacts within
/// reach.
void Actuators::attract(const Model& model, const Actuator& a, double force, const Kinematics& data,
                        const ConstraintSet& constraints) {
  const auto visit = [&](auto pull) {
    const auto look = [&](const collision::Candidate& c) {
      const bool of_a = model.geometries()[c.geometry_a].frame == a.frame;
      const bool of_b = model.geometries()[c.geometry_b].frame == a.frame;
      if (of_a != of_b && c.gap <= a.reach) pull(c);
    };
    for (const collision::Candidate& c : constraints.contacts) look(c);
    for (const ParkedContact& parked : constraints.parked) look(parked.candidate);
  };
  int count = 0;
  visit([&](const collision::Candidate&) { ++count; });
  visit([&](const collision::Candidate& c) {
    const auto push = [&](int geometry, double sign) {
      ExternalWrench out;
      out.body = model.geometries()[geometry].body;
      out.frame = model.geometries()[geometry].frame;
      if (out.body == 0) return;
      out.point = data.X_WB[static_cast<size_t>(out.body)].inverse() * c.position;
      out.wrench = {Vector3::Zero(), sign * force / count * c.normal};
      wrenches_.push_back(out);
    };
    push(c.geometry_a, 1.0);
    push(c.geometry_b, -1.0);
  });
}

void Actuators::find(const StepContext& at, const Kinematics& data, const Tendons& tendons,
                     const ConstraintSet& constraints, const Input& input) {
  const Model& model = at.model;
  wrenches_.clear();
  z_next_ = at.z;
  for (size_t i = 0; i < drives_.size(); ++i) {
    const Actuator& a = model.actuators()[i];
    Drive& drive = drives_[i];
    drive = {};
    const double given =
        input.command.size() > 0 ? input.command[static_cast<Eigen::Index>(i)] : a.command;
    drive.command = find_command(a, given, at);
    if (has_row(a)) find_length(a, at, tendons, drive);
    find_law(a, at, drive);
    if (has_row(a)) continue;
    drive.force = a.gear * std::clamp(drive.force, drive.least, drive.most);
    if (drive.force == 0.0) continue;
    if (a.transmission == Transmission::kLink) {
      add_wrench(a, drive.force, data);
    } else {
      attract(model, a, drive.force, data, constraints);
    }
  }
}

void Actuators::add_rows(const StepContext& at, const Tendons& tendons, SleepMask idle,
                         ConstraintSet& out) const {
  const double h = at.h();
  for (size_t i = 0; i < drives_.size(); ++i) {
    const Actuator& a = at.model.actuators()[i];
    if (!has_row(a) || (a.tendon >= 0 ? tendons.is_idle(a.tendon) : idle(a.joint + 1))) continue;
    const Drive& drive = drives_[i];
    JointConstraint row;
    row.effect = Effect::kActuators;
    row.actuator = static_cast<int>(i);
    row.part = TendonPart::kServo;
    double sign = 1.0;
    if (a.law == ActuatorLaw::kMuscle && drive.gain > 0.0) {
      sign = -1.0;
      row.law.type = contact::LawType::kUnilateral;
      set_gain(h, drive.gain, -drive.force, row.law);
    } else {
      set_motor_law(h, {drive.force, drive.gain, drive.least, drive.most}, row.law);
      if (drive.gain > 0.0) row.bias_by_length = drive.stiffness / drive.gain;
    }
    RowTerm joint_term;
    const size_t first = out.row_terms.size();
    out.add(row, terms_of(at.model, a, tendons, joint_term));
    for (size_t t = first; t < out.row_terms.size(); ++t)
      out.row_terms[t].coefficient *= sign * a.gear;
  }
}

void Actuators::conclude(const StepContext& at, const Tendons& tendons, const VectorRef& w,
                         VectorX& force, VectorX& z_next) {
  const double h = at.h();
  force.resize(static_cast<Eigen::Index>(drives_.size()));
  for (size_t i = 0; i < drives_.size(); ++i) {
    const Actuator& a = at.model.actuators()[i];
    const Drive& drive = drives_[i];
    double& f = force[static_cast<Eigen::Index>(i)];
    f = drive.force;
    if (has_row(a)) {
      RowTerm joint_term;
      const double y = a.gear * row_velocity(terms_of(at.model, a, tendons, joint_term), w);
      f = std::clamp(drive.force - drive.gain * y, drive.least, drive.most);
    }
    if (!a.has_law_state()) continue;
    double& state = z_next_[Places(a).law];
    if (a.law == ActuatorLaw::kMuscle) {
      state = next_activation(a.muscle, state, drive.command, h);
    } else if (a.law == ActuatorLaw::kDcMotor) {
      state = f / a.torque_constant;
    } else {
      const double error = drive.command - drive.length, most = a.integral_limit / a.ki;
      // The integral waits while the force is at the bound that it would push against.
      const bool winds_up = (f >= drive.most && error > 0.0) || (f <= drive.least && error < 0.0);
      if (!winds_up) state = std::clamp(state + h * error, -most, most);
    }
  }
  for (const Actuator& a : at.model.actuators())
    z_next.segment(a.z_index, a.num_states()) = z_next_.segment(a.z_index, a.num_states());
}

}  // namespace counterpoint
