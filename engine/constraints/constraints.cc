#include "counterpoint/engine/constraints/constraints.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/constraints/closures.h"
#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/constraints/joint_limits.h"
#include "counterpoint/engine/constraints/parked_contacts.h"
#include "counterpoint/engine/constraints/velocity_limits.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/rotation.h"

namespace counterpoint {
namespace {

/// Radius [m] about the geometry frame's origin that holds the whole shape.
double bounding_radius(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kPlane:
    case ShapeType::kTerrain:
      return 0.0;  // fixed to the world
    case ShapeType::kSphere:
      return shape.size.x();
    case ShapeType::kBox:
      return shape.size.norm();
    case ShapeType::kCapsule:
      return shape.size.x() + shape.size.y();
    case ShapeType::kCylinder:
      return std::hypot(shape.size.x(), shape.size.y());
    case ShapeType::kConvexMesh: {
      double radius = 0.0;
      for (const Vector3& v : shape.mesh->vertices) radius = std::max(radius, v.norm());
      return radius;
    }
  }
  return 0.0;
}

/// Whether bodies differ so much in mass that contacts look at what they may carry.
bool differ_much(const std::vector<double>& weight) {
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const double w : weight) {
    if (!(w > 0.0)) continue;
    least = std::min(least, w);
    most = std::max(most, w);
  }
  return most > kHeaviest * least;
}

std::vector<double> body_radii(const Model& model) {
  std::vector<double> radius(model.num_bodies(), 0.0);
  for (const Geometry& g : model.geometries())
    radius[g.body] = std::max(radius[g.body], g.X_BG.translation.norm() + bounding_radius(g.shape));
  return radius;
}

/// A rod hit at one end: the far end may be twice as fast as any point was before. The kinetic
/// energy bounds it, and the end of a rod carries a quarter of the mass.
constexpr double kImpactSpeedUp = 2.0;
/// Bodies that travel farther than this many times the reach of what rests pass their speed on to
/// what they strike in the very step, as far as this many rounds of collision reach.
constexpr double kFastTravel = 4.0;
constexpr int kMaxRounds = 4;

/// One row a coordinate: it takes up to the bound and yields beyond.
void find_dry_friction(const Model& model, const SimulationOptions& options,
                       const std::vector<DryCoordinate>& coordinates, const InverseWeights& weights,
                       Idle idle, ConstraintSet& out) {
  for (const auto& [i, body] : coordinates) {
    if (idle(body)) continue;
    JointConstraint row;
    row.effect = Effect::kDryFriction;
    row.law = make_dry_friction_law(options.contact, options.time_step, weights.dof[i],
                                    model.dry_friction()[i]);
    row.v_index[0] = i;
    out.joints.push_back(row);
  }
}

void find_mimics(const Model& model, const SimulationOptions& options, const VectorRef& q,
                 const InverseWeights& weights, Idle idle, ConstraintSet& out) {
  for (const Mimic& mimic : model.mimics()) {
    if (idle(mimic.joint + 1)) continue;  // and so is the master, of the same island
    const Body& follower = model.body(mimic.joint + 1);
    const Body& master = model.body(mimic.master + 1);
    const double error = mimic_error(model, mimic, q);
    const double alpha = weights.dof[follower.v_index] +
                         mimic.multiplier * mimic.multiplier * weights.dof[master.v_index];
    JointConstraint row;
    row.effect = Effect::kMimics;
    row.law = make_mimic_law(options.contact, options.time_step, alpha, error);
    row.v_index[0] = follower.v_index;
    row.v_index[1] = master.v_index;
    row.coefficient[1] = -mimic.multiplier;
    out.joints.push_back(row);
  }
}

}  // namespace

ConstraintFinder::ConstraintFinder(const Model& model, InverseWeights weights)
    : weights_(std::move(weights)),
      collider_(model),
      radius_(body_radii(model)),
      travel_(model.num_bodies(), 0.0),
      slack_(model.num_bodies(), 0.0),
      margin_(model.num_bodies(), 0.0),
      heavy_on_light_(differ_much(weights_.contact)),
      fall_(free_fall(model)),
      friction_slip_(model),
      limited_(list_limited_bodies(model)),
      speed_limits_(list_speed_limits(model)),
      acceleration_(model.closures().empty() ? 0 : model.num_bodies()),
      V_(model.num_bodies()),
      turn_(model.num_bodies()),
      turn_known_(model.num_bodies(), 0) {
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k)
      if (model.dry_friction()[k] > 0.0) dry_.push_back({k, i});
  }
}

