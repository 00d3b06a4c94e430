#include "counterpoint/engine/sensors/sensor_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "counterpoint/engine/dynamics/joint_motion.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "counterpoint/engine/sensors/sensor_values.h"
#include "counterpoint/engine/step/step_workspace.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

bool needs_tendons(SensorKind kind) {
  return senses_tendon(kind) || kind == SensorKind::kActuatorPosition ||
         kind == SensorKind::kActuatorVelocity;
}
bool needs_poses(SensorKind kind) { return !senses_part(kind) || needs_tendons(kind); }
bool needs_acceleration(SensorKind kind) {
  return senses_wrench(kind) || kind == SensorKind::kLinearAcceleration ||
         kind == SensorKind::kAngularAcceleration || kind == SensorKind::kSpecificForce;
}
bool needs_inverse(SensorKind kind) {
  return senses_wrench(kind) || senses_contacts(kind) || kind == SensorKind::kJointEffort ||
         kind == SensorKind::kTendonForce || kind == SensorKind::kActuatorForce;
}

std::string axes_of(const Model& model, const Sensor& sensor, SensorKind kind) {
  if (senses_part(kind) || kind == SensorKind::kRange || kind == SensorKind::kTouch ||
      kind == SensorKind::kPressure)
    return "";
  if (senses_wrench(kind) || (sensor.own_axes && takes_axes(kind))) return "sensor";
  if (sensor.reference < 0 || !takes_reference(kind)) return "world";
  return model.frames()[static_cast<std::size_t>(sensor.reference)].name;
}

/// Spatial accelerations A of all bodies minus gravity, in W, from those of the joints (nv).
void compute_accelerations(const Model& model, const VectorX& a, const Vector3& gravity,
                           const Kinematics& at, std::vector<Motion>& A) {
  A[0] = {Vector3::Zero(), -gravity};
  for (int i = 1; i < model.num_bodies(); ++i) {
    const auto b = static_cast<std::size_t>(i);
    const Body& body = model.body(i);
    const auto first = static_cast<std::size_t>(body.v_index);
    A[b] = shift(A[static_cast<std::size_t>(body.parent)], at.arm[b]) + at.c[b] +
           joint_motion(body.joint_type, &at.axis[first], a.data() + first);
  }
}

[[noreturn]] void refuse(const Sensor& sensor, const std::string& what) {
  throw InputError(fmt::format("sensor '{}': {}", sensor.name, what));
}

/// Refuses a sensor that has no value under these options.
void check_sensor(const Model& model, const SimulationOptions& options,
                  const PlacedSensor& placed) {
  const Sensor& sensor = *placed.sensor;
  const auto any = [&](bool (*test)(SensorKind)) {
    return std::any_of(sensor.kinds.begin(), sensor.kinds.end(), test);
  };
  if (any(needs_inverse) && options.integrator == Integrator::kRungeKutta4)
    refuse(sensor,
           "forces are read off the motion, and runge_kutta_4 has no inverse: use "
           "semi_implicit_euler");
  if (any(senses_wrench) && options.integrator != Integrator::kSemiImplicitEuler)
    refuse(sensor, "a wrench is known under the integrator semi_implicit_euler only");
  double mass = placed.part.share.mass;
  for (const int child : placed.part.children)
    for (int b = child; b < model.body(child).subtree_end; ++b) mass += model.body(b).inertia.mass;
  if (any(senses_subtree) && !(mass > 0.0))
    refuse(sensor, "its links have no mass, so there is no centre of mass");
}

}  // namespace

std::vector<SensorColumn> sensor_columns(const Model& model) {
  std::vector<SensorColumn> columns;
  for (std::size_t i = 0; i < model.sensors().size(); ++i) {
    const Sensor& sensor = model.sensors()[i];
    for (const SensorKind kind : sensor.kinds)
      for (const SensorRow& row : sensor_rows(model, sensor, kind))
        columns.push_back({sensor.name + "." + row.suffix, row.unit, axes_of(model, sensor, kind),
                           static_cast<int>(i)});
  }
  return columns;
}

