#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/dynamics/crba.h"
#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/estimate/contact_effects.h"
#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::estimation {
namespace {

/// Compliance of the contacts; this fraction of a force stays unexplained even if contacts could
/// exert it.
constexpr double kCompliance = 1e-8;

SimulationOptions without_contacts(SimulationOptions options) {
  for (const Effect effect : {Effect::kContacts, Effect::kClosures, Effect::kSleeping})
    options.effects.set(effect, false);
  options.integrator = Integrator::kSemiImplicitEuler;
  return options;
}

/// Options under which every contact within `reach` [m] may push, whatever its velocity.
SimulationOptions with_reach(SimulationOptions options, double reach) {
  options.contact.margin = reach;
  options.contact.reach_acceleration = std::numeric_limits<double>::infinity();
  options.contact.friction_model = FrictionModel::kConvex;
  options.contact.compliance = kCompliance;
  options.contact.smoothing = 0.0;
  return options;
}

}  // namespace

struct Explainer::Impl {
  Impl(const Scene& s, const ColumnMap& map, double reach_)
      : model(s.model),
        free(without_contacts(s.options)),
        contact(with_reach(s.options, reach_)),
        reach(reach_),
        workspace(model),
        data(model),
        finder(model, compute_inverse_weights(model, data)),
        effects(contact_effects(model, finder.collider())),
        inputs(map.input_columns),
        counts(model.nv(), 0) {
    for (int i = 1; i < model.num_bodies(); ++i) {
      const Body& body = model.body(i);
      for (int k = 0; k < joint_nv(body.joint_type); ++k)
        counts[body.v_index + k] = !model.joint(i - 1).actuated;
    }
    weight = total_mass(model) * model.gravity().norm();
    for (const ColumnMap::Entry& entry : map.entries)
      if (entry.kind == ColumnMap::Entry::Kind::kForce) counts[entry.index] = 1;
  }

  double tree_weight(int body) const {
    const Tree& tree = model.trees()[model.body(body).tree];
    double mass = 0.0;
    for (int i = tree.body_begin; i < tree.body_end; ++i) mass += model.body(i).inertia.mass;
    return mass * model.gravity().norm();
  }

  Model model;
  SimulationOptions free, contact;
  double reach;
  Workspace workspace;
  Data data;
  ConstraintFinder finder;
  EffectSet effects;
  InputColumns inputs;  ///< recorded ones
  std::vector<char> counts;
  double weight = 0.0;
  Inverse inverse;
  struct {
    VectorX q, v, v_next;
    Input known;
  } last;  ///< arguments of the last explained step
  ConstraintSet constraints;
  std::vector<int> block_of_tree;
  contact::Problem assembled, problem;
  contact::Solver solver;

  void find_contacts(const VectorX& q, const VectorX& v, double interval);
  bool pose_problem(const VectorX& impulse);
};

void Explainer::Impl::find_contacts(const VectorX& q, const VectorX& v, double interval) {
  contact.time_step = interval;
  find_all_constraints({model, contact, effects, q, v, model.default_z()}, finder, data,
                       constraints);
  const size_t contacts = constraints.contacts.size();
  std::vector<PairConstraint> pairs;
  std::vector<collision::Candidate> candidates;
  for (size_t i = 0; i < constraints.pairs.size(); ++i) {
    if (i < contacts && !(constraints.contacts[i].gap <= reach)) continue;
    if (i < contacts) candidates.push_back(constraints.contacts[i]);
    pairs.push_back(constraints.pairs[i]);
    contact::Law& law = pairs.back().law;
    if (i < contacts)
      law.bias[0] = 0.0;  // belts keep their velocity
    else
      law.bias.fill(0.0);
    // Undo the friction reduction of spinning patches: it does not apply to bounces, and whether a
    // contact bounces is not known here.
    for (size_t k = 0; k < 2; ++k) law.friction[k] /= pairs.back().strength;
  }
  constraints.contacts = candidates;
  constraints.pairs = pairs;
  constraints.joints.clear();
}

