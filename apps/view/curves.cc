#include "view/curves.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"
#include "report/total_energy.h"

namespace counterpoint::view {
namespace {

bool has_velocities(const Clip& clip) {
  return std::all_of(clip.states.begin(), clip.states.end(),
                     [](const State& state) { return state.v.size() > 0; });
}

void add_energies(const Model& model, const Clip& clip, std::vector<Curve>& out) {
  if (!has_velocities(clip)) return;
  Curve total{kEnergyGroup, "total", "J", {}}, kinetic{kEnergyGroup, "kinetic", "J", {}};
  Curve potential{kEnergyGroup, "potential, springs", "J", {}};
  Dynamics dynamics(model);
  apps::SurfaceSprings surfaces(model);
  for (const State& state : clip.states) {
    dynamics.set_state(state.q, state.v);
    kinetic.values.push_back(dynamics.kinetic_energy());
    potential.values.push_back(dynamics.potential_energy() + spring_energy(model, state.q) +
                               surfaces.energy(state.q));
    total.values.push_back(kinetic.values.back() + potential.values.back());
  }
  out.insert(out.end(), {total, kinetic, potential});
}

/// Adds the force by which the world carries the bodies against gravity (forces between bodies
/// cancel in this sum), and the largest contact force.
void add_contact_forces(const Model& model, const Clip& clip, std::vector<Curve>& out) {
  if (clip.contacts.empty()) return;
  const double g = model.gravity().norm();
  const Vector3 up = g > 0.0 ? Vector3(-model.gravity() / g) : Vector3::UnitZ();
  Curve carried{kContactForceGroup, "carried by the world", "N", {}};
  Curve largest{kContactForceGroup, "largest", "N", {}};
  carried.values.assign(clip.num_frames(), 0.0);
  largest.values.assign(clip.num_frames(), 0.0);
  for (const Contact& contact : clip.contacts) {
    const auto& geometries = model.geometries();
    double& sum = carried.values[contact.frame];
    if (geometries[contact.geometry_a].body == 0) sum += contact.force.dot(up);
    if (geometries[contact.geometry_b].body == 0) sum -= contact.force.dot(up);
    double& most = largest.values[contact.frame];
    most = std::max(most, contact.force.norm());
  }
  out.insert(out.end(), {carried, largest});
}

/// Adds the closure forces if there are few closures; otherwise the arrows show them.
void add_closure_forces(const Model& model, const Clip& clip, std::vector<Curve>& out) {
  constexpr size_t kMost = 12;
  if (clip.closure_forces.empty() || model.closures().size() > kMost) return;
  const size_t first = out.size();
  for (const Closure& closure : model.closures())
    out.push_back(
        {"closure force", closure.name, "N", std::vector<double>(clip.num_frames(), 0.0)});
  for (const ClosureArrow& arrow : clip.closure_forces)
    out[first + arrow.closure].values[arrow.frame] = arrow.force.norm();
}

void add_iterations(const Clip& clip, std::vector<Curve>& out) {
  const std::vector<int>& iterations = clip.newton_iterations;
  if (iterations.size() == clip.states.size())
    out.push_back({"Newton iterations", "", "1", {iterations.begin(), iterations.end()}});
}

/// Coordinate of a clip at a time [s], interpolated linearly between frames and constant beyond its
/// ends.
double at_time(const Clip& clip, int index, double time) {
  const auto later = std::upper_bound(clip.states.begin(), clip.states.end(), time,
                                      [](double t, const State& state) { return t < state.time; });
  if (later == clip.states.begin()) return clip.states.front().q[index];
  if (later == clip.states.end()) return clip.states.back().q[index];
  const State& a = *(later - 1);
  const State& b = *later;
  return a.q[index] + (time - a.time) / (b.time - a.time) * (b.q[index] - a.q[index]);
}

void add_single(const Model& model, const Clip& clip, const std::vector<Clip>& ghosts, int joint,
                std::vector<Curve>& out) {
  const Body& body = model.body(joint + 1);
  const std::string& name = model.joint(joint).name;
  const JointUnits unit = joint_units(body.joint_type);
  Curve position{name + ": position", ghosts.empty() ? "" : clip.name, unit.q, {}};
  Curve velocity{name + ": velocity", "", unit.v, {}}, force{name + ": force", "", unit.force, {}};
  for (const State& state : clip.states) {
    position.values.push_back(state.q[body.q_index]);
    if (state.v.size() > 0) velocity.values.push_back(state.v[body.v_index]);
  }
  for (const VectorX& applied : clip.applied_force)
    force.values.push_back(applied.size() > 0      ? applied[body.v_index]
                           : !force.values.empty() ? force.values.back()
                                                   : 0.0);
  out.push_back(position);
  for (size_t i = 0; i < ghosts.size(); ++i) {
    Curve other{position.group, ghosts[i].name, unit.q, {}, static_cast<int>(i)};
    for (const State& state : clip.states)
      other.values.push_back(at_time(ghosts[i], body.q_index, state.time));
    out.push_back(std::move(other));
  }
  if (velocity.values.size() == clip.states.size()) out.push_back(std::move(velocity));
  const auto acts = [](double x) { return x != 0.0; };
  if (std::any_of(force.values.begin(), force.values.end(), acts)) out.push_back(std::move(force));
}

/// Adds the velocities of a joint with several coordinates. Its position is not needed: the page
/// reads that off the poses.
void add_several(const Model& model, const Clip& clip, int joint, std::vector<Curve>& out) {
  const Body& body = model.body(joint + 1);
  const std::string& link = model.joint(joint).link;
  const std::vector<std::string> names = coordinate_names(model).v;
  const int nv = joint_nv(body.joint_type);
  for (int i = 0; i < nv; ++i) {
    const std::string& name = names[body.v_index + i];
    const std::string label = name.substr(name.rfind('.') + 1);
    const bool turns = label.starts_with("w");
    Curve curve{
        link + (turns ? ": angular velocity" : ": velocity"), label, turns ? "rad/s" : "m/s", {}};
    for (const State& state : clip.states) curve.values.push_back(state.v[body.v_index + i]);
    out.push_back(std::move(curve));
  }
}

}  // namespace

JointUnits joint_units(JointType type) {
  if (type == JointType::kPrismatic) return {"m", "m/s", "N"};
  return {"rad", "rad/s", "N m"};
}

std::vector<Curve> curves_of(const Model& model, const Clip& clip,
                             const std::vector<Clip>& ghosts) {
  std::vector<Curve> out;
  add_energies(model, clip, out);
  add_contact_forces(model, clip, out);
  add_closure_forces(model, clip, out);
  add_iterations(clip, out);
  if (model.nq() + model.nv() > kMaxCoordinates) return out;
  for (int joint = 0; joint < model.num_joints(); ++joint) {
    if (joint_nv(model.body(joint + 1).joint_type) == 1)
      add_single(model, clip, ghosts, joint, out);
    else if (has_velocities(clip))
      add_several(model, clip, joint, out);
  }
  return out;
}

std::vector<std::string> first_groups(const std::vector<Curve>& curves) {
  std::vector<std::string> groups;
  const auto add = [&](const std::string& name) {
    if (std::find(groups.begin(), groups.end(), name) == groups.end()) groups.push_back(name);
  };
  for (const Curve& curve : curves)
    if (curve.group == kEnergyGroup || curve.group == kContactForceGroup || groups.size() < 3)
      add(curve.group);
  return groups;
}

}  // namespace counterpoint::view