/// The quantities of a step that several sensors share, each computed if one needs it.
struct SensorTable::Impl {
  Impl(const Model& m, const SimulationOptions& o)
      : model(&m),
        options(o),
        columns(sensor_columns(m)),
        data(m),
        tendons(m),
        A(static_cast<std::size_t>(m.num_bodies())),
        acceleration(VectorX::Zero(m.nv())) {
    for (std::size_t i = 0; i < m.sensors().size(); ++i) {
      const PlacedSensor& placed = sensors.emplace_back(m, static_cast<int>(i));
      check_sensor(m, o, placed);
      for (const SensorKind kind : placed.sensor->kinds) {
        poses = poses || needs_poses(kind);
        stretches = stretches || needs_tendons(kind);
        accelerations = accelerations || needs_acceleration(kind);
        inverses = inverses || needs_inverse(kind);
        wrenches = wrenches || senses_wrench(kind);
      }
    }
    list_quantities();
    if (o.effects.has(Effect::kGravity)) gravity = m.gravity();
    if (inverses) workspace.emplace(m);
    if (wrenches) joints.emplace(m);
  }

  /// One vector of one sensor and its first row.
  struct Quantity {
    std::size_t sensor;
    SensorKind kind;
    Eigen::Index first, rows;
  };

  void list_quantities();
  void check_sizes(const SensorStep& step, const VectorOut& values) const;
  void compute(const SensorStep& step);
  void compute_wrenches();
  Force wrench_on(const PlacedSensor& placed, const Input& known) const;
  void write(const SensorStep& step, const Quantity& quantity, double* out);

  /// Scratch memory of the wrenches of joints.
  struct Wrenches {
    explicit Wrenches(const Model& m)
        : scratch(m), external(m), tau(VectorX::Zero(m.nv())), of_joints(m) {}
    DynamicsScratch scratch;
    ExternalForces external;
    VectorX tau;
    JointWrenches of_joints;
  };

  const Model* model;
  SimulationOptions options;
  std::vector<SensorColumn> columns;
  std::vector<PlacedSensor> sensors;
  std::vector<Quantity> quantities;
  bool poses = false, stretches = false, accelerations = false, inverses = false, wrenches = false;
  Vector3 gravity = Vector3::Zero();
  Data data;
  Tendons tendons;
  std::vector<Motion> A;
  VectorX acceleration;
  std::optional<Workspace> workspace;
  Inverse inverse;
  std::optional<Wrenches> joints;
  SensorWork work;
};

SensorTable::SensorTable(const Model& model, const SimulationOptions& options)
    : impl_(std::make_unique<Impl>(model, options)) {}
SensorTable::~SensorTable() = default;
SensorTable::SensorTable(SensorTable&&) noexcept = default;
SensorTable& SensorTable::operator=(SensorTable&&) noexcept = default;

const std::vector<SensorColumn>& SensorTable::columns() const { return impl_->columns; }
const SensorWork& SensorTable::work() const { return impl_->work; }

void SensorTable::Impl::list_quantities() {
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const Sensor& sensor = *sensors[i].sensor;
    for (const SensorKind kind : sensor.kinds) {
      const auto rows = static_cast<Eigen::Index>(sensor_rows(*model, sensor, kind).size());
      quantities.push_back({i, kind, first, rows});
      first += rows;
    }
  }
}

void SensorTable::Impl::check_sizes(const SensorStep& step, const VectorOut& values) const {
  const Eigen::Index nq = model->nq(), nv = model->nv();
  if (step.q.size() != nq || step.q_next.size() != nq || step.v.size() != nv ||
      step.v_next.size() != nv)
    throw InputError(fmt::format(
        "sensors: states of {} and {} coordinates, {} and {} velocities for a model of {} and {}",
        step.q.size(), step.q_next.size(), step.v.size(), step.v_next.size(), nq, nv));
  if (values.size() != static_cast<Eigen::Index>(columns.size()))
    throw InputError(
        fmt::format("sensors: {} values for {} columns", values.size(), columns.size()));
  if (!(step.h > 0.0))
    throw InputError(fmt::format("sensors: a step of {} s; its length must be positive", step.h));
}

