#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "counterpoint/engine/optimize/reference.h"

namespace counterpoint::optimization {
namespace {

constexpr std::array<std::pair<Quantity, const char*>, 18> kNames = {{
    {Quantity::kConfiguration, "configuration"},
    {Quantity::kVelocity, "velocity"},
    {Quantity::kJointLimits, "joint_limits"},
    {Quantity::kAcceleration, "acceleration"},
    {Quantity::kAppliedForce, "applied_force"},
    {Quantity::kEffortLimits, "effort_limits"},
    {Quantity::kUnactuatedForce, "unactuated_force"},
    {Quantity::kPosition, "position"},
    {Quantity::kOrientation, "orientation"},
    {Quantity::kPointVelocity, "point_velocity"},
    {Quantity::kClearance, "clearance"},
    {Quantity::kSliding, "sliding"},
    {Quantity::kTilt, "tilt"},
    {Quantity::kCenterOfMass, "center_of_mass"},
    {Quantity::kMomentum, "momentum"},
    {Quantity::kAngularMomentum, "angular_momentum"},
    {Quantity::kContactForce, "contact_force"},
    {Quantity::kDuration, "duration"},
}};

int rows_of_point(Quantity quantity) {
  switch (quantity) {
    case Quantity::kClearance:
    case Quantity::kDuration:
      return 1;
    case Quantity::kSliding:
    case Quantity::kTilt:
      return 2;
    default:
      return 3;
  }
}

void check_size(const char* what, Eigen::Index found, Eigen::Index expected) {
  if (found != expected)
    throw InputError(
        fmt::format("optimization: {} has {} entries, {} are expected", what, found, expected));
}

void check_term(const Model& model, const Term& term, int steps) {
  check_size((term.name + ": weight").c_str(), term.weight.size(), rows_of(model, term.quantity));
  if (term.target.size() > 0)
    check_size((term.name + ": target").c_str(), term.target.size(),
               term.quantity == Quantity::kConfiguration ? model.nq() : term.weight.size());
  if (!term.targets.empty()) {
    if (!may_follow(term.quantity))
      throw InputError(term.name + ": this quantity has no targets over time");
    check_size((term.name + ": targets").c_str(), static_cast<Eigen::Index>(term.targets.size()),
               steps + 1);
    for (const VectorX& target : term.targets)
      check_size((term.name + ": target").c_str(), target.size(),
                 target_size(model, term.quantity));
  }
  if (!term.active.empty())
    check_size((term.name + ": active").c_str(), static_cast<Eigen::Index>(term.active.size()),
               steps + 1);
  if (term.offset.size() > 0)
    check_size((term.name + ": offset").c_str(), term.offset.size(), model.nv());
  if (term.quantity == Quantity::kConfiguration && term.target.size() == 0 && term.targets.empty())
    throw InputError(term.name + ": a configuration needs a target");
  if (term.body < 0 || term.body >= model.num_bodies())
    throw InputError(fmt::format("{}: there is no body {}", term.name, term.body));
  if (!(term.length > 0.0)) throw InputError(term.name + ": length must be positive");
}

void check_duration(const Problem& problem) {
  if (problem.duration &&
      !(problem.duration->least > 0.0 && problem.duration->least <= problem.duration->most &&
        std::isfinite(problem.duration->most)))
    throw InputError(
        fmt::format("optimization: a duration of {} ... {} s; expected 0 < least <= most",
                    problem.duration->least, problem.duration->most));
  for (const Term& term : problem.terms) {
    if (term.quantity == Quantity::kDuration && !problem.duration)
      throw InputError(term.name + ": the duration is fixed; give the range that it may have");
    const bool timed = of_step(term.quantity) || rate_order(term.quantity) != 0;
    if (problem.duration && !term.targets.empty() && timed)
      throw InputError(fmt::format(
          "{}: targets over time of '{}' need a fixed duration; those of positions do not",
          term.name, quantity_name(term.quantity)));
  }
}

double tree_weight(const Model& model, const Tree& tree) {
  double mass = 0.0;
  for (int i = tree.body_begin; i < tree.body_end; ++i) mass += model.body(i).inertia.mass;
  return mass * kStandardGravity;
}

/// Twice the radius of gyration of a body [m].
double reach(const Body& body) {
  return 2.0 * std::sqrt(body.inertia.rotational.trace() / (3.0 * body.inertia.mass));
}

}  // namespace

const char* quantity_name(Quantity quantity) {
  for (const auto& [known, name] : kNames)
    if (known == quantity) return name;
  return "";
}

std::optional<Quantity> quantity_from_name(const std::string& name) {
  for (const auto& [known, its_name] : kNames)
    if (name == its_name) return known;
  return std::nullopt;
}

std::string quantity_names() {
  std::string names;
  for (const auto& entry : kNames) names += (names.empty() ? "" : ", ") + std::string(entry.second);
  return names;
}

bool of_step(Quantity quantity) {
  return quantity == Quantity::kAcceleration || quantity == Quantity::kAppliedForce ||
         quantity == Quantity::kEffortLimits || quantity == Quantity::kUnactuatedForce ||
         quantity == Quantity::kContactForce;
}

bool of_coordinates(Quantity quantity) { return quantity <= Quantity::kUnactuatedForce; }

int rows_of(const Model& model, Quantity quantity) {
  return of_coordinates(quantity) ? model.nv() : rows_of_point(quantity);
}

std::vector<char> motors_of(const Model& model) {
  std::vector<char> motors(static_cast<std::size_t>(model.nv()), 0);
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const JointInfo& joint = model.joint(i - 1);
    for (int k = 0; k < joint_nv(body.joint_type); ++k)
      motors[static_cast<std::size_t>(body.v_index + k)] = joint.actuated;
  }
  return motors;
}

