#include <fmt/format.h>

#include <array>
#include <cmath>

#include "counterpoint/engine/state.h"
#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/files/file_format.h"
#include "counterpoint/model/geometry.h"

namespace counterpoint {
namespace {

void add(const Pose& X, Hash& hash) {
  hash.add(X.rotation);
  hash.add(X.translation);
}

void add_bodies(const Model& model, Hash& hash) {
  hash.add(model.num_bodies());
  for (const Body& body : model.bodies()) {
    hash.add(body.parent);
    hash.add(static_cast<int>(body.joint_type));
    add(body.X_PJ, hash);
    hash.add(body.inertia.mass);
    hash.add(body.inertia.center);
    hash.add(body.inertia.rotational);
  }
  for (const JointInfo& joint : model.joints()) {
    hash.add(joint.name);
    hash.add(joint.link);
    for (const double x : {joint.lower, joint.upper, joint.effort_limit, joint.velocity_limit})
      hash.add(x);
    hash.add(joint.actuated ? 1 : 0);
    hash.add(joint.prescribed ? 1 : 0);
  }
}

void add_shape(const Shape& shape, Hash& hash) {
  hash.add(static_cast<int>(shape.type));
  hash.add(shape.size);
  if (shape.mesh)
    for (const Vector3& vertex : shape.mesh->vertices) hash.add(vertex);
  if (!shape.terrain) return;
  for (const Vector3& vertex : shape.terrain->vertices) hash.add(vertex);
  for (const Terrain::Triangle& triangle : shape.terrain->triangles)
    for (const int vertex : triangle.vertices) hash.add(vertex);
}

void add_material(const Material& m, Hash& hash) {
  for (const double x : {m.friction, m.restitution, m.torsional_friction, m.rolling_friction})
    hash.add(x);
  if (m.friction_at_rest() > m.friction)
    for (const double x : {m.static_friction, m.stribeck_speed}) hash.add(x);
  if (m.is_soft())
    for (const double x : {m.stiffness, m.damping, m.dissipation}) hash.add(x);
  if (const Spring& s = m.per_area; s.is_soft())
    for (const double x : {s.stiffness, s.damping, s.dissipation}) hash.add(x);
  if (!m.is_directional()) return;
  hash.add(m.friction_across);
  hash.add(m.friction_axis);
  hash.add(m.axis_of_second ? 1 : 0);
}

void add_geometries(const Model& model, Hash& hash) {
  hash.add(static_cast<int>(model.geometries().size()));
  for (const Geometry& geometry : model.geometries()) {
    hash.add(geometry.body);
    add(geometry.X_BG, hash);
    add_shape(geometry.shape, hash);
    add_material(geometry.material, hash);
  }
  for (const auto& [a, b] : model.excluded_geometry_pairs()) {
    hash.add(a);
    hash.add(b);
  }
  // These lists, added later, are empty in most models, whose earlier hashes stay valid.
  for (const auto& [a, b] : model.included_geometry_pairs()) {
    hash.add(-1 - a);
    hash.add(-1 - b);
  }
  for (const PairMaterial& pair : model.pair_materials()) {
    hash.add(pair.geometry_a);
    hash.add(pair.geometry_b);
    add_material(pair.material, hash);
  }
}

void add_joint_effects(const Model& model, Hash& hash) {
  for (const VectorX* x : {&model.damping(), &model.armature(), &model.dry_friction()})
    hash.add(*x);
  const auto add_all = [&](const auto&... values) { (hash.add(values), ...); };
  for (int k = 0; k < model.nv(); ++k)  // added later: other models keep their hash
    if (model.breaks_away(k)) add_all(k, model.breakaway_friction()[k], model.stribeck_speed()[k]);
  for (const Mimic& mimic : model.mimics())
    add_all(mimic.joint, mimic.master, mimic.multiplier, mimic.offset);
  for (const JointSpring& spring : model.springs())
    add_all(spring.joint, spring.stiffness, spring.reference);
  for (const JointServo& servo : model.servos()) {
    hash.add(servo.joint);
    for (const double x : {servo.stiffness, servo.damping, servo.position, servo.velocity})
      hash.add(x);
  }
}

void add_actuators(const Model& model, Hash& hash) {
  for (const Actuator& a : model.actuators()) {
    for (const int x : {static_cast<int>(a.transmission), static_cast<int>(a.law), a.joint,
                        a.tendon, a.body, a.frame, a.delay_samples})
      hash.add(x);
    for (const Vector3& x : {a.point, a.direction.force, a.direction.torque}) hash.add(x);
    for (const double x : {a.reach,
                           a.gear,
                           a.command,
                           a.least_command,
                           a.most_command,
                           a.delay,
                           a.slew,
                           a.lag,
                           a.gain,
                           a.bias,
                           a.stiffness,
                           a.damping,
                           a.kp,
                           a.ki,
                           a.kd,
                           a.integral_limit,
                           a.torque_constant,
                           a.resistance,
                           a.inductance,
                           a.current_limit,
                           a.least,
                           a.most})
      hash.add(x);
    if (a.law != ActuatorLaw::kMuscle) continue;
    const Muscle& m = a.muscle;
    hash.add(static_cast<int>(m.curves));
    for (const double x : {m.max_force, m.optimal_length, m.slack_length, m.pennation, m.max_speed,
                           m.damping, m.shortest, m.longest, m.passive_force, m.eccentric_force,
                           m.activation_time, m.deactivation_time, m.activation_smoothing})
      hash.add(x);
  }
}

void add_tendons(const Model& model, Hash& hash) {
  for (const Tendon& tendon : model.tendons()) {
    for (const TendonJoint& term : tendon.joints) {
      hash.add(term.joint);
      hash.add(term.coefficient);
    }
    for (const TendonSegment& segment : tendon.path) {
      for (const TendonPoint& point : {segment.from, segment.to}) {
        hash.add(point.body);
        hash.add(point.position);
      }
      hash.add(segment.wrap);
      hash.add(segment.share);
    }
    for (const TendonWrap& wrap : tendon.wraps) {
      hash.add(wrap.body);
      add(wrap.X_BG, hash);
      hash.add(wrap.radius);
      hash.add(static_cast<int>(wrap.cylinder));
      hash.add(wrap.side.value_or(Vector3::Zero()));
    }
    const TendonServo& servo = tendon.servo;
    for (const double x :
         {tendon.stiffness, tendon.rest_shortest, tendon.rest_longest, tendon.damping,
          tendon.dry_friction, tendon.lower, tendon.upper, servo.stiffness, servo.damping,
          servo.target, servo.speed, servo.least, servo.most})
      hash.add(x);
  }
}

void add_drags_and_closures(const Model& model, Hash& hash) {
  for (const BodyDrag& drag : model.drags()) {
    hash.add(drag.body);
    hash.add(drag.center);
    for (const double x :
         {drag.drag.linear, drag.drag.quadratic, drag.drag.angular, drag.drag.angular_quadratic})
      hash.add(x);
  }
  for (const GravityCompensation& carried : model.gravity_compensations()) {
    hash.add(carried.body);
    hash.add(carried.center);
    hash.add(carried.mass);
  }
  for (const Closure& closure : model.closures()) {
    hash.add(static_cast<int>(closure.type));
    hash.add(closure.body_a);
    hash.add(closure.body_b);
    add(closure.X_AC, hash);
    add(closure.X_BC, hash);
    hash.add(closure.length);
    hash.add(closure.pitch);
    for (const bool flag : {closure.rope, closure.switched, closure.attached, closure.in_place})
      hash.add(static_cast<int>(flag));
    hash.add(closure.breaking_force);
    hash.add(closure.breaking_torque);
    for (const ClosureSpring* spring : {&closure.linear, &closure.angular}) {
      hash.add(static_cast<int>(spring->acts));
      hash.add(spring->stiffness);
      hash.add(spring->damping);
    }
  }
}

/// Checks a hash column in the last row. A Table holds doubles, so hashes are compared after
/// rounding to 53 bits.
void check_hash(const Table& table, const char* column, std::uint64_t hash, const char* what) {
  const int index = table.find_column(column);
  const auto advice =
      "to start from its q and v all the same, allow a changed scene (--changed-scene)";
  if (index < 0) {
    throw InputError(fmt::format(
        "{}: no column '{}': this is no state file, and nothing says which scene it is from; {}",
        table.where_columns(), column, advice));
  }
  if (table.value(table.num_rows() - 1, index) == static_cast<double>(hash)) return;
  throw InputError(
      fmt::format("{}: column '{}': saved from another scene, {} differ; resume the scene it was "
                  "saved from, or "
                  "{}",
                  table.where(table.num_rows() - 1), column, what, advice));
}

constexpr std::array kMemoryFields{"kind", "a",  "b",  "x",  "y",  "z",
                                   "fx",   "fy", "fz", "tx", "ty", "tz"};

std::string memory_column(size_t index, const char* field) {
  return fmt::format("{}{}.{}", kMemoryPrefix, index, field);
}

/// Checks that the constraint of a remembered force exists in the model.
void check_memory(const Model& model, const RememberedForce& r, const std::string& where) {
  const auto inside = [](int i, size_t size) { return i >= 0 && static_cast<size_t>(i) < size; };
  bool valid = false;
  switch (r.kind) {
    case RememberedForce::Kind::kContact:
      valid = inside(r.a, model.geometries().size()) && inside(r.b, model.geometries().size());
      break;
    case RememberedForce::Kind::kClosure:
      valid = inside(r.a, model.closures().size());
      break;
    case RememberedForce::Kind::kJoint:
      valid = inside(r.a, static_cast<size_t>(model.nv()));
      break;
    case RememberedForce::Kind::kTautLink:
      valid = r.a > 0 && inside(r.a, static_cast<size_t>(model.num_bodies())) &&
              r.force[0] >= 1.0 && r.force[1] >= 1.0 && r.force[1] <= r.force[0] &&
              r.force[2] >= 0.0;
      break;
  }
  if (!valid)
    throw InputError(
        fmt::format("{}: a remembered force is of no contact, closure, joint or taut link of this "
                    "scene; remove the columns '{}...'",
                    where, kMemoryPrefix));
}

/// Reads the memory in the last row.
std::vector<RememberedForce> read_memory(const Table& table, const Model& model) {
  std::vector<RememberedForce> memory;
  const int row = table.num_rows() - 1;
  while (table.find_column(memory_column(memory.size(), kMemoryFields[0])) >= 0) {
    std::array<double, kMemoryFields.size()> x{};
    for (size_t i = 0; i < x.size(); ++i)
      x[i] = table.value(row, table.column(memory_column(memory.size(), kMemoryFields[i])));
    RememberedForce r;
    if (!(x[0] >= 0.0 && x[0] <= 3.0 && x[0] == std::floor(x[0])) || std::abs(x[1]) > 1e9 ||
        std::abs(x[2]) > 1e9)
      throw InputError(fmt::format("{}: columns '{}{}...' name no constraint", table.where(row),
                                   kMemoryPrefix, memory.size()));
    r.kind = static_cast<RememberedForce::Kind>(static_cast<int>(x[0]));
    r.a = static_cast<int>(x[1]);
    r.b = static_cast<int>(x[2]);
    r.at = {x[3], x[4], x[5]};
    r.force = {x[6], x[7], x[8]};
    r.torque = {x[9], x[10], x[11]};
    check_memory(model, r, table.where(row));
    memory.push_back(r);
  }
  return memory;
}

}  // namespace

std::uint64_t model_hash(const Model& model) {
  Hash hash;
  hash.add(model.gravity());
  add_bodies(model, hash);
  add_geometries(model, hash);
  add_joint_effects(model, hash);
  add_drags_and_closures(model, hash);
  add_tendons(model, hash);
  add_actuators(model, hash);
  return hash.value();
}

std::uint64_t options_hash(const SimulationOptions& options) {
  Hash hash;
  const ContactOptions& contact = options.contact;
  hash.add(static_cast<int>(options.integrator));
  hash.add(static_cast<int>(contact.friction_model));
  for (const double x :
       {options.time_step, contact.compliance, contact.smoothing, contact.stabilization,
        contact.max_recovery_speed, contact.margin, contact.reach_acceleration, contact.slip_time})
    hash.add(x);
  if (const auto& control = options.step_control) {
    for (const double x :
         {control->tolerance, control->relative_tolerance, control->event_tolerance,
          control->min_step, control->max_step, control->interval})
      hash.add(x);
    hash.add(control->strict ? 1 : 0);
  }
  for (int i = 0; i < kNumEffects; ++i) {
    const auto effect = static_cast<Effect>(i);
    if (effect == Effect::kTautLinks || effect == Effect::kActuators ||
        effect == Effect::kPrescribed || effect == Effect::kBreakawayFriction)
      continue;
    hash.add(effect != Effect::kSleeping && options.effects.has(effect) ? 1 : 0);
  }
  // Options added later change the hash only if they differ from the earlier behaviour, so that the
  // hashes in older files stay valid.
  if (!options.effects.has(Effect::kTautLinks)) hash.add(2);
  if (!options.effects.has(Effect::kActuators)) hash.add(3);
  if (!options.effects.has(Effect::kPrescribed)) hash.add(4);
  if (!options.effects.has(Effect::kBreakawayFriction)) hash.add(-1);
  if (!options.mean_velocity_forces) hash.add(0);
  if (options.push_deep) hash.add(1);
  if (options.step_budget > 0) hash.add(options.step_budget + 4);
  return hash.value();
}

void write_state(const std::filesystem::path& file, const Model& model,
                 const SimulationOptions& options, const State& state,
                 std::optional<double> next_step) {
  const CoordinateNames names = coordinate_names(model);
  std::vector<Column> columns{"time"};
  for (const auto* list : {&names.q, &names.v, &names.z})
    columns.insert(columns.end(), list->begin(), list->end());
  columns.push_back(format_column());
  for (const char* name : {kStateHashColumn, kModelHashColumn, kOptionsHashColumn})
    columns.emplace_back(name, CellType::kInteger);
  if (next_step) columns.emplace_back(kNextStepColumn);
  for (size_t i = 0; i < state.memory.size(); ++i)
    for (const char* field : kMemoryFields) columns.push_back(memory_column(i, field));
  TableWriter table(file, columns);
  table.number(state.time);
  for (const double x : state.q) table.number(x);
  for (const double x : state.v) table.number(x);
  for (const double x : given_z(model, state.z)) table.number(x);
  table.empty();  // the format
  for (const std::uint64_t hash : {state_hash(state), model_hash(model), options_hash(options)})
    table.integer(hash);
  if (next_step) table.number(*next_step);
  for (const RememberedForce& r : state.memory) {
    for (const int x : {static_cast<int>(r.kind), r.a, r.b}) table.number(x);
    for (const Vector3& v : {r.at, r.force, r.torque})
      for (const double x : v) table.number(x);
  }
  table.end_row();
  table.finish();
}

State read_state(const std::filesystem::path& file, const Model& model,
                 const SimulationOptions& options, SceneCheck check) {
  const Trajectory trajectory = read_trajectory(file, model);
  const Table table(file);
  if (check == SceneCheck::kSame) {
    check_hash(table, kModelHashColumn, model_hash(model),
               "the model's joints, inertias, shapes, surfaces, closures or gravity");
    check_hash(table, kOptionsHashColumn, options_hash(options),
               "the time step, integrator, contact options, effects or step control");
    if (trajectory.altered_rows > 0) {
      throw InputError(fmt::format(
          "{}: the numbers are not those that were saved (column '{}'): edited, or rounded on the "
          "way",
          table.where(table.num_rows() - 1), kStateHashColumn));
    }
  }
  const int last = trajectory.num_rows() - 1;
  State state{trajectory.time[last], trajectory.q.col(last), trajectory.v.col(last)};
  if (trajectory.z.cols() > 0) state.z = trajectory.z.col(last);
  state.memory = read_memory(table, model);
  return state;
}

std::optional<double> read_next_step(const std::filesystem::path& file) {
  const Table table(file);
  const int column = table.find_column(kNextStepColumn);
  if (column < 0) return std::nullopt;
  const double step = table.value(table.num_rows() - 1, column);
  if (step > 0.0) return step;
  throw InputError(fmt::format("{}: column '{}' is {}; a positive time [s] is expected",
                               table.where(table.num_rows() - 1), kNextStepColumn, step));
}

}  // namespace counterpoint