/// The wrenches of joints by inverse dynamics with the forces of the inverse step that was computed
/// last: its mean velocity-dependent forces, wrenches, drag, taut links and free groups.
void SensorTable::Impl::compute_wrenches() {
  Workspace::Impl& ws = workspace->impl();
  Wrenches& own = *joints;
  ++work.wrenches;
  own.external = ws.motion.external;
  if (!own.external.has_external) own.external.begin();
  for (const FreeGroups::Group& group : ws.free_groups.groups()) {
    for (const int t : group.trees) {
      const Tree& tree = model->trees()[static_cast<std::size_t>(t)];
      for (int b = tree.body_begin; b < tree.body_end; ++b) {
        const auto i = static_cast<std::size_t>(b);
        const SpatialInertia& inertia = model->body(b).inertia;
        const Vector3 force = inertia.mass * group.shift;
        const Vector3 arm = data.X_WB[i].rotation * inertia.center;
        own.external.external[i] -= {arm.cross(force), force};
        A[i].linear += group.shift;
      }
    }
  }
  const BodyState bodies(ws.start.kinematics(), ws.start.velocity_forces(), own.external,
                         own.scratch);
  rnea(ws.taut_links.slowed(*model), acceleration, gravity, bodies, own.tau);
  own.of_joints.compute(*model, data, own.scratch.F, inverse);
}

void SensorTable::Impl::compute(const SensorStep& step) {
  if (inverses) {
    ++work.inverses;
    options.time_step = step.h;
    step_inverse(*model, options, step.q, step.v, step.q_next, step.v_next, step.known, *workspace,
                 inverse);
  }
  if (poses) {
    ++work.poses;
    compute_poses(*model, step.q, data);
    compute_velocities(*model, step.v, data);
  }
  if (stretches) tendons.find(*model, step.q, data, SleepMask());
  if (accelerations) {
    ++work.accelerations;
    acceleration = (step.v_next - step.v) / step.h;
    compute_accelerations(*model, acceleration, gravity, data, A);
  }
}

Force SensorTable::Impl::wrench_on(const PlacedSensor& placed, const Input& known) const {
  const CarriedPart& part = placed.part;
  const auto b = static_cast<std::size_t>(part.body);
  const bool pushed = options.effects.has(Effect::kExternalWrenches) && !known.wrenches.empty();
  const Force wrench = part.welded ? weld_wrench(*model, part,
                                                 {data, A[b], inverse, joints->of_joints,
                                                  pushed ? &known.wrenches : nullptr})
                                   : joints->of_joints.of(part.body);
  return seen_from(wrench, data.X_WB[b].translation, sensor_pose(*model, *placed.sensor, data));
}

void SensorTable::Impl::write(const SensorStep& step, const Quantity& quantity, double* out) {
  const PlacedSensor& placed = sensors[quantity.sensor];
  if (quantity.kind == SensorKind::kRange) {
    ++work.rays;
    *out = range_to(*model, *placed.sensor, data);
  } else if (senses_wrench(quantity.kind)) {
    const double sign = placed.sensor->reference < 0 ? 1.0 : -1.0;  // a reference: the wrench on it
    const Force wrench = wrench_on(placed, step.known) * sign;
    const Vector3& value = quantity.kind == SensorKind::kForce ? wrench.force : wrench.torque;
    std::copy_n(value.data(), 3, out);
  } else {
    sensed_value({*model, step.q, step.v, data, A, gravity, tendons, inverse}, placed,
                 quantity.kind, out);
  }
}

void SensorTable::evaluate(const SensorStep& step, VectorOut values) {
  Impl& own = *impl_;
  own.check_sizes(step, values);
  own.compute(step);
  const bool invalid = own.inverses && own.inverse.fault.any();
  // Accelerations are read before those of free groups are added for the wrenches.
  for (const bool wrenches : {false, true}) {
    if (wrenches && own.wrenches && !invalid) own.compute_wrenches();
    for (const Impl::Quantity& quantity : own.quantities) {
      if (senses_wrench(quantity.kind) != wrenches) continue;
      if (invalid && needs_inverse(quantity.kind)) {
        values.segment(quantity.first, quantity.rows).setConstant(kNaN);
      } else {
        own.write(step, quantity, values.data() + quantity.first);
      }
    }
  }
}

}  // namespace counterpoint
