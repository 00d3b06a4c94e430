#include "measure/run_watch.h"

#include <fmt/format.h>

#include <algorithm>

namespace counterpoint::apps {
namespace {

/// Positions that differ by less are equal up to round-off [m, rad].
constexpr double kMoved = 1e-13;
/// Thresholds of warnings: energy gained relative to the energy moved, and opening of closures [m
/// or rad].
constexpr double kGained = 0.02, kOpened = 1e-3;

bool is_floating_linkage(const Model& model, const Tree& tree) {
  return model.body(tree.body_begin).joint_type == JointType::kFloating &&
         tree.body_end - tree.body_begin > 1;
}

}  // namespace

RunWatch::RunWatch(Simulator& simulator, long every)
    : simulator_(simulator),
      dynamics_(simulator.model()),
      q_(simulator.state().q),
      v_(simulator.state().v),
      springs_(simulator.model()),
      momentum_(VectorX::Zero(simulator.model().nv())),
      every_(std::max(1L, every)) {
  highest_ = start_ = energy(simulator_.state());
  below_ = below_ground();
  lowest_ = highest_potential_ = potential(q_);
  fastest_ = start_ - lowest_;
  look_at_closures(q_);
}

/// True if all work on the scene is counted; the work of servos, actuators, belts, of wrenches on
/// links and of forces along tendons is not.
bool RunWatch::knows_work() const {
  const Input& input = simulator_.input();
  return !has_drives(simulator_.model()) && input.wrenches.empty() &&
         input.tendon_force.isZero(0.0);
}

/// Updates the largest opening of the closures; the first call stores their openings at the start.
void RunWatch::look_at_closures(const VectorX& q) {
  const std::vector<Closure>& closures = simulator_.model().closures();
  if (closures.empty() || !simulator_.options().effects.has(Effect::kClosures)) return;
  const bool first = gap_at_start_.empty();
  dynamics_.set_configuration(q);
  for (std::size_t i = 0; i < closures.size(); ++i) {
    const double gap =
        closures[i].switched ? 0.0 : dynamics_.closure_opening(static_cast<int>(i)).largest();
    if (first) {
      gap_at_start_.push_back(gap);
    } else if (gap - gap_at_start_[i] > opened_) {
      opened_ = gap - gap_at_start_[i];
      opened_most_ = static_cast<int>(i);
    }
  }
}

double RunWatch::potential(const VectorX& q) {
  dynamics_.set_configuration(q);
  return dynamics_.potential_energy() + spring_energy(simulator_.model(), q) + springs_.energy(q);
}

double RunWatch::energy(const State& state) {
  dynamics_.set_state(state.q, state.v);
  const double kinetic = dynamics_.kinetic_energy();
  return kinetic + potential(state.q);
}

Vector3 RunWatch::momentum_rows(const VectorX& q, const VectorX& v, int first) {
  dynamics_.set_configuration(q);
  dynamics_.inverse_dynamics(v, momentum_);
  const Vector3 with_weight = momentum_.segment<3>(first);
  rest_.setZero(v.size());
  dynamics_.inverse_dynamics(rest_, momentum_);
  return with_weight - momentum_.segment<3>(first);
}

/// Correction for trees without external contact, whose momentum belongs to the pose at the end of
/// the step.
double RunWatch::center_energy(const State& state) {
  const Model& model = simulator_.model();
  double energy = 0.0;
  for (const int t : simulator_.free_trees()) {
    const Tree& tree = model.trees()[static_cast<std::size_t>(t)];
    if (!is_floating_linkage(model, tree)) continue;
    double mass = 0.0;
    for (int i = tree.body_begin; i < tree.body_end; ++i) mass += model.body(i).inertia.mass;
    energy += 0.5 / mass *
              (momentum_rows(state.q, state.v, tree.v_begin).squaredNorm() -
               momentum_rows(q_moved_, state.v, tree.v_begin).squaredNorm());
  }
  return energy;
}

// With semi-implicit Euler, the kinetic energy of a floating linkage is evaluated at the pose at
// the start of the step, where the step's forces acted: there it changes by their work alone
// (energy_projection.h).
double RunWatch::energy_left(const State& state) {
  if (simulator_.options().integrator != Integrator::kSemiImplicitEuler) return energy(state);
  const Model& model = simulator_.model();
  q_moved_ = state.q;
  for (const Tree& tree : model.trees()) {
    if (!is_floating_linkage(model, tree)) continue;
    for (int i = tree.body_begin; i < tree.body_end; ++i) {
      const auto part = Eigen::seqN(model.body(i).q_index, joint_nq(model.body(i).joint_type));
      q_moved_(part) = q_(part);
    }
  }
  dynamics_.set_state(q_moved_, state.v);
  const double kinetic = dynamics_.kinetic_energy();
  return kinetic + center_energy(state) + potential(state.q);
}

// Semi-implicit Euler moves positions by h (v+ + d) with the overlap correction d. The change of
// potential and spring energy from q (+) h v+ to the final position is the work of d.
void RunWatch::add_overlap_work(double h, const State& state) {
  if (simulator_.options().integrator != Integrator::kSemiImplicitEuler) return;
  if (q_moved_.size() != q_.size()) q_moved_.resize(q_.size());
  const Model& model = simulator_.model();
  integrate_configuration(model, q_, state.v, h, q_moved_);
  for (const int t : simulator_.free_trees()) {
    const int base = model.body(model.trees()[static_cast<std::size_t>(t)].body_begin).q_index;
    q_moved_.segment<3>(base) = state.q.segment<3>(base);
  }
  if ((q_moved_ - state.q).lpNorm<Eigen::Infinity>() < kMoved) return;
  overlap_work_ += potential(state.q) - potential(q_moved_);
}

void RunWatch::after_step(double h, const State& state) {
  // The work of a constant force is h times its power at the mean velocity of the step.
  const VectorX& force = simulator_.input().applied_force;
  work_ += 0.5 * h * force.dot(v_ + state.v);
  path_work_ += h * force.dot(state.v);
  if (q_.size() > 0) add_overlap_work(h, state);
  if (++steps_ % every_ != 0) {
    v_ = state.v;
    q_ = state.q;
    return;
  }
  const double left = energy_left(state);
  v_ = state.v;
  q_ = state.q;
  const double potential_now = potential(q_);
  lowest_ = std::min(lowest_, potential_now);
  highest_potential_ = std::max(highest_potential_, potential_now);
  fastest_ = std::max(fastest_, left - potential_now);
  gain_ = std::max(gain_, left - start_ - work_ - overlap_work_);
  excess_ = std::max(excess_, left - start_ - path_work_ - overlap_work_);
  highest_ = std::max(highest_, left);
  below_ = std::max(below_, below_ground());
  look_at_closures(q_);
}

double RunWatch::below_ground() const {
  const Model& model = simulator_.model();
  double most = 0.0;
  for (const Geometry& plane : model.geometries()) {
    if (plane.shape.type != ShapeType::kPlane || plane.body != 0) continue;
    const Pose X_PW = plane.X_BG.inverse();
    for (std::size_t i = 0; i < model.geometries().size(); ++i) {
      const Geometry& g = model.geometries()[i];
      if (g.body == 0) continue;
      const Pose X_WG = dynamics_.geometry_pose(static_cast<int>(i));
      most = std::max(most, -lowest_point(g.shape, X_PW * X_WG));
    }
  }
  return most;
}

void RunWatch::fill(Json& out) const {
  const bool known = knows_work();
  out["input_work_J"] = known ? Json(work_) : Json(nullptr);
  out["energy_gain_max_J"] = known ? Json(gain_) : Json(nullptr);
  out["energy_excess_J"] = known ? Json(excess_) : Json(nullptr);
  out["overlap_work_J"] = overlap_work_;
  out["energy_max_J"] = highest_;
  out["closure_opened_max_m"] = opened_;
  out["end_below_ground_m"] = below_ground();
  out["below_ground_max_m"] = std::max(below_, below_ground());
}

std::string RunWatch::warning() const {
  std::string text;
  const double moved = fastest_ + highest_potential_ - lowest_;
  const double gain = std::min(gain_, excess_);
  if (knows_work() && gain > kGained * moved)
    text = fmt::format(
        "the energy rose by {:.3g} J more than anything gave, of {:.3g} J that were moved: a "
        "shorter time step (--timestep) makes less",
        gain, moved);
  if (opened_ > kOpened) {
    const Closure& closure = simulator_.model().closures()[static_cast<std::size_t>(opened_most_)];
    text += fmt::format("{}closure '{}' came open by {:.3g} m", text.empty() ? "" : "; ",
                        closure.name, opened_);
  }
  return text;
}

}  // namespace counterpoint::apps
