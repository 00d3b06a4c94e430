#include <algorithm>
#include <cmath>

#include "counterpoint/contact/inverse.h"
#include "counterpoint/contact/linear/semidefinite_factor.h"
#include "counterpoint/contact/problem.h"
#include "counterpoint/contact/solver.h"

namespace counterpoint::contact {
namespace {

bool sizes_agree(const ContactSpaceProblem& problem) {
  const Eigen::Index n = 3 * problem.num_contacts();
  return problem.A.rows() == n && problem.A.cols() == n && problem.c.size() == n;
}

// Euclidean distance of (normal, tangential) from the cone tangential <= mu normal.
double cone_distance(double normal, double tangential, double mu) {
  if (tangential <= mu * normal) return 0.0;
  if (mu * tangential <= -normal) return std::hypot(normal, tangential);
  return (tangential - mu * normal) / std::sqrt(1.0 + mu * mu);
}

}  // namespace

Law contact_law(const ContactSpaceProblem& problem, const ContactSpaceOptions& options,
                int contact) {
  Law law;
  law.type = LawType::kFrictionCone;
  law.rows = 3;
  law.coulomb = options.coulomb;
  law.friction[0] = law.friction[1] = problem.mu[contact];
  law.regularizer = options.compliance * problem.A.diagonal().segment<3>(3 * contact).sum() / 3.0;
  law.smoothing = options.smoothing;
  return law;
}

double relative_asymmetry(const MatrixX& A) {
  const double largest = A.cwiseAbs().maxCoeff();
  return largest > 0.0 ? (A - A.transpose()).cwiseAbs().maxCoeff() / largest : 0.0;
}

ContactSpaceSolution solve_contact_space(const ContactSpaceProblem& problem,
                                         const ContactSpaceOptions& options,
                                         const Settings& settings) {
  ContactSpaceSolution out;
  const int contacts = problem.num_contacts();
  out.f.setZero(3 * contacts);
  out.v = problem.c;
  if (!sizes_agree(problem)) {
    out.report.status = Status::kInvalidLaw;
    return out;
  }
  if (!problem.A.allFinite() || !problem.c.allFinite()) {
    out.report.status = Status::kNotFinite;
    return out;
  }
  if (contacts == 0) return out;
  out.asymmetry = relative_asymmetry(problem.A);
  MatrixX factor;
  out.rank = factor_semidefinite(0.5 * (problem.A + problem.A.transpose()), options.rank_tolerance,
                                 factor);
  Problem bodiless;
  bodiless.add_block(out.rank);
  bodiless.mass(0).setIdentity();
  for (int i = 0; i < contacts; ++i) {
    Law law = contact_law(problem, options, i);
    for (int r = 0; r < 3; ++r) law.bias[r] = problem.c[3 * i + r];
    bodiless.add_constraint(law, 0);
    bodiless.jacobian(i, 0) = factor.middleRows<3>(3 * i);
  }
  VectorX w = VectorX::Zero(out.rank);
  Settings exact = settings;
  exact.soften_after = 0;  // the inverse knows only the laws of `options`
  Solver solver;
  out.report = solver.solve(bodiless, exact, w, out.f);
  compute_constraint_velocity(bodiless, w, out.v);
  return out;
}

ContactSpaceInverse invert_contact_space(const ContactSpaceProblem& problem, const VectorX& v,
                                         const ContactSpaceOptions& options) {
  ContactSpaceInverse out;
  out.f.setZero(v.size());
  for (int i = 0; i < problem.num_contacts(); ++i) {
    impulse(contact_law(problem, options, i), v.data() + 3 * i, out.f.data() + 3 * i);
  }
  out.c = v - 0.5 * (problem.A + problem.A.transpose()) * out.f;
  return out;
}

ContactSpaceResiduals contact_space_residuals(const ContactSpaceProblem& problem, const VectorX& f,
                                              bool coulomb) {
  ContactSpaceResiduals out;
  const VectorX v = problem.c + problem.A * f;
  for (int i = 0; i < problem.num_contacts(); ++i) {
    const double mu = problem.mu[i];
    const double f_t = std::hypot(f[3 * i + 1], f[3 * i + 2]);
    const double v_t = std::hypot(v[3 * i + 1], v[3 * i + 2]);
    const double shift = coulomb ? mu * v_t : 0.0;
    const double v_n = v[3 * i] + shift;
    out.primal = std::max(out.primal, cone_distance(f[3 * i], f_t, mu));
    // The dual cone v_N >= mu |v_T| has the coefficient 1 / mu; for mu = 0 it is v_N >= 0.
    const double dual = mu > 0.0 ? cone_distance(v_n, v_t, 1.0 / mu) : std::max(0.0, -v_n);
    out.dual = std::max(out.dual, dual);
    const double power = f.segment<3>(3 * i).dot(v.segment<3>(3 * i)) + f[3 * i] * shift;
    out.complementarity = std::max(out.complementarity, std::abs(power));
  }
  const double force_scale = f.size() > 0 ? f.cwiseAbs().maxCoeff() : 0.0;
  const double velocity_scale = f.size() > 0 ? problem.c.cwiseAbs().maxCoeff() : 0.0;
  if (force_scale > 0.0) out.primal /= force_scale;
  if (velocity_scale > 0.0) out.dual /= velocity_scale;
  if (force_scale * velocity_scale > 0.0) out.complementarity /= force_scale * velocity_scale;
  return out;
}

}  // namespace counterpoint::contact
