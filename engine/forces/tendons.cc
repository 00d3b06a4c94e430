#include "counterpoint/engine/forces/tendons.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "counterpoint/engine/constraints/contact_law.h"

namespace counterpoint {
namespace {

/// Calls visit(body) for the bodies from `from` up to, without, the common ancestor with `other`.
template <class Visit>
void climb(const Model& model, int from, int other, Visit visit) {
  while (from != other) {
    if (from > other) {
      visit(from);
      from = model.body(from).parent;
    } else {
      other = model.body(other).parent;
    }
  }
}

/// Velocity of a point at p (in W) by a coordinate of a body: the linear part of its axis there.
Vector3 point_velocity(const Kinematics& at, int body, int v_index, const Vector3& p) {
  return at.axis[static_cast<size_t>(v_index)].at(p -
                                                  at.X_WB[static_cast<size_t>(body)].translation);
}

JointConstraint row_of(int tendon, TendonPart part) {
  JointConstraint row;
  row.effect = Effect::kTendons;
  row.tendon = tendon;
  row.part = part;
  return row;
}

/// Appends a row whose impulse acts along the tendon as its part does.
void add_row(const JointConstraint& row, std::span<const RowTerm> arms, ConstraintSet& out) {
  const size_t first = out.row_terms.size();
  out.add(row, arms);
  if (row.along() > 0.0) return;
  for (size_t i = first; i < out.row_terms.size(); ++i) out.row_terms[i].coefficient *= -1.0;
}

}  // namespace

Tendons::Tendons(const Model& model) {
  const size_t n = model.tendons().size();
  length_.assign(n, 0.0);
  idle_.assign(n, 0);
  arms_.resize(n);
  chains_.resize(n);
  for (size_t i = 0; i < n; ++i) {
    const Tendon& tendon = model.tendons()[i];
    std::map<int, double> arms;  // keys: coordinates
    int moved = 0;
    for (const TendonJoint& term : tendon.joints) {
      moved = term.joint + 1;
      arms[model.body(moved).v_index] += term.coefficient;
    }
    const auto add_coordinates = [&](int body) {
      moved = body;
      const Body& b = model.body(body);
      for (int k = b.v_index; k < b.v_index + joint_nv(b.joint_type); ++k) arms[k] = 0.0;
    };
    for (const TendonSegment& segment : tendon.path) {
      for (const int end : {segment.from.body, segment.to.body}) {
        climb(model, end, reference_body(tendon, segment), add_coordinates);
        climb(model, reference_body(tendon, segment), end, add_coordinates);
      }
    }
    moved_.push_back(moved);
    std::vector<int> coordinates;
    for (const auto& [v_index, coefficient] : arms) {
      coordinates.push_back(v_index);
      arms_[i].push_back({v_index, coefficient});
    }
    for (const TendonSegment& segment : tendon.path)
      chains_[i].push_back(
          {make_chain(model, reference_body(tendon, segment), segment.from.body, coordinates),
           make_chain(model, reference_body(tendon, segment), segment.to.body, coordinates)});
  }
}

Tendons::Chain Tendons::make_chain(const Model& model, int reference, int end,
                                   const std::vector<int>& arms) const {
  Chain chain;
  const auto add = [&](int body, double sign, auto& to) {
    const Body& b = model.body(body);
    const int nv = joint_nv(b.joint_type);
    for (int k = 0; k < nv; ++k) {
      // From the reference outwards a joint on its own side is passed from child to parent.
      const int v_index = b.v_index + (sign < 0.0 ? nv - 1 - k : k);
      const auto found = std::lower_bound(arms.begin(), arms.end(), v_index);
      to.push_back({static_cast<int>(found - arms.begin()), body, v_index, sign});
    }
  };
  climb(model, reference, end, [&](int body) { add(body, -1.0, chain.steps); });
  std::vector<int> outwards;
  climb(model, end, reference, [&](int body) { outwards.push_back(body); });
  for (auto body = outwards.rbegin(); body != outwards.rend(); ++body) add(*body, 1.0, chain.steps);
  return chain;
}

void Tendons::find(const Model& model, const VectorRef& q, const Kinematics& at, SleepMask idle) {
  for (size_t i = 0; i < length_.size(); ++i) {
    const Tendon& tendon = model.tendons()[i];
    std::vector<RowTerm>& arms = arms_[i];
    idle_[i] = idle(moved_[i]);  // the others are in the same island
    if (idle_[i]) continue;
    length_[i] = 0.0;
    for (const TendonJoint& term : tendon.joints)
      length_[i] += term.coefficient * q[model.body(term.joint + 1).q_index];
    if (!tendon.is_spatial()) continue;
    for (RowTerm& arm : arms) arm.coefficient = 0.0;
    for (size_t s = 0; s < tendon.path.size(); ++s) {
      const double share = tendon.path[s].share;
      const PlacedSegment placed = place_segment(tendon, tendon.path[s], at.X_WB, false);
      length_[i] += share * placed.length.length;
      const auto add = [&](const Chain& chain, const Vector3& p, const Vector3& by) {
        for (const Step& step : chain.steps)
          arms[static_cast<size_t>(step.arm)].coefficient +=
              share * step.sign * by.dot(point_velocity(at, step.body, step.v_index, p));
      };
      add(chains_[i][s][0], placed.start, placed.length.by_a);
      add(chains_[i][s][1], placed.end, placed.length.by_b);
    }
  }
}

void Tendons::find_curvature(const Model& model, int tendon, const Kinematics& at,
                             TendonCurvature& out) const {
  const auto t = static_cast<size_t>(tendon);
  out.arms = static_cast<int>(arms_[t].size());
  out.entries.assign(arms_[t].size() * arms_[t].size(), 0.0);
  for (size_t s = 0; s < chains_[t].size(); ++s) {
    const TendonSegment& segment = model.tendons()[t].path[s];
    const PlacedSegment placed = place_segment(model.tendons()[t], segment, at.X_WB, true);
    const SegmentLength& l = placed.length;
    for (size_t e = 0; e < 2; ++e) {
      const Chain& chain = chains_[t][s][e];
      out.by_q[e].assign(arms_[t].size(), Vector3::Zero());
      for (const Step& step : chain.steps)
        out.by_q[e][static_cast<size_t>(step.arm)] =
            step.sign *
            point_velocity(at, step.body, step.v_index, e == 0 ? placed.start : placed.end);
      add_turning(model, chain, at, segment.share * (e == 0 ? l.by_a : l.by_b), out.by_q[e], out);
    }
    for (int i = 0; i < out.arms; ++i) {
      const Vector3 &a = out.by_q[0][static_cast<size_t>(i)],
                    &b = out.by_q[1][static_cast<size_t>(i)];
      const Vector3 with_a = segment.share * (l.by_aa * a + l.by_ab * b);
      const Vector3 with_b = segment.share * (l.by_ab.transpose() * a + l.by_bb * b);
      for (int j = 0; j < out.arms; ++j)
        out(i, j) += with_a.dot(out.by_q[0][static_cast<size_t>(j)]) +
                     with_b.dot(out.by_q[1][static_cast<size_t>(j)]);
    }
  }
}

/// Adds by . d(columns)/dq: joints nearer to the reference turn the columns of those farther out.
void Tendons::add_turning(const Model& model, const Chain& chain, const Kinematics& at,
                          const Vector3& by, const std::vector<Vector3>& columns,
                          TendonCurvature& out) const {
  const auto turn = [&](const Step& step, const Step& column) {
    const Vector3 spin = step.sign * at.axis[static_cast<size_t>(step.v_index)].angular;
    return by.dot(spin.cross(columns[static_cast<size_t>(column.arm)]));
  };
  const auto is_angular = [&](const Step& step) {
    const Body& body = model.body(step.body);
    return step.v_index - body.v_index >= joint_num_linear(body.joint_type);
  };
  const auto& steps = chain.steps;
  for (size_t k = 0; k < steps.size(); ++k) {
    for (size_t j = 0; j < steps.size(); ++j) {
      // The body axes of a ball joint turn with it; seen from its child they stand.
      const bool one_ball =
          steps[k].body == steps[j].body && is_angular(steps[k]) && is_angular(steps[j]);
      const bool j_turns = one_ball ? steps[j].sign > 0.0 : j <= k;
      out(steps[k].arm, steps[j].arm) +=
          j_turns ? turn(steps[j], steps[k]) : turn(steps[k], steps[j]);
    }
  }
}

namespace {

/// Appends the rows of the spring and the damper.
void add_passive(const StepContext& at, const Tendon& tendon, int index, double length,
                 std::span<const RowTerm> arms, ConstraintSet& out) {
  const double h = at.h();
  const bool slack = tendon.rest_shortest < tendon.rest_longest;
  JointConstraint row = row_of(index, TendonPart::kSpring);
  const double k = slack ? 0.0 : tendon.stiffness, gain = tendon.damping + h * k;
  if (gain > 0.0) {
    row.law.type = contact::LawType::kSpring;
    set_gain(h, gain, k * (tendon.rest_shortest - length), row.law);
    row.bias_by_length = k / gain;
    out.add(row, arms);
  }
  if (!slack || !(tendon.stiffness > 0.0)) return;
  row.law.type = contact::LawType::kUnilateral;
  row.law.regularizer = 1.0 / (h * h * tendon.stiffness);
  row.bias_by_length = 1.0 / h;
  row.part = TendonPart::kShortSpring;
  row.law.bias[0] = (length - tendon.rest_shortest) / h;
  out.add(row, arms);
  row.part = TendonPart::kLongSpring;
  row.law.bias[0] = (tendon.rest_longest - length) / h;
  add_row(row, arms, out);
}

}  // namespace

void add_tendon_rows(const StepContext& at, const Tendons& tendons, const InverseWeights& weights,
                     ConstraintSet& out) {
  const double h = at.h();
  for (int i = 0; i < static_cast<int>(at.model.tendons().size()); ++i) {
    if (tendons.is_idle(i)) continue;
    const Tendon& tendon = at.model.tendons()[static_cast<size_t>(i)];
    const std::span<const RowTerm> arms = tendons.arms(i);
    const double length = tendons.length(i), alpha = weights.tendon[static_cast<size_t>(i)];
    add_passive(at, tendon, i, length, arms, out);
    JointConstraint row = row_of(i, TendonPart::kFriction);
    if (tendon.dry_friction > 0.0) {
      row.law = make_dry_friction_law(at.options.contact, h, alpha, tendon.dry_friction);
      out.add(row, arms);
    }
    for (const double sign : {1.0, -1.0}) {
      const double limit = sign > 0.0 ? tendon.lower : tendon.upper;
      if (!std::isfinite(limit)) continue;
      row.part = sign > 0.0 ? TendonPart::kLowerLimit : TendonPart::kUpperLimit;
      row.gap = sign * (length - limit);
      row.law = make_limit_law(law_options(at.options), h, alpha, row.gap);
      row.gap_bias = gap_bias(at.options.contact, h, row.gap);
      add_row(row, arms, out);
    }
  }
}

void add_tendon_servos(const StepContext& at, const Tendons& tendons, const Input& input,
                       ConstraintSet& out) {
  const double h = at.h();
  for (int i = 0; i < static_cast<int>(at.model.tendons().size()); ++i) {
    const TendonServo& servo = at.model.tendons()[static_cast<size_t>(i)].servo;
    const double given = input.tendon_force.size() > 0 ? input.tendon_force[i] : 0.0;
    const double pull = std::clamp(given, servo.least, servo.most);
    if (tendons.is_idle(i) || (!servo.any() && pull == 0.0)) continue;
    const double target = input.tendon_target.size() > 0 ? input.tendon_target[i] : servo.target;
    JointConstraint row = row_of(i, TendonPart::kServo);
    const double gain = servo.damping + h * servo.stiffness;
    const double force =
        servo.stiffness * (target - tendons.length(i)) + servo.damping * servo.speed + given;
    set_motor_law(h, {force, gain, servo.least, servo.most}, row.law);
    if (servo.any()) row.bias_by_length = servo.stiffness / gain;
    out.add(row, tendons.arms(i));
  }
}

double tendon_energy(const Model& model, const VectorRef& q, const std::vector<Pose>& X_WB) {
  double energy = 0.0;
  for (const Tendon& tendon : model.tendons()) {
    if (!(tendon.stiffness > 0.0)) continue;
    const double length = tendon_length(model, tendon, q, X_WB);
    const double stretch = length - std::clamp(length, tendon.rest_shortest, tendon.rest_longest);
    energy += 0.5 * tendon.stiffness * stretch * stretch;
  }
  return energy;
}

}  // namespace counterpoint
