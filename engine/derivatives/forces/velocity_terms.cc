#include "counterpoint/engine/derivatives/forces/velocity_terms.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace counterpoint {
namespace {

bool is_linkage(const Tree& tree) { return tree.body_end - tree.body_begin > 1; }

}  // namespace

VelocityTerms::VelocityTerms(const Model& model)
    : sweep_(model),
      parents_(coordinate_parents(model)),
      equality_prediction_(model),
      kind_(model.num_trees(), Kind::kPlain),
      predictor_(model.num_trees(), nullptr),
      has_ties_(model.num_trees(), 0),
      predicted_(model.num_trees(), 0),
      resting_(model),
      projection_(model),
      zero_(VectorX::Zero(model.nv())),
      other_(zero_),
      f_(zero_),
      a_f_(zero_),
      half_(zero_) {
  bool any = false;
  for (const Tree& tree : model.trees()) any = any || is_linkage(tree);
  if (!any) return;
  resting_data_.emplace(model);
  const int nv = model.nv();
  for (MatrixX* m : {&dq_, &dv_, &da_, &factor_, &solved_}) m->setZero(nv, nv);
}

void VelocityTerms::begin(const InverseArguments& of, const InvertedStep& inverted) {
  const Model& model = of.model;
  std::fill(predictor_.begin(), predictor_.end(), nullptr);
  std::fill(has_ties_.begin(), has_ties_.end(), 0);
  resting_.forget();
  mean_ = inverted.has_coriolis && of.options.mean_velocity_forces;
  if (!mean_) return;
  ranges_.clear();
  for (int t = 0; t < model.num_trees(); ++t) {
    const Tree& tree = model.trees()[t];
    if (!is_linkage(tree)) continue;
    const bool known = inverted.start.predictor().covers(t) || inverted.start.predictor().knows(t);
    if (inverted.start.predictor().covers(t) || (known && inverted.start.predictor().has(t))) {
      predictor_[t] = &inverted.start.predictor();
    } else if (known) {
      ranges_.push_back({tree.body_begin, tree.body_end});
    }
  }
  if (!ranges_.empty()) predict_resting(of, inverted);
  for (const VelocityPredictor* predictor :
       {&inverted.start.predictor(), &std::as_const(resting_)}) {
    if (!predictor->any()) continue;
    for_each_constraint(model, predictor->equalities(), [&](int a, int b) {
      for (const int t : {a, b})
        if (t >= 0) has_ties_[t] = 1;
    });
  }
}

void VelocityTerms::predict_resting(const InverseArguments& of, const InvertedStep& inverted) {
  const Model& model = of.model;
  constraints_ = inverted.start.constraints();
  const Vector3& gravity = inverted.start.gravity();
  Data& data = *resting_data_;
  static_cast<Kinematics&>(data) = inverted.at();
  static_cast<VelocityForces&>(data) = inverted.start.velocity_forces();
  const StepContext at = of.context();
  resting_.find(at, VelocityPredictor::Of::kAllLinkages, of.h(), gravity, constraints_, ranges_,
                data);
  resting_.refine(at, gravity, constraints_, data);
  for (const BodyRange& bodies : ranges_) {
    const int t = model.body(bodies.begin).tree;
    if (resting_.covers(t)) predictor_[t] = &resting_;
  }
}

void VelocityTerms::prepare(const InverseArguments& of, int t, const InvertedStep& inverted,
                            VectorX& v_at, VectorX& a_at, SweepInput& in) {
  const Tree& tree = of.model.trees()[t];
  const VectorRef& v = of.v;
  kind_[t] = Kind::kPlain;
  in.velocity_factor = 1.0;
  if (!mean_ || !is_linkage(tree)) return;
  const auto part = Eigen::seqN(tree.v_begin, tree.v_end - tree.v_begin);
  const bool covered = predictor_[t] != nullptr;
  const double share = inverted.start.energy_projection().share(t);
  if (covered) f_(part) = predictor_[t]->velocity()(part);
  if (share > 0.0) {
    a_at(part) -= inverted.start.energy_projection().change()(part) / of.h();
    if (covered) {
      kind_[t] = Kind::kBoth;
      other_(part) =
          f_(part) - share * (v(part) + inverted.start.energy_projection().plain_change()(part));
      v_at(part) = 0.5 * (v(part) + other_(part));
      return;
    }
    kind_[t] = Kind::kProjected;
    in.velocity_factor = std::sqrt(1.0 - share);
    v_at(part) *= in.velocity_factor;
    return;
  }
  if (!covered) return;
  kind_[t] = Kind::kPredicted;
  other_(part) = f_(part);
  v_at(part) = 0.5 * (v(part) + f_(part));
}