void ConstraintFinder::find(const Model& model, const SimulationOptions& options, EffectSet effects,
                            const VectorRef& q, const VectorRef& v, const Data& data,
                            ConstraintSet& out, EffectCounts& counts, Idle idle) {
  out.clear();
  speed_.clear();
  const auto runs = [&](Effect effect) {
    if (!effects.has(effect)) return false;
    counts.add(effect);
    return true;
  };
  if (runs(Effect::kContacts)) find_contacts(model, options, effects, data, out, counts, idle);
  if (runs(Effect::kClosures))
    find_closures(model, options, data, weights_, idle, acceleration_, out);
  if (heavy_on_light_) stiffen_under_load(model, out);
  if (runs(Effect::kLimits)) find_joint_limits(model, options, limited_, q, v, weights_, idle, out);
  if (runs(Effect::kVelocityLimits))
    find_velocity_limits(options, speed_limits_, v, weights_, idle, out);
  if (runs(Effect::kDryFriction)) find_dry_friction(model, options, dry_, weights_, idle, out);
  if (runs(Effect::kMimics)) find_mimics(model, options, q, weights_, idle, out);
  friction_slip_.set(model, options, speed_, out);
}

bool ConstraintFinder::find_overrun(const Model& model, const SimulationOptions& options,
                                    EffectSet effects, const VectorRef& q, const VectorRef& v,
                                    const VectorRef& w, const Data& data, ConstraintSet& out,
                                    Idle idle) {
  const bool limits = effects.has(Effect::kLimits) &&
                      find_overrun_limits(model, options, limited_, q, v, w, weights_, idle, out);
  return find_reached_contacts(model, options, w, data, out) || limits;
}

bool ConstraintFinder::find_reached_contacts(const Model& model, const SimulationOptions& options,
                                             const VectorRef& w, const Data& data,
                                             ConstraintSet& out) {
  if (out.parked.empty()) return false;
  compute_body_velocities(model, w, data, V_);
  return find_overrun_contacts(options.contact, options.time_step, data, V_, out);
}

void ConstraintFinder::find_candidates(const Model& model, const SimulationOptions& options,
                                       EffectSet effects, const Data& data, Idle idle) {
  const double h = options.time_step;
  const double fall = effects.has(Effect::kGravity) ? h * h * model.gravity().norm() : 0.0;
  const double reach = resting_reach(options.contact, h);
  slack_[0] = 0.5 * reach;
  for (const Tree& tree : model.trees()) {
    double fastest = 0.0;
    for (int b = tree.body_begin; b < tree.body_end; ++b) {
      const double speed = data.V[b].linear.norm() + data.V[b].angular.norm() * radius_[b];
      fastest = std::max(fastest, speed);
      travel_[b] = kImpactSpeedUp * h * speed;
    }
    // What is at rest may be kicked by an impact elsewhere in its tree.
    for (int b = tree.body_begin; b < tree.body_end; ++b) {
      const double kick = std::max(0.0, h * fastest - travel_[b]);
      slack_[b] = 0.5 * std::min(options.contact.margin, reach + 2.0 * kick);
      travel_[b] += fall;
    }
  }
  const auto set_margins = [&] {
    for (int b = 0; b < model.num_bodies(); ++b) margin_[b] = slack_[b] + travel_[b];
  };
  const double fast = kFastTravel * reach, own_fast = kFastTravel * options.contact.margin;
  const double least = model.num_trees() == 1 ? own_fast : fast;
  const bool any_fast =
      std::any_of(travel_.begin(), travel_.end(), [&](double travel) { return !(travel < least); });
  set_margins();
  for (int round = 0; any_fast && round < kMaxRounds; ++round) {
    const auto close = collider_.find_close_pairs(data.X_WB, margin_, idle.bodies);
    if (!spread_travel(model, close, fast, own_fast)) break;
    set_margins();
  }
  collider_.compute_candidates(data.X_WB, margin_, candidates_, travel_, idle.bodies,
                               {data.V, weights_.contact, h});
}

/// Gives bodies that a fast one may strike within the step its travel, and all of their trees: they
/// may go as fast. close: pairs of geometries. False if none is that fast (threshold [m]; for the
/// fast one's own tree, whose slack knows of impacts elsewhere in it, own_threshold), or nothing
/// changed.
bool ConstraintFinder::spread_travel(const Model& model, std::span<const std::pair<int, int>> close,
                                     double threshold, double own_threshold) {
  bool changed = false;
  for (bool again = true; again;) {
    again = false;
    for (const auto& [a, b] : close) {
      const int bodies[2] = {model.geometries()[a].body, model.geometries()[b].body};
      const double travel = std::max(travel_[bodies[0]], travel_[bodies[1]]);
      if (travel < threshold) continue;
      const int fast = travel_[bodies[0]] >= travel_[bodies[1]] ? bodies[0] : bodies[1];
      const int fast_tree = model.body(fast).tree;
      for (const int body : bodies) {
        if (body == 0) continue;
        const int index = model.body(body).tree;
        if (index == fast_tree && travel < own_threshold) continue;
        const Tree& tree = model.trees()[index];
        for (int k = tree.body_begin; k < tree.body_end; ++k) {
          if (travel_[k] >= travel) continue;
          travel_[k] = travel;
          again = changed = true;
        }
      }
    }
  }
  return changed;
}

