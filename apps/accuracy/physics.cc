#include "physics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "counterpoint/engine/constraints/contact_law.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/inverse_weights.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "report/total_energy.h"

namespace counterpoint::apps::accuracy {
namespace {

/// Examines the steps of a piece one by one.
class Examiner {
 public:
  Examiner(const Scene& scene, const EngineSetting& setting)
      : model_(scene.model),
        setting_(setting),
        data_(scene.model),
        velocity_(static_cast<size_t>(scene.model.num_bodies())),
        displacement_(static_cast<size_t>(scene.model.num_bodies())),
        options_(setting.options),
        weights_(compute_inverse_weights(scene.model, data_)),
        fall_(free_fall(scene.model)),
        forward_(scene.model),
        backward_(scene.model),
        scale_(weight(scene.model)) {
    // Reference of the normal velocity: gap, recovery and restitution, without De Saxce's shift.
    options_.contact.friction_model = FrictionModel::kConvex;
    if (has_inverse()) return;
    physics_.inverse_error = std::numeric_limits<double>::quiet_NaN();
  }

  void examine(const Piece& piece, long steps, const std::function<bool()>& stop) {
    State now = piece.start, next;
    for (long k = 0; k < steps; ++k) {
      if (stop && stop()) throw Stopped();
      const StepReport report =
          step_forward(model_, setting_.options, setting_.solver, now, Input(), forward_, next);
      if (!report.succeeded()) return;
      physics_.penetration = std::max(physics_.penetration, report.max_penetration);
      known_.softening = report.softening;
      find_taut_links(next, known_.taut_links);
      if (has_inverse()) look_back(now, next);
      std::swap(now, next);
    }
    energy_ += std::abs(total_energy(model_, now) - total_energy(model_, piece.end));
    ++pieces_;
  }

  Physics finish(bool contacts) {
    if (contacts && has_inverse()) physics_.contact = residuals_;
    physics_.energy_error = energy_ / std::max(pieces_, 1);
    if (has_inverse()) physics_.inverse_error = found_ / scale_;
    return physics_;
  }

 private:
  /// Weight of the scene [N], the least force scale: forces below it count as round-off, because
  /// the forces of a free swing cancel.
  static double weight(const Model& model) {
    const double weight = total_mass(model) * model.gravity().norm();
    return weight > 0.0 ? weight : 1.0;
  }

  bool has_inverse() const { return setting_.options.integrator != Integrator::kRungeKutta4; }

  void look_back(const State& now, const State& next) {
    known_.z = now.z;
    step_inverse(model_, setting_.options, now.q, now.v, next.q, next.v, known_, backward_,
                 inverse_);
    if (inverse_.fault.any()) return;
    scale_ = std::max(scale_, inverse_.force_scale);
    leave_out_motors_at_their_limit();
    found_ = std::max(found_, inverse_.applied_force.lpNorm<Eigen::Infinity>());
    if (!inverse_.contacts.empty()) look_at_contacts(now, next);
  }

  /// Ignores motors at their effort limit: there the inverse returns the force at the limit, not
  /// the force applied.
  void leave_out_motors_at_their_limit() {
    for (size_t i = 0; i < model_.servos().size(); ++i) {
      const int joint = model_.servos()[i].joint, v = model_.body(joint + 1).v_index;
      const double limit = model_.joint(joint).effort_limit;
      const double given = inverse_.servo_force[static_cast<Eigen::Index>(i)];
      if (std::abs(given + inverse_.applied_force[v]) > (1.0 - 1e-6) * limit)
        inverse_.applied_force[v] = 0.0;
    }
  }

  void look_at_contacts(const State& now, const State& next) {
    VectorX displacement(model_.nv());  // divided by the time step below: mean velocity
    configuration_difference(model_, now.q, next.q, displacement);
    displacement /= setting_.options.time_step;
    const bool midpoint = setting_.options.integrator == Integrator::kImplicitMidpoint;
    compute_poses(model_, now.q, data_);
    compute_velocities(model_, now.v, data_);
    compute_body_velocities(model_, displacement, data_, displacement_);
    compute_body_velocities(model_, midpoint ? displacement : next.v, data_, velocity_);
    for (const ContactForce& contact : inverse_.contacts) add(contact);
  }

  Vector3 relative(const std::vector<Motion>& V, int a, int b, const Vector3& p) const {
    const auto at = [&](int body) {
      const auto i = static_cast<size_t>(body);
      return Vector3(V[i].at(p - data_.X_WB[i].translation));
    };
    return at(b) - at(a);
  }