/// Builds the problem over the coordinates whose force counts as unexplained: w such that M w = J'
/// f - impulse, f within the cones. Returns false if a touched tree has no such coordinate: its
/// motors may have exerted any force.
bool Explainer::Impl::pose_problem(const VectorX& impulse) {
  assemble_problem(model, constraints, VectorX::Zero(model.nv()), model.armature(), data,
                   block_of_tree, assembled);
  problem.clear();
  std::vector<std::vector<int>> kept(assembled.num_blocks());
  for (int t = 0; t < model.num_trees(); ++t) {
    const int block = block_of_tree[t];
    if (block < 0) continue;
    const Tree& tree = model.trees()[t];
    for (int k = tree.v_begin; k < tree.v_end; ++k)
      if (counts[k]) kept[block].push_back(k - tree.v_begin);
    const std::vector<int>& columns = kept[block];
    if (columns.empty()) return false;
    const MatrixX M = MatrixX(std::as_const(assembled).mass(block))(columns, columns);
    const VectorX p = VectorX(impulse.segment(tree.v_begin, tree.v_end - tree.v_begin))(columns);
    const int added = problem.add_block(static_cast<int>(columns.size()));
    problem.mass(added) = M;
    const VectorX free_velocity = -M.llt().solve(p);
    problem.free_velocity().segment(problem.block_start(added), free_velocity.size()) =
        free_velocity;
  }
  for (int c = 0; c < assembled.num_constraints(); ++c) {
    const int added =
        problem.add_constraint(assembled.law(c), assembled.block(c, 0), assembled.block(c, 1));
    for (int side = 0; side < 2 && assembled.block(c, side) >= 0; ++side) {
      const MatrixX J = std::as_const(assembled).jacobian(c, side);
      problem.jacobian(added, side) = J(Eigen::all, kept[assembled.block(c, side)]);
    }
  }
  return true;
}

Explainer::Explainer(const Scene& scene, const ColumnMap& map, double reach)
    : impl_(std::make_unique<Impl>(scene, map, reach)) {}
Explainer::~Explainer() = default;
VectorX Explainer::scales() const {
  const Impl& s = *impl_;
  VectorX out = VectorX::Zero(s.model.nv());
  for (int i = 1; i < s.model.num_bodies(); ++i) {
    const Body& body = s.model.body(i);
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k)
      out[k] = s.counts[k] ? 1.0 : 0.0;
    if (body.joint_type != JointType::kFloating) continue;
    const double weight = s.tree_weight(i), length = s.finder.radii()[i];
    if (!(weight > 0.0)) continue;
    out.segment<3>(body.v_index) /= weight;
    out.segment<3>(body.v_index + 3) /= weight * (length > 0.0 ? length : 1.0);
  }
  return out;
}

Explanation Explainer::explain(const Recording& recording, int row, double interval) {
  Impl& s = *impl_;
  s.last.q = recording.q.col(row);
  s.last.v = recording.v.col(row);
  s.last.v_next = recording.v.col(row + 1);
  s.free.time_step = interval;
  if (recording.inputs.cols() > 0) s.inputs.set(s.model, recording.inputs.col(row), s.last.known);
  step_inverse(s.model, s.free, s.last.q, s.last.v, s.last.v_next, s.last.known, s.workspace,
               s.inverse);
  if (s.inverse.fault.any())
    throw InputError(fmt::format("{}: row {}: {}", recording.file, row,
                                 describe(s.model, s.inverse.fault).reason));
  Explanation out;
  out.force = s.inverse.applied_force - recording.applied_force.col(row);
  s.find_contacts(s.last.q, s.last.v, interval);
  out.contacts = static_cast<int>(s.constraints.contacts.size());
  if (!s.constraints.pairs.empty() && s.pose_problem(interval * out.force)) {
    VectorX w = s.problem.free_velocity(), impulse(s.problem.num_rows());
    contact::Settings settings;
    settings.tolerance = kCompliance;  // the round-off of velocities over the compliance allows no
                                       // smaller tolerance
    settings.soften_after = 0;  // the force lost by softer contacts would count as unexplained
    const contact::Report& solved = s.solver.solve(s.problem, settings, w, impulse);
    if (!contact::succeeded(solved.status))
      throw std::runtime_error(fmt::format("{}: row {}: contact forces: {}", recording.file, row,
                                           contact::status_name(solved.status)));
    // Subtract the contact forces from all coordinates.
    for (int c = 0; c < s.assembled.num_constraints(); ++c) {
      const auto f = impulse.segment(s.problem.first_row(c), s.problem.law(c).rows);
      if (c < out.contacts) out.contact_force += f[0] / interval / s.weight;
      for (int t = 0; t < s.model.num_trees(); ++t)
        for (int side = 0; side < 2; ++side)
          if (s.block_of_tree[t] >= 0 && s.block_of_tree[t] == s.assembled.block(c, side)) {
            const Tree& tree = s.model.trees()[t];
            out.force.segment(tree.v_begin, tree.v_end - tree.v_begin) -=
                std::as_const(s.assembled).jacobian(c, side).transpose() * f / interval;
          }
    }
  }
  for (int i = 1; i < s.model.num_bodies(); ++i) {
    const Body& body = s.model.body(i);
    const auto force = out.force.segment(body.v_index, joint_nv(body.joint_type));
    if (!s.counts[body.v_index]) continue;
    if (body.joint_type == JointType::kFloating) {
      const double weight = s.tree_weight(i), length = s.finder.radii()[i];
      out.unexplained_force = std::max(out.unexplained_force, force.head<3>().norm() / weight);
      if (length > 0.0)
        out.unexplained_torque =
            std::max(out.unexplained_torque, force.tail<3>().norm() / (weight * length));
    } else {
      out.unexplained_joint = std::max(out.unexplained_joint, force.cwiseAbs().maxCoeff());
    }
  }
  return out;
}