namespace {

/// Surfaces of a pair as far as the effects are on.
Material surfaces(Material pair, EffectSet effects) {
  if (!effects.has(Effect::kFriction)) pair.friction = 0.0;
  if (!effects.has(Effect::kTorsionalFriction)) pair.torsional_friction = 0.0;
  if (!effects.has(Effect::kRollingFriction)) pair.rolling_friction = 0.0;
  if (!effects.has(Effect::kRestitution)) pair.restitution = 0.0;
  return pair;
}

void count_contact(const Material& pair, EffectCounts& counts) {
  if (pair.restitution > 0.0) counts.add(Effect::kRestitution);
  if (!(pair.friction > 0.0)) return;
  counts.add(Effect::kFriction);
  if (pair.torsional_friction > 0.0) counts.add(Effect::kTorsionalFriction);
  if (pair.rolling_friction > 0.0) counts.add(Effect::kRollingFriction);
}

}  // namespace

/// Of contacts with rows, tied by these and by closures: a function of (q, w), like the rows.
void ConstraintFinder::stiffen_under_load(const Model& model, ConstraintSet& out) {
  const auto tree_of = [&](int body) { return model.body(body).tree; };
  islands_.reset(model.num_trees());
  for (const PairConstraint& pair : out.pairs)
    if (pair.body_a != 0 && pair.body_b != 0)
      islands_.join(tree_of(pair.body_a), tree_of(pair.body_b));
  least_weight_.assign(static_cast<size_t>(model.num_trees()),
                       std::numeric_limits<double>::infinity());
  for (int b = 1; b < model.num_bodies(); ++b) {
    if (!(weights_.contact[b] > 0.0)) continue;
    double& least = least_weight_[static_cast<size_t>(islands_.root(tree_of(b)))];
    least = std::min(least, weights_.contact[b]);
  }
  for (size_t i = 0; i < out.contacts.size(); ++i) {
    PairConstraint& pair = out.pairs[i];
    const int body = pair.body_b != 0 ? pair.body_b : pair.body_a;
    const double least = least_weight_[static_cast<size_t>(islands_.root(tree_of(body)))];
    const double alpha = weights_.contact[pair.body_a] + weights_.contact[pair.body_b];
    if (!(alpha > kHeaviest * least)) continue;
    pair.stiffer = kHeaviest * least / alpha;
    pair.law.regularizer *= pair.stiffer;
  }
}

Vector3 ConstraintFinder::relative_fall(EffectSet effects, const PairConstraint& contact) const {
  if (!effects.has(Effect::kGravity)) return Vector3::Zero();
  return fall_[contact.body_b] - fall_[contact.body_a];
}

Bounce ConstraintFinder::find_contact_bounce(const SimulationOptions& options, EffectSet effects,
                                             const Material& surface, const PairConstraint& contact,
                                             double gap, double velocity) const {
  if (!(surface.restitution > 0.0)) return {};
  // What rests shows half a step of falling in the midpoint rule; that is no approach.
  if (options.integrator == Integrator::kImplicitMidpoint && gap <= touching_gap(options.contact))
    return {};
  return find_bounce(options.integrator, options.time_step, surface.restitution, gap, velocity,
                     contact.frame.col(0).dot(relative_fall(effects, contact)));
}

/// How much farther along n the point of a body at `arm` from its origin goes within the step than
/// its velocity times h says, if the body keeps turning as it does.
double ConstraintFinder::turning_advance(const Vector3& n, const Vector3& arm, double h, int body,
                                         const Data& data) {
  if (body == 0) return 0.0;
  const Vector3 angle = h * data.V[body].angular;
  if (!turn_known_[body]) {
    turn_known_[body] = 1;
    turn_[body] = quaternion_exp(angle);
  }
  return n.dot(turn_[body] * arm - arm - angle.cross(arm));
}