bool VelocityTerms::add_equalities(const InverseArguments& of, const InvertedStep& inverted,
                                   ClosureDerivator& closures, InverseDerivatives& d) {
  if (!mean_) return true;
  bool known = true;
  for (const VelocityPredictor* predictor :
       {&inverted.start.predictor(), &std::as_const(resting_)}) {
    for (size_t t = 0; t < predicted_.size(); ++t) predicted_[t] = predictor_[t] == predictor;
    const EqualityPrediction::Given given{*predictor, predicted_, other_, predictor == &resting_};
    known = equality_prediction_.add(of, given, inverted, closures, d) && known;
  }
  return known;
}

void VelocityTerms::add(const InverseArguments& of, int t, const InvertedStep& inverted,
                        InverseDerivatives& d) {
  const Kind kind = kind_[t];
  if ((kind == Kind::kPredicted || kind == Kind::kBoth) && !has_ties_[t])
    add_prediction(of, of.model.trees()[t], inverted, d);
  if (kind == Kind::kProjected || kind == Kind::kBoth)
    projection_.add(of, t, kind == Kind::kBoth, inverted, d);
}

void VelocityTerms::add_prediction(const InverseArguments& of, const Tree& tree,
                                   const InvertedStep& inverted, InverseDerivatives& d) {
  const Model& model = of.model;
  const EffectSet effects = of.effects;
  const VectorRef& v = of.v;
  const double h = of.h();
  const int begin = tree.v_begin, n = tree.v_end - tree.v_begin;
  const auto part = Eigen::seqN(begin, n);
  SweepInput in;
  half_(part) = 0.5 * (v(part) - other_(part));
  in.v = half_.data();
  in.a = zero_.data();
  sweep_.run(model, tree, inverted.at(), in, {dq_, dv_, da_});
  d.dq.block(begin, begin, n, n) -= dq_.block(begin, begin, n, n);
  a_f_(part) = (f_(part) - v(part)) / h;
  in.v = v.data();
  in.a = a_f_.data();
  if (effects.has(Effect::kGravity)) in.gravity = model.gravity();
  sweep_.run(model, tree, inverted.at(), in, {dq_, dv_, da_});
  auto D = factor_.topLeftCorner(n, n), X = solved_.topLeftCorner(n, n);
  // B(v, .) is half of dn/dv; X' = h inv(M + D) B(v, .)'.
  D = da_.block(begin, begin, n, n);
  X = 0.5 * h * dv_.block(begin, begin, n, n).transpose();
  // Rotors, dampers and springs in the prediction's equation.
  if (effects.has(Effect::kArmature)) D.diagonal() += model.armature().segment(begin, n);
  if (effects.has(Effect::kDamping)) {
    D.diagonal() += h * model.damping().segment(begin, n);
    dv_.diagonal().segment(begin, n) += model.damping().segment(begin, n);
  }
  if (effects.has(Effect::kSprings)) {
    for (const JointSpring& spring : model.springs()) {
      const int k = model.body(spring.joint + 1).v_index;
      if (k < begin || k >= begin + n) continue;
      D(k - begin, k - begin) += h * h * spring.stiffness;
      dq_(k, k) += spring.stiffness;
      dv_(k, k) += h * spring.stiffness;
    }
  }
  solver_.begin_tree(D, parents_, begin, n);
  solver_.add(X, 0, 1.0);
  if (!solver_.solve()) return;
  solver_.get(0, X);
  d.dq.block(begin, begin, n, n) -= X.transpose().lazyProduct(dq_.block(begin, begin, n, n));
  d.dv.block(begin, begin, n, n) -= X.transpose().lazyProduct(dv_.block(begin, begin, n, n));
}

}  // namespace counterpoint
