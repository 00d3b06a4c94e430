#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/constraints/assemble.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/dynamics/crba.h"
#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/estimate/contact_effects.h"
#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {
namespace {

/// Contact points whose gap exceeds the smallest of a pair by less than this are kept too [m].
constexpr double kTie = 1e-6;
/// Time step [s]; the contact law at an impact uses only its sign, for restitution.
constexpr double kInstant = 1e-9;

}  // namespace

struct ImpactSolver::Impl {
  explicit Impl(const Scene& s)
      : model(s.model),
        options(s.options),
        data(model),
        finder(model, compute_inverse_weights(model, data)),
        effects(contact_effects(model, finder.collider())),
        mass(total_mass(model)) {
    options.time_step = kInstant;
    options.integrator = Integrator::kSemiImplicitEuler;
    options.contact.reach_acceleration = std::numeric_limits<double>::infinity();
  }

  void find(const VectorX& q, const VectorX& v);
  void touch();

  Model model;
  SimulationOptions options;
  Data data;
  ConstraintFinder finder;
  EffectSet effects;
  double mass;
  ConstraintSet constraints;
  std::vector<int> block_of_tree;
  contact::Problem problem;
  contact::Solver solver;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> inertia;
  Impact impact;
};

void ImpactSolver::Impl::find(const VectorX& q, const VectorX& v) {
  find_all_constraints({model, options, effects, q, v, model.default_z()}, finder, data,
                       constraints);
  touch();
}

/// Keeps the nearest points of each pair of geometries, on the surface of the lighter body, with
/// the law of a closed contact.
void ImpactSolver::Impl::touch() {
  std::map<std::pair<int, int>, double> nearest;
  for (const collision::Candidate& c : constraints.contacts) {
    auto [it, added] = nearest.try_emplace({c.geometry_a, c.geometry_b}, c.gap);
    if (!added) it->second = std::min(it->second, c.gap);
  }
  std::vector<collision::Candidate> contacts;
  std::vector<PairConstraint> pairs;
  for (size_t i = 0; i < constraints.pairs.size(); ++i) {
    PairConstraint pair = constraints.pairs[i];
    if (i >= constraints.contacts.size()) {
      pair.law.bias.fill(0.0);
      pairs.push_back(pair);
      continue;
    }
    const collision::Candidate& c = constraints.contacts[i];
    if (c.gap > options.contact.margin || c.gap > nearest[{c.geometry_a, c.geometry_b}] + kTie)
      continue;
    const double alpha =
        finder.weights().contact[pair.body_a] + finder.weights().contact[pair.body_b];
    // Moves the point for overlaps, as ContactFinder::move_to_meeting does for open gaps.
    const double towards_b = finder.weights().contact[pair.body_b] / alpha - 0.5;
    pair.position += towards_b * std::min(c.gap, 0.0) * c.normal;
    pair.first = 0;
    pair.law.rows = 3;
    const Vector3 belt(0.0, pair.law.bias[1], pair.law.bias[2]);
    const Vector3 v = relative_velocity(pair, data, data.V).head<3>() + belt;
    const Material surface = model.pair_material(c.geometry_a, c.geometry_b).without_direction();
    Bounce bounce = find_bounce(Integrator::kSemiImplicitEuler, true, kInstant, surface.restitution,
                                0.0, v[0], 0.0);
    for (int k = 0; k < 2; ++k) bounce.slide[k] = v[k + 1];
    pair.law = make_contact_law(LawOptions{options.contact}, kInstant,
                                {surface, alpha, 0.0, 0.0, v, bounce});
    for (int k = 1; k < std::min(pair.law.rows, 3); ++k) pair.law.bias[k] = belt[k];
    contacts.push_back(c);
    pairs.push_back(pair);
  }
  constraints.contacts = contacts;
  constraints.pairs = pairs;
  constraints.joints.clear();
}

ImpactSolver::ImpactSolver(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
ImpactSolver::~ImpactSolver() = default;

const Impact& ImpactSolver::solve(const VectorX& q, const VectorX& v) {
  Impl& s = *impl_;
  s.find(q, v);
  Impact& out = s.impact;
  out.v = v;
  out.contacts = static_cast<int>(s.constraints.contacts.size());
  s.inertia.resize(s.model.nv(), s.model.nv());
  crba(s.model, s.data, s.inertia);
  s.inertia.diagonal() += s.model.armature();
  out.energy_before = 0.5 * v.dot(s.inertia * v);
  if (!s.constraints.pairs.empty()) {
    assemble_problem(s.model, s.constraints, v, s.model.armature(), s.data, s.block_of_tree,
                     s.problem);
    VectorX w = s.problem.free_velocity(), impulse(s.problem.num_rows());
    const contact::Report& solved = s.solver.solve(s.problem, {}, w, impulse);
    if (!contact::succeeded(solved.status))
      throw std::runtime_error(
          fmt::format("the impact is not solved: {}", contact::status_name(solved.status)));
    for (int t = 0; t < s.model.num_trees(); ++t) {
      if (s.block_of_tree[t] < 0) continue;
      const Tree& tree = s.model.trees()[t];
      const int size = tree.v_end - tree.v_begin;
      out.v.segment(tree.v_begin, size) =
          w.segment(s.problem.block_start(s.block_of_tree[t]), size);
    }
  }
  out.energy = 0.5 * out.v.dot(s.inertia * out.v);
  return out;
}

VectorX ImpactSolver::weighted(const VectorX& difference) const {
  return impl_->inertia.llt().matrixU() * difference / std::sqrt(impl_->mass);
}

}  // namespace counterpoint::estimation
