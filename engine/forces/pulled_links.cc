// The links that heavy loads may pull, from the model only: readers of trajectories need them too.
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "counterpoint/contact/disjoint_sets.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/forces/taut_links.h"

namespace counterpoint {
namespace {

/// Links loaded by up to this multiple of their mass stay as they are: at steps of 5 ms, h times
/// the rate is 1.5 in chains loaded by 100 times a link's mass, and robots, which turn fast, are
/// not changed.
constexpr double kHeavier = 100.0;

/// Links are left out if a pull of kPull times the load's weight turns them at a rate below
/// kSlowest [1/s], which steps of 5 ms resolve.
constexpr double kSlowest = 200.0, kPull = 30.0;
constexpr double kGravity = 9.81;    // [m/s^2]; used for models without gravity too
constexpr double kLeastMass = 1e-9;  // [kg]; lighter links are frames

/// Where, and by how much mass, a link may be pulled.
struct Pulled {
  double arm = 0.0;   ///< distance of the farthest attachment from the centre of mass [m]
  double load = 0.0;  ///< largest mass that may pull at it [kg]

  void add(const Vector3& place, const Vector3& center) {
    arm = std::max(arm, (place - center).norm());
  }
};

double subtree_mass(const Model& model, int body) {
  double mass = 0.0;
  for (int i = body; i < model.body(body).subtree_end; ++i) mass += model.body(i).inertia.mass;
  return mass;
}

double tree_mass(const Model& model, const Tree& tree) {
  double mass = 0.0;
  for (int i = tree.body_begin; i < tree.body_end; ++i) mass += model.body(i).inertia.mass;
  return mass;
}

/// Sets the loads of the bodies between a closure's anchors: the mass of all trees joined there.
void load_by_closures(const Model& model, std::vector<Pulled>& pulled) {
  contact::DisjointSets joined;
  joined.reset(model.num_trees());
  for (const Closure& closure : model.closures()) {
    const int a = model.body(closure.body_a).tree, b = model.body(closure.body_b).tree;
    if (a >= 0 && b >= 0) joined.join(a, b);
  }
  std::vector<double> mass(static_cast<size_t>(model.num_trees()), 0.0);
  for (int t = 0; t < model.num_trees(); ++t)
    mass[static_cast<size_t>(joined.root(t))] += tree_mass(model, model.trees()[t]);
  for (const Closure& closure : model.closures()) {
    int a = closure.body_a, b = closure.body_b;
    for (const auto& [body, X] : {std::pair{a, closure.X_AC}, std::pair{b, closure.X_BC}})
      if (body != 0)
        pulled[static_cast<size_t>(body)].add(X.translation, model.body(body).inertia.center);
    while (a != b) {  // up to their common ancestor
      int& lower = a > b ? a : b;
      double& load = pulled[static_cast<size_t>(lower)].load;
      load = std::max(load, mass[static_cast<size_t>(joined.root(model.body(lower).tree))]);
      lower = model.body(lower).parent;
    }
  }
}

/// Sets the loads of links in trees: the mass of their descendants, or of a heavy tree that rests
/// on them.
void load_by_joints(const Model& model, std::vector<Pulled>& pulled) {
  double heaviest = 0.0;
  for (const Tree& tree : model.trees()) heaviest = std::max(heaviest, tree_mass(model, tree));
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    Pulled& link = pulled[static_cast<size_t>(i)];
    const bool floats = body.joint_type == JointType::kFloating;
    if (!floats) link.add(Vector3::Zero(), body.inertia.center);
    if (body.parent != 0)
      pulled[static_cast<size_t>(body.parent)].add(body.X_PJ.translation,
                                                   model.body(body.parent).inertia.center);
    const Tree& tree = model.trees()[body.tree];
    const double all = tree_mass(model, tree), outer = subtree_mass(model, i);
    double load = outer - body.inertia.mass;
    if (model.body(tree.body_begin).joint_type == JointType::kFloating)
      load = std::min(load, all - outer);
    if (heaviest > kPull * all) load = std::max(load, heaviest);
    link.load = std::max(link.load, load);
  }
}

}  // namespace

std::vector<int> list_pulled_links(const Model& model) {
  std::vector<Pulled> pulled(static_cast<size_t>(model.num_bodies()));
  load_by_joints(model, pulled);
  load_by_closures(model, pulled);
  std::vector<int> links;
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Pulled& link = pulled[static_cast<size_t>(i)];
    if (!(model.body(i).inertia.mass > kLeastMass)) continue;
    const Matrix3& inertia = model.body(i).inertia.rotational;
    const double across = Eigen::SelfAdjointEigenSolver<Matrix3>(inertia).eigenvalues()[1];
    if (!(link.load > kHeavier * model.body(i).inertia.mass)) continue;
    if (kPull * link.load * kGravity * link.arm > kSlowest * kSlowest * across) links.push_back(i);
  }
  return links;
}

}  // namespace counterpoint