bool Explainer::derive(ParameterDerivator& derivator, InverseParameterDerivatives& out) {
  Impl& s = *impl_;
  if (!s.constraints.pairs.empty()) return false;
  derivator.inverse(s.model, s.free, s.last.q, s.last.v, s.last.v_next, s.last.known, s.workspace,
                    s.inverse, out);
  return true;
}

ExplainedRecording explain_recording(Explainer& explainer, const ColumnMap& map,
                                     const Recording& recording,
                                     const std::function<bool()>& stop) {
  ExplainedRecording out;
  out.file = recording.file;
  out.rows = recording.num_rows();
  for (int row = 0; row + 1 < out.rows; ++row) {
    out.stopped = stop && stop();
    if (out.stopped) return out;
    out.time.push_back(recording.time[row]);
    out.steps.push_back(explainer.explain(recording, row, row_interval(map, recording, row)));
  }
  const auto add = [&](const char* mean, const char* middle, const char* most,
                       double Explanation::*metric) {
    std::vector<double> values;
    double sum = 0.0;
    for (const Explanation& step : out.steps) {
      values.push_back(step.*metric);
      sum += values.back();
    }
    out.metrics.emplace_back(mean, sum / static_cast<double>(values.size()));
    out.metrics.emplace_back(middle, median(values));
    out.metrics.emplace_back(most, *std::max_element(values.begin(), values.end()));
  };
  add("unexplained_force_mean", "unexplained_force_median", "unexplained_force_max",
      &Explanation::unexplained_force);
  add("unexplained_torque_mean", "unexplained_torque_median", "unexplained_torque_max",
      &Explanation::unexplained_torque);
  add("unexplained_joint_mean", "unexplained_joint_median", "unexplained_joint_max",
      &Explanation::unexplained_joint);
  add("contact_force_mean", "contact_force_median", "contact_force_max",
      &Explanation::contact_force);
  return out;
}

std::vector<CoordinateMetrics> force_metrics(const Explainer& explainer, const Model& model,
                                             const std::vector<const Recording*>& recordings,
                                             const std::vector<ExplainedRecording>& explained) {
  const VectorX scales = explainer.scales();
  const CoordinateNames names = coordinate_names(model);
  size_t steps = 0;
  for (const ExplainedRecording& one : explained) steps += one.steps.size();
  std::vector<CoordinateMetrics> out;
  for (Eigen::Index i = 0; i < scales.size(); ++i) {
    if (!(scales[i] > 0.0)) continue;
    VectorX left(static_cast<Eigen::Index>(steps)), recorded(left.size());
    Eigen::Index at = 0;
    for (size_t r = 0; r < recordings.size(); ++r) {
      for (size_t k = 0; k < explained[r].steps.size(); ++k, ++at) {
        left[at] = explained[r].steps[k].force[i];
        recorded[at] = recordings[r]->applied_force(i, static_cast<Eigen::Index>(k));
      }
    }
    out.push_back(coordinate_metrics(names.force[i], left, recorded));
  }
  return out;
}

}  // namespace counterpoint::estimation
