#include "counterpoint/engine/constraints/contact_memory.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "counterpoint/engine/step.h"

namespace counterpoint {
namespace {

using Key = std::tuple<int, int, int>;
Key key_of(const RememberedForce& r) { return {static_cast<int>(r.kind), r.a, r.b}; }
bool by_key(const RememberedForce& x, const RememberedForce& y) { return key_of(x) < key_of(y); }

bool by_key_and_place(const RememberedForce& x, const RememberedForce& y) {
  const auto rank = [](const RememberedForce& r) {
    return std::tuple(key_of(r), r.at[0], r.at[1], r.at[2]);
  };
  return rank(x) < rank(y);
}

/// Contact point in the frame of the moving body; of body B if both can move.
Vector3 seen_from_body(const PairConstraint& pair, const Kinematics& data) {
  const Pose& X_WB = data.X_WB[pair.body_b != 0 ? pair.body_b : pair.body_a];
  return X_WB.rotation.transpose() * (pair.position - X_WB.translation);
}

RememberedForce identify_contact(const collision::Candidate& candidate, const PairConstraint& pair,
                                 const Kinematics& data) {
  RememberedForce out;
  out.kind = RememberedForce::Kind::kContact;
  out.a = candidate.geometry_a;
  out.b = candidate.geometry_b;
  out.at = seen_from_body(pair, data);
  return out;
}

RememberedForce identify_closure(const ConstraintSet& constraints, size_t i) {
  RememberedForce out;
  out.kind = RememberedForce::Kind::kClosure;
  out.a = constraints.closures[i - constraints.contacts.size()].index;
  out.b = constraints.pairs[i].first;
  return out;
}

/// Identifies the kind of a joint row: limits of position and of speed on either side, dry
/// friction, a servo, a mimic joint, the rows of a tendon, an actuator.
RememberedForce identify_joint(const JointConstraint& row, std::span<const RowTerm> terms) {
  RememberedForce out;
  out.kind = RememberedForce::Kind::kJoint;
  out.a = terms[0].v_index;
  const int kind = 4 * static_cast<int>(row.law.type == contact::LawType::kUnilateral) +
                   2 * static_cast<int>(std::isnan(row.gap_bias)) +
                   static_cast<int>(terms[0].coefficient > 0.0);
  const int partner = terms.size() > 1 ? terms[1].v_index + 1 : 0;
  out.b = 8 * partner + kind;
  if (row.tendon >= 0) out.b = -1 - (8 * row.tendon + static_cast<int>(row.part));
  if (row.actuator >= 0) out.b = -1 - 8 * row.actuator;  // no part of a tendon is 0
  return out;
}

using Remembered = std::vector<RememberedForce>::const_iterator;

/// Returns the force of a range, not empty, whose contact point is nearest to that of `own`.
Remembered nearest_of(Remembered first, Remembered last, const RememberedForce& own) {
  Remembered nearest = first;
  double least = (first->at - own.at).squaredNorm();
  for (Remembered other = first + 1; other != last; ++other) {
    const double distance = (other->at - own.at).squaredNorm();
    if (!(distance < least)) continue;
    least = distance;
    nearest = other;
  }
  return nearest;
}

/// Calls visit(index of the constraint in the problem, its identity).
template <class Visit>
void for_each_identity(const ConstraintSet& constraints, const Kinematics& data, Visit visit) {
  int c = 0;
  for (size_t i = 0; i < constraints.pairs.size(); ++i)
    visit(c++, i < constraints.contacts.size()
                   ? identify_contact(constraints.contacts[i], constraints.pairs[i], data)
                   : identify_closure(constraints, i));
  for (const JointConstraint& row : constraints.joints)
    visit(c++, identify_joint(row, constraints.terms(row)));
}

bool is_idle(const Model& model, const RememberedForce& r, SleepMask idle) {
  const auto rests = [&](int body) { return body == 0 || idle(body); };
  switch (r.kind) {
    case RememberedForce::Kind::kContact:
      return rests(model.geometries()[r.a].body) && rests(model.geometries()[r.b].body);
    case RememberedForce::Kind::kClosure:
      return rests(model.closures()[r.a].body_a) && rests(model.closures()[r.a].body_b);
    case RememberedForce::Kind::kJoint:
      return rests(body_of_velocity(model, r.a));
    case RememberedForce::Kind::kTautLink:  // a taut link keeps its tree awake
      return false;
  }
  return false;
}

}  // namespace

void recall_impulses(const PosedConstraints& posed, const std::vector<RememberedForce>& memory,
                     Eigen::Ref<VectorX> impulse) {
  const ConstraintSet& constraints = posed.constraints;
  const contact::Problem& problem = posed.problem;
  const double h = posed.h;
  // Contacts of one pair are adjacent, and pairs mostly come in the order of the memory.
  auto first = memory.begin(), last = first;
  const auto find = [&](const RememberedForce& own) {
    const Key key = key_of(own);
    if (last == memory.end() || key_of(*last) != key) {
      std::tie(first, last) = std::equal_range(memory.begin(), memory.end(), own, by_key);
      return;
    }
    first = last;
    while (last != memory.end() && key_of(*last) == key) ++last;
  };
  for_each_identity(constraints, posed.data, [&](int c, const RememberedForce& own) {
    double* f = impulse.data() + problem.first_row(c);
    const int rows = problem.law(c).rows;
    f[0] = std::numeric_limits<double>::quiet_NaN();
    if (first == last || key_of(*first) != key_of(own)) find(own);
    if (first == last) return;
    const Remembered nearest = nearest_of(first, last, own);
    if (own.kind == RememberedForce::Kind::kJoint) {
      f[0] = h * nearest->force[0];
      return;
    }
    const PairConstraint& pair = constraints.pairs[static_cast<size_t>(c)];
    for (int i = 0; i < rows; ++i) {
      const int row = pair.first + i;
      f[i] = h * (row < 3 ? pair.frame.col(row).dot(nearest->force)
                          : pair.frame.col(row - 3).dot(nearest->torque));
    }
  });
}

double recall_load(const ConstraintSet& constraints, size_t i, const Kinematics& data,
                   const std::vector<RememberedForce>& memory) {
  const PairConstraint& pair = constraints.pairs[i];
  const RememberedForce own = identify_contact(constraints.contacts[i], pair, data);
  const auto [first, last] = std::equal_range(memory.begin(), memory.end(), own, by_key);
  if (first == last) return 0.0;
  return pair.frame.col(0).dot(nearest_of(first, last, own)->force);
}

void remember_impulses(const Model& model, const PosedConstraints& posed, const VectorRef& impulse,
                       SleepMask idle, const std::vector<RememberedForce>& before,
                       std::vector<RememberedForce>& memory) {
  const ConstraintSet& constraints = posed.constraints;
  const contact::Problem& problem = posed.problem;
  const double h = posed.h;
  memory.clear();
  for_each_identity(constraints, posed.data, [&](int c, RememberedForce own) {
    const double* f = impulse.data() + problem.first_row(c);
    if (own.kind == RememberedForce::Kind::kJoint) {
      own.force[0] = f[0] / h;
    } else {
      const PairConstraint& pair = constraints.pairs[static_cast<size_t>(c)];
      for (int i = 0; i < problem.law(c).rows; ++i) {
        const int row = pair.first + i;
        (row < 3 ? own.force : own.torque) += f[i] / h * pair.frame.col(row % 3);
      }
    }
    memory.push_back(own);
  });
  // Rows on joints have one key each, so no stable sort, which allocates, is needed.
  const auto joints = memory.end() - static_cast<std::ptrdiff_t>(constraints.joints.size());
  if (!std::is_sorted(joints, memory.end(), by_key)) std::sort(joints, memory.end(), by_key);
  for (const InactiveContact& open : constraints.inactive)
    memory.push_back(identify_contact(open.candidate, open.pair, posed.data));
  if (!idle.bodies.empty())
    for (const RememberedForce& r : before)
      if (is_idle(model, r, idle)) memory.push_back(r);
  if (!std::is_sorted(memory.begin(), memory.end(), by_key))
    std::sort(memory.begin(), memory.end(), by_key_and_place);
}

}  // namespace counterpoint
