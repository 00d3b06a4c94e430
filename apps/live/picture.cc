#include "live/picture.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/sensors/sensor_table.h"
#include "view/packed_scene.h"

namespace counterpoint::live {
namespace {

bool has_coordinates(const Model& model) {
  return model.nq() + model.nv() <= view::kMaxCoordinates;
}

}  // namespace

void add_limits(const Model& model, const VectorX& q, Frame& out) {
  out.at_limit.assign(static_cast<size_t>(model.num_bodies()), 0);
  for (int b = 1; b < model.num_bodies(); ++b) out.at_limit[b] = view::is_at_limit(model, b, q);
}

Picture::Picture(const Model& model)
    : model_(model),
      num_sensor_curves_(
          std::min(static_cast<int>(sensor_columns(model).size()), kMostSensorCurves)),
      frames_(link_frames(model)),
      dynamics_(model),
      surfaces_(model) {}

std::vector<view::Curve> Picture::curves(const State& start) {
  std::vector<view::Curve> out = {{view::kEnergyGroup, "total", "J", {}},
                                  {view::kEnergyGroup, "kinetic", "J", {}},
                                  {view::kEnergyGroup, "potential, springs", "J", {}},
                                  {view::kContactForceGroup, "carried by the world", "N", {}},
                                  {view::kContactForceGroup, "largest", "N", {}},
                                  {"hand", "", "N", {}},
                                  {"Newton iterations", "", "1", {}}};
  if (has_coordinates(model_)) {
    for (int b = 1; b < model_.num_bodies(); ++b) {
      const Body& body = model_.body(b);
      const JointInfo& joint = model_.joint(b - 1);
      if (joint_nv(body.joint_type) == 1) {
        const view::JointUnits unit = view::joint_units(body.joint_type);
        out.push_back({joint.name + ": position", "", unit.q, {}});
        out.push_back({joint.name + ": velocity", "", unit.v, {}});
        out.push_back({joint.name + ": force", "", unit.force, {}});
      } else {
        for (const char* axis : {"x", "y", "z"})
          out.push_back({joint.link + ": velocity", axis, "m/s", {}});
      }
    }
  }
  const std::vector<SensorColumn> sensors = sensor_columns(model_);
  for (int i = 0; i < num_sensor_curves_; ++i) {
    const SensorColumn& column = sensors[static_cast<size_t>(i)];
    const size_t dot = std::min(column.name.rfind('.'), column.name.size());
    out.push_back({"sensor " + column.name.substr(0, dot),
                   column.name.substr(std::min(dot + 1, column.name.size())),
                   column.unit,
                   {}});
  }
  dynamics_.set_state(start.q, start.v);
  Frame frame;
  add_curves(start, {}, frame);
  for (size_t i = 0; i < out.size(); ++i) out[i].values = {frame.curves[i]};
  return out;
}

void Picture::add_coordinates(const State& state, const Input* input,
                              std::vector<double>& out) const {
  for (int b = 1; b < model_.num_bodies(); ++b) {
    const Body& body = model_.body(b);
    if (joint_nv(body.joint_type) == 1) {
      const bool applied = input != nullptr && input->applied_force.size() > 0;
      out.insert(out.end(), {state.q[body.q_index], state.v[body.v_index],
                             applied ? input->applied_force[body.v_index] : 0.0});
    } else {
      const Vector3 v = dynamics_.frame(frames_[b]).velocity;
      out.insert(out.end(), v.begin(), v.end());
    }
  }
}

void Picture::add_curves(const State& state, const Shown& shown, Frame& out) {
  const double kinetic = dynamics_.kinetic_energy();
  const double potential =
      dynamics_.potential_energy() + spring_energy(model_, state.q) + surfaces_.energy(state.q);
  energy_ = kinetic + potential;
  const double g = model_.gravity().norm();
  const Vector3 up = g > 0.0 ? Vector3(-model_.gravity() / g) : Vector3::UnitZ();
  double carried = 0.0, largest = 0.0;
  for (const Frame::Arrow& contact : out.contacts)
    largest = std::max(largest, contact.force.norm());
  for (const Vector3& force : world_forces_) carried += force.dot(up);
  const double hand = shown.hand != nullptr ? shown.hand->force().norm() : 0.0;
  out.curves = {energy_,
                kinetic,
                potential,
                carried,
                largest,
                hand,
                static_cast<double>(shown.newton_iterations)};
  if (has_coordinates(model_)) add_coordinates(state, shown.input, out.curves);
  for (int i = 0; i < num_sensor_curves_; ++i)
    out.curves.push_back(shown.sensors != nullptr ? (*shown.sensors)[i] : 0.0);
}

/// The state remembers the contact forces of its last step; the arrows move along with the bodies.
void Picture::add_contacts(const State& state, Frame& out) {
  const auto& geometries = model_.geometries();
  for (const RememberedForce& r : state.memory) {
    if (r.kind != RememberedForce::Kind::kContact || r.force.isZero(0.0)) continue;
    const int a = geometries[r.a].body, b = geometries[r.b].body;
    const Vector3 force = view::force_on_moving(b, r.force);
    out.contacts.push_back({out.poses[b != 0 ? b : a] * r.at, force});
    if (a == 0 || b == 0) world_forces_.push_back(force);
  }
}

void Picture::add_closures(const Inverse& forces, Frame& out) {
  for (size_t i = 0; i < forces.closures.size(); ++i)
    out.closures.push_back(
        {forces.closures[i].position,
         view::force_on_moving(model_.closures()[i].body_b, forces.closures[i].force.force)});
}

const Frame& Picture::frame(const State& state, const Shown& shown) {
  Frame& out = frame_;
  out.time = state.time;
  dynamics_.set_state(state.q, state.v);
  out.poses.resize(frames_.size());
  for (size_t b = 1; b < frames_.size(); ++b) out.poses[b] = dynamics_.frame_pose(frames_[b]);
  add_limits(model_, state.q, out);
  out.contacts.clear();
  out.closures.clear();
  world_forces_.clear();
  add_contacts(state, out);
  if (shown.forces != nullptr && !shown.forces->fault.any()) add_closures(*shown.forces, out);
  out.rests = shown.before != nullptr ? view::trees_at_rest(model_, *shown.before, state)
                                      : std::vector<char>(model_.num_trees(), 0);
  const bool holds = shown.hand != nullptr && shown.hand->body() != 0;
  out.held_body = holds ? shown.hand->body() : 0;
  out.hand = holds ? Frame::Arrow{shown.hand->point(), shown.hand->force()} : Frame::Arrow{};
  add_curves(state, shown, out);
  return out;
}

}  // namespace counterpoint::live