/// The gap a contact may close by velocity times h: less than it is where turning brings the two
/// surfaces closer than that product says, as a rod's end that comes over.
double ConstraintFinder::gap_less_turning(const PairConstraint& contact, double gap, double h,
                                          const Data& data) {
  if (!(gap > 0.0)) return gap;
  const auto advance = [&](int body) {
    return turning_advance(contact.frame.col(0), contact.position - data.X_WB[body].translation, h,
                           body, data);
  };
  const double closer = advance(contact.body_a) - advance(contact.body_b);
  return std::max(gap - std::max(closer, 0.0), 0.0);
}

void ConstraintFinder::find_contacts(const Model& model, const SimulationOptions& options,
                                     EffectSet effects, const Data& data, ConstraintSet& out,
                                     EffectCounts& counts, Idle idle) {
  const double h = options.time_step;
  find_candidates(model, options, effects, data, idle);
  // The midpoint rule takes contacts at a velocity that is found elsewhere than at q.
  const bool parks = options.integrator == Integrator::kSemiImplicitEuler;
  std::fill(turn_known_.begin(), turn_known_.end(), 0);
  const double parking_gap = counterpoint::parking_gap(options.contact, h);
  Material material;
  std::pair<int, int> last{-1, -1};  // candidates come pair by pair
  for (collision::Candidate& candidate : candidates_) {
    const Geometry& a = model.geometries()[candidate.geometry_a];
    const Geometry& b = model.geometries()[candidate.geometry_b];
    const double alpha = weights_.contact[a.body] + weights_.contact[b.body];
    if (!(alpha > 0.0)) continue;  // neither side can move, in any way
    if (const std::pair pair(candidate.geometry_a, candidate.geometry_b); pair != last) {
      material = surfaces(model.pair_material(pair.first, pair.second), effects);
      last = pair;
    }
    PairConstraint contact;
    contact.body_a = a.body;
    contact.body_b = b.body;
    // The bodies meet where the lighter one's surface is now, or nearly: halfway across a gap of
    // decimetres friction would turn a small body by an arm that it does not have.
    const double towards_b = weights_.contact[b.body] / alpha - 0.5;
    candidate.position += towards_b * std::max(candidate.gap, 0.0) * candidate.normal;
    contact.position = candidate.position;
    const Matrix3 t1_t2_n = frame_from_normal(candidate.normal);
    contact.frame << t1_t2_n.col(2), t1_t2_n.col(0), t1_t2_n.col(1);
    contact.law.rows = 3;
    const contact::Rows v = relative_velocity(contact, data, data.V);
    const double gap = gap_less_turning(contact, candidate.gap, h, data);
    contact.gap_bias = gap_bias(options.contact, h, gap);
    const Bounce bounce = find_contact_bounce(options, effects, material, contact, gap, v[0]);
    if (bounce.happens && gap > 0.0) contact.impact_time = bounce.time;
    contact.law = make_contact_law(law_options(options, alpha, weights_.total_mass), h, material,
                                   alpha, gap, Vector3(v), bounce, is_round(model, a, b));
    count_contact(material, counts);
    if (parks && !is_near(contact, v, parking_gap, h) && !idle(a.body) && !idle(b.body)) {
      out.parked.push_back({candidate, contact});
      continue;
    }
    out.max_penetration = std::max(out.max_penetration, -candidate.gap);
    out.contacts.push_back(candidate);
    out.pairs.push_back(contact);
    speed_.push_back(std::hypot(v[1], v[2]));
  }
  // Room for those that will get rows, so that it is the candidates' number that has to be seen.
  out.contacts.reserve(out.contacts.size() + out.parked.size());
  speed_.reserve(candidates_.size());
  out.pairs.reserve(out.pairs.size() + out.parked.size() + model.closures().size());
}

contact::Rows relative_velocity(const PairConstraint& pair, const Data& data,
                                const std::vector<Motion>& V) {
  Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();
  const bool turning = pair.first + pair.law.rows > 3;
  if (pair.body_a != 0) {
    linear -= V[pair.body_a].at(pair.position - data.X_WB[pair.body_a].translation);
    if (turning) angular -= V[pair.body_a].angular;
  }
  if (pair.body_b != 0) {
    linear += V[pair.body_b].at(pair.position - data.X_WB[pair.body_b].translation);
    if (turning) angular += V[pair.body_b].angular;
  }
  const Vector3 v = pair.frame.transpose() * linear;
  const Vector3 w = pair.frame.transpose() * angular;
  contact::Rows rows(pair.law.rows);
  for (int i = 0; i < pair.law.rows; ++i) {
    const int row = pair.first + i;
    rows[i] = row < 3 ? v[row] : w[row - 3];
  }
  return rows;
}

}  // namespace counterpoint