  void add(const ContactForce& contact) {
    const collision::Candidate& c = contact.contact;
    const Geometry& a = model_.geometries()[static_cast<size_t>(c.geometry_a)];
    const Geometry& b = model_.geometries()[static_cast<size_t>(c.geometry_b)];
    const Material pair = model_.pair_material(c.geometry_a, c.geometry_b);
    if (pair.torsional_friction > 0.0 || pair.rolling_friction > 0.0) return;
    const double mu = pair.friction;
    const double h = options_.time_step,
                 v_before = relative(data_.V, a.body, b.body, c.position).dot(c.normal);
    const double alpha = weights_.contact[static_cast<size_t>(a.body)] +
                         weights_.contact[static_cast<size_t>(b.body)];
    const Vector3 fall = fall_[static_cast<size_t>(b.body)] - fall_[static_cast<size_t>(a.body)];
    const bool alone = inverse_.contacts.size() == 1;
    const Bounce bounce = find_bounce(options_.integrator, alone, h, pair.restitution, c.gap,
                                      v_before, fall.dot(c.normal));
    const contact::Law law =
        make_contact_law(law_options(options_), h,
                         {pair, alpha, c.gap, c.area, Vector3(v_before, 0.0, 0.0), bounce});
    // An overlap may be recovered by displacement without velocity.
    const double parting = relative(displacement_, a.body, b.body, c.position).dot(c.normal) +
                           gap_bias(options_.contact, h, c.gap);
    const Vector3 v = relative(velocity_, a.body, b.body, c.position);
    const double closing = v.dot(c.normal) + law.bias[0];
    const Vector3 v_t = v - v.dot(c.normal) * c.normal;
    const double f_n = contact.force.dot(c.normal);
    const Vector3 f_t = contact.force - f_n * c.normal;
    ContactResiduals& r = residuals_;
    r.primal = std::max(r.primal, (f_t.norm() - mu * f_n) / std::hypot(1.0, mu));
    r.dual = std::max({r.dual, -closing, -parting});
    r.complementarity =
        std::max(r.complementarity, std::abs(f_n * (closing + mu * v_t.norm()) + f_t.dot(v_t)));
  }

  const Model& model_;
  EngineSetting setting_;
  Data data_;
  std::vector<Motion> velocity_, displacement_;
  SimulationOptions options_;
  InverseWeights weights_;
  std::vector<Vector3> fall_;
  Workspace forward_, backward_;
  Input known_;  ///< softening of the step that is inverted
  Inverse inverse_;
  Physics physics_;
  ContactResiduals residuals_;
  double scale_, energy_ = 0.0, found_ = 0.0;
  int pieces_ = 0;
};

}  // namespace

std::span<const PhysicsColumn> physics_columns() {
  using P = const Physics&;
  using Value = std::optional<double>;
  static constexpr PhysicsColumn kColumns[] = {
      {"primal_N", "primal [N]", 1.0,
       [](P p) { return p.contact ? Value(p.contact->primal) : Value(); }},
      {"dual_m_s", "dual [m/s]", 1.0,
       [](P p) { return p.contact ? Value(p.contact->dual) : Value(); }},
      {"complementarity_W", "compl. [W]", 1.0,
       [](P p) { return p.contact ? Value(p.contact->complementarity) : Value(); }},
      {"penetration_m", "overlap [m]", 1.0,
       [](P p) { return p.contact ? Value(p.penetration) : Value(); }},
      {"creep_m_s", "creep [um/s]", 1e6,
       [](P p) { return p.block ? Value(p.block->creep) : Value(); }},
      {"hover_m", "hover [m]", 1.0, [](P p) { return p.block ? Value(p.block->hover) : Value(); }},
      {"rest_m", "rest [m]", 1.0, [](P p) { return p.block ? Value(p.block->rest) : Value(); }},
      {"inverse_error", "inverse", 1.0, [](P p) { return Value(p.inverse_error); }},
      {"energy_error_J", "energy [J]", 1.0, [](P p) { return Value(p.energy_error); }}};
  return kColumns;
}

Physics measure_physics(const Scene& scene, const EngineSetting& setting, const Plan& plan,
                        const std::vector<Piece>& pieces, bool contacts,
                        const std::function<bool()>& stop) {
  Examiner examiner(scene, setting);
  const long steps = whole_steps(plan.length, setting.options.time_step);
  for (const Piece& piece : pieces) examiner.examine(piece, steps, stop);
  Physics out = examiner.finish(contacts);
  if (contacts) out.block = measure_block(setting);
  return out;
}

}  // namespace counterpoint::apps::accuracy
