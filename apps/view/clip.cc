#include "view/clip.h"

#include <cmath>

#include "counterpoint/engine/dynamics.h"

namespace counterpoint::view {

std::vector<char> trees_at_rest(const Model& model, const State& before, const State& after) {
  std::vector<char> rest;
  for (const Tree& tree : model.trees()) {
    const CoordinateRange range = coordinates(model, tree);
    const int nv = tree.v_end - tree.v_begin;
    rest.push_back(before.q.segment(range.begin, range.size) ==
                       after.q.segment(range.begin, range.size) &&
                   before.v.segment(tree.v_begin, nv) == after.v.segment(tree.v_begin, nv));
  }
  return rest;
}

/// Index of the frame at `time` [s]. Times are sums of steps: a frame counts as due up to a
/// millionth of a frame early.
double FrameClock::position(double time) const { return (time - *start_) * rate_ + 1e-6; }

bool FrameClock::due(double time) {
  if (!start_) start_ = time;
  const double frame = position(time);
  if (rate_ > 0.0 && frame < next_) return false;
  next_ = std::floor(frame) + 1.0;
  return true;
}

void FrameClock::halve(double last) {
  rate_ *= 0.5;
  next_ = std::floor(position(last)) + 1.0;
}

ClipRecorder::ClipRecorder(const Scene& scene, double rate, bool forces, int most)
    : scene_(scene),
      options_(scene.options),
      clock_(rate),
      forces_(forces && scene.options.integrator != Integrator::kRungeKutta4),
      most_(most),
      workspace_(scene.model) {
  clip_.has_contacts = forces_;
}

void ClipRecorder::thin_out() {
  const auto every_other = [](auto& forces) {
    std::erase_if(forces, [](const auto& force) { return force.frame % 2 == 1; });
    for (auto& force : forces) force.frame /= 2;
  };
  every_other(clip_.contacts);
  every_other(clip_.closure_forces);
  const int kept = (clip_.num_frames() + 1) / 2;
  for (int k = 1; k < kept; ++k) {
    clip_.states[k] = std::move(clip_.states[2 * k]);
    clip_.applied_force[k] = std::move(clip_.applied_force[2 * k]);
    clip_.asleep[k] = std::move(clip_.asleep[2 * k]);
    if (!clip_.newton_iterations.empty())
      clip_.newton_iterations[k] = clip_.newton_iterations[2 * k];
  }
  clip_.states.resize(kept);
  clip_.applied_force.resize(kept);
  clip_.asleep.resize(kept);
  if (!clip_.newton_iterations.empty()) clip_.newton_iterations.resize(kept);
  clock_.halve(clip_.states.back().time);
}

void ClipRecorder::add_frame(const State& state, const VectorX& force) {
  clip_.states.push_back(state);
  clip_.applied_force.push_back(force);
}

void ClipRecorder::add_contacts(const State& before, const Input& input, double h,
                                const State& after) {
  if (!forces_) return;
  options_.time_step = h;
  Input known = input;
  if (before.z.size() > 0) known.z = before.z;
  step_inverse(scene_.model, options_, before.q, before.v, after.q, after.v, known, workspace_,
               inverse_);
  if (inverse_.fault.any()) return;
  if (finds_applied_) clip_.applied_force.back() = inverse_.applied_force;
  for (const ContactForce& contact : inverse_.contacts)
    clip_.contacts.push_back({clip_.num_frames() - 1, contact.contact.geometry_a,
                              contact.contact.geometry_b, contact.contact.position, contact.force});
  for (size_t i = 0; i < inverse_.closures.size(); ++i)
    clip_.closure_forces.push_back({clip_.num_frames() - 1, static_cast<int>(i),
                                    inverse_.closures[i].position,
                                    inverse_.closures[i].force.force});
}

void ClipRecorder::add_step(const State& before, const Input& input, double h, const State& after,
                            int newton_iterations) {
  ++clip_.rows;
  before_ = before;
  after_ = after;
  input_ = input;
  h_ = h;
  if (!clock_.due(before.time)) return;
  if (most_ > 0 && clock_.rate() > 0.0 && clip_.num_frames() >= most_) {
    thin_out();
    if (!clock_.due(before.time)) return;
  }
  add_frame(before, input.applied_force);
  if (newton_iterations >= 0) clip_.newton_iterations.push_back(newton_iterations);
  clip_.asleep.push_back(trees_at_rest(scene_.model, before, after));
  add_contacts(before, input, h, after);
}

Clip ClipRecorder::finish(const State& last) {
  const bool stepped = clip_.rows++ > 0;
  add_frame(last, VectorX());
  if (!clip_.newton_iterations.empty())
    clip_.newton_iterations.push_back(clip_.newton_iterations.back());
  clip_.asleep.push_back(stepped ? trees_at_rest(scene_.model, before_, after_)
                                 : std::vector<char>(scene_.model.num_trees(), 0));
  if (stepped) add_contacts(before_, input_, h_, after_);
  return std::move(clip_);
}

Clip clip_of(const Scene& scene, const Trajectory& trajectory,
             const std::vector<double>& step_lengths, double rate, bool forces,
             const std::function<bool(int)>& progress) {
  const auto state = [&](int row) {
    return State{trajectory.time[row], trajectory.q.col(row), trajectory.v.col(row)};
  };
  ClipRecorder recorder(scene, rate, forces);
  Input input;
  int k = 0;
  for (bool on = true; k < trajectory.num_steps() && on; ++k) {
    trajectory.columns.set(scene.model, trajectory.known.col(k), input);
    input.applied_force.resize(0);
    if (trajectory.applied_force.size() > 0) input.applied_force = trajectory.applied_force.col(k);
    const double h =
        step_lengths.empty() ? trajectory.time[k + 1] - trajectory.time[k] : step_lengths[k];
    recorder.add_step(state(k), input, h, state(k + 1));
    if (progress) on = progress(k + 1);
  }
  return recorder.finish(state(k));
}

Clip clip_of_frames(const Scene& scene, double start, const std::vector<VectorX>& q, double rate) {
  const Model& model = scene.model;
  const double h = scene.options.time_step;
  std::vector<State> states;
  for (size_t t = 0; t < q.size(); ++t) {
    states.push_back({start + static_cast<double>(t) * h, q[t], VectorX::Zero(model.nv())});
    if (t == 0) continue;
    configuration_difference(model, q[t - 1], q[t], states[t].v);
    states[t].v /= h;
  }
  if (q.size() > 1) states[0].v = states[1].v;
  ClipRecorder recorder(scene, rate, true);
  recorder.find_applied_forces();
  for (size_t t = 0; t + 1 < q.size(); ++t) recorder.add_step(states[t], Input(), h, states[t + 1]);
  return recorder.finish(states.back());
}

}  // namespace counterpoint::view