double scene_weight(const Model& model) {
  double mass = 0.0;
  for (const Body& body : model.bodies()) mass += body.inertia.mass;
  return mass * kStandardGravity;
}

VectorX unactuated_weights(const Model& model, const std::vector<char>& motors, double lever) {
  VectorX out = VectorX::Zero(model.nv());
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const Tree& tree = model.trees()[static_cast<std::size_t>(body.tree)];
    const double weight = tree_weight(model, tree);
    const double arm = tree.body_end - tree.body_begin > 1 ? lever : std::min(lever, reach(body));
    for (int k = 0; k < joint_nv(body.joint_type); ++k)
      if (!motors[static_cast<std::size_t>(body.v_index + k)])
        out[body.v_index + k] =
            1.0 / (weight * (k < joint_num_linear(body.joint_type) ? 1.0 : arm));
  }
  return out;
}

Term unactuated_condition(const Model& model, const std::vector<char>& motors, double lever) {
  Term term;
  term.quantity = Quantity::kUnactuatedForce;
  term.name = quantity_name(term.quantity);
  term.weight = unactuated_weights(model, motors, lever);
  term.condition = true;
  return term;
}

void check_problem(const Problem& problem) {
  if (problem.model == nullptr) throw InputError("optimization: the problem has no model");
  const Model& model = *problem.model;
  if (problem.options.integrator != Integrator::kSemiImplicitEuler)
    throw InputError("optimization: the integrator must be semi_implicit_euler");
  if (!(problem.h() > 0.0)) throw InputError("optimization: the time step must be positive");
  if (problem.steps < 4)
    throw InputError(fmt::format("optimization: {} steps; 4 or more are expected", problem.steps));
  if (!problem.periodic) {
    check_size("start_q", problem.start_q.size(), model.nq());
    check_size("start_v", problem.start_v.size(), model.nv());
  }
  if (problem.periodic && problem.free_start)
    throw InputError("optimization: a periodic motion has no start that could be free");
  if (problem.goal_q) {
    if (problem.periodic) throw InputError("optimization: a periodic motion has no goal");
    check_size("goal_q", problem.goal_q->size(), model.nq());
    check_size("goal_v", problem.goal_v.size(), model.nv());
  }
  if (problem.mirror && problem.displacement.y() != 0.0)
    throw InputError("optimization: a mirrored motion cannot be displaced along y");
  check_size("motors", static_cast<Eigen::Index>(problem.motors.size()), model.nv());
  for (const Term& term : problem.terms) check_term(model, term, problem.steps);
  check_duration(problem);
}

}  // namespace counterpoint::optimization
