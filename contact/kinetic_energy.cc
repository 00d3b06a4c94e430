#include "counterpoint/contact/kinetic_energy.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "counterpoint/contact/law.h"

namespace counterpoint::contact {
namespace {

// q' and q'' of the velocity bound at s = v_N - v_min.
struct VelocityBound {
  double value, slope, curvature;

  VelocityBound(double s, double k, double s0) {
    if (s >= s0) {
      value = -k * std::log(s);
      slope = -k / s;
      curvature = k / (s * s);
      return;
    }
    const double d = s - s0;
    curvature = k / (s0 * s0);
    slope = -k / s0 + curvature * d;
    value = -k * std::log(s0) - k / s0 * d + 0.5 * curvature * d * d;
  }
};

Law cone_law(const KineticEnergyProblem& problem, int contact, double k) {
  Law law;
  law.type = LawType::kFrictionCone;
  law.rows = 3;
  law.friction[0] = law.friction[1] = problem.mu[contact];
  law.regularizer = problem.regularizer[contact];
  law.smoothing = k;
  return law;
}

// A grad q(v_N - v_min).
VectorX bound_velocity(const KineticEnergyProblem& problem, const VectorX& v, double k, double s0) {
  VectorX gradient = VectorX::Zero(v.size());
  for (int i = 0; i < problem.num_contacts(); ++i) {
    gradient[3 * i] = VelocityBound(v[3 * i] + problem.gap_speed[i], k, s0).slope;
  }
  return problem.A * gradient;
}

// The cost and its derivatives at f. Inside the cones only; cost is infinite outside.
class Objective {
 public:
  Objective(const KineticEnergyProblem& problem, const VectorX& c, double cone_k, double bound_k,
            double s0)
      : problem_(problem), c_(c), cone_k_(cone_k), bound_k_(bound_k), s0_(s0) {}

  double cost(const VectorX& f) const {
    const VectorX v = c_ + problem_.A * f;
    double sum = 0.5 * f.dot(v + c_);
    for (int i = 0; i < problem_.num_contacts(); ++i) {
      const double mu = problem_.mu[i], rho = normal_regularizer(cone_law(problem_, i, cone_k_));
      const double tangential = f.segment<2>(3 * i + 1).squaredNorm() / (mu * mu);
      const double inside = f[3 * i] * f[3 * i] - tangential;
      if (!(f[3 * i] > 0.0 && inside > 0.0)) return std::numeric_limits<double>::infinity();
      sum += 0.5 * rho * (f[3 * i] * f[3 * i] + tangential) - 0.5 * cone_k_ * std::log(inside);
      sum += VelocityBound(v[3 * i] + problem_.gap_speed[i], bound_k_, s0_).value;
    }
    return sum;
  }

  void differentiate(const VectorX& f, VectorX& gradient, MatrixX& hessian) const {
    const VectorX v = c_ + problem_.A * f;
    gradient = v;
    hessian = problem_.A;
    for (int i = 0; i < problem_.num_contacts(); ++i) {
      const VelocityBound q(v[3 * i] + problem_.gap_speed[i], bound_k_, s0_);
      const auto column = problem_.A.col(3 * i);
      gradient += q.slope * column;
      hessian.noalias() += q.curvature * column * column.transpose();
      // Barrier -(k/2) log(f' S f), S = diag(1, -1/mu^2, -1/mu^2), and rho/2 f' |S| f.
      const double mu = problem_.mu[i], rho = normal_regularizer(cone_law(problem_, i, cone_k_));
      const Eigen::Vector3d s(1.0, -1.0 / (mu * mu), -1.0 / (mu * mu));
      const Eigen::Vector3d part = f.segment<3>(3 * i);
      const Eigen::Vector3d image = s.cwiseProduct(part);
      const double inside = part.dot(image);
      gradient.segment<3>(3 * i) +=
          rho * s.cwiseAbs().cwiseProduct(part) - cone_k_ / inside * image;
      Eigen::Matrix3d block = 2.0 * cone_k_ / (inside * inside) * image * image.transpose();
      block.diagonal() += rho * s.cwiseAbs() - cone_k_ / inside * s;
      hessian.block<3, 3>(3 * i, 3 * i) += block;
    }
  }

 private:
  const KineticEnergyProblem& problem_;
  const VectorX& c_;
  double cone_k_, bound_k_, s0_;
};

constexpr double kSufficientDecrease = 1e-4;
constexpr double kPathFactor = 0.2;
constexpr double kPathDecrement = 1e-2;  // relative to k: how well a point on the path is solved
constexpr int kMaxHalvings = 60;
constexpr double kQuadraticRegion = 0.02;

// Damped Newton until the decrement is below `goal`, or round-off stops it. False if out of steps.
// `k` is the smallest weight of a barrier: where the decrement is well below it, Newton's full step
// is safe (the barriers are self-concordant), and costs, which could not tell such points apart,
// are not asked.
bool minimize(const Objective& objective, double k, double goal, int max_iterations, VectorX& f,
              int& iterations) {
  VectorX gradient;
  MatrixX hessian;
  double cost = objective.cost(f), last = std::numeric_limits<double>::infinity();
  while (iterations < max_iterations) {
    objective.differentiate(f, gradient, hessian);
    const VectorX step = hessian.ldlt().solve(-gradient);
    const double decrease = -gradient.dot(step);
    if (!(decrease > goal)) return true;
    if (decrease < kQuadraticRegion * k) {
      if (decrease > 0.5 * last) return true;  // round-off
      last = decrease;
      f += step;
      ++iterations;
      continue;
    }
    ++iterations;
    double alpha = 1.0, trial = objective.cost(f + step);
    for (int i = 0; trial > cost - kSufficientDecrease * alpha * decrease; ++i) {
      if (i == kMaxHalvings) return true;
      alpha *= 0.5;
      trial = objective.cost(f + alpha * step);
    }
    cost = trial;
    f += alpha * step;
  }
  return false;
}

}  // namespace

double distant_regularizer(double regularizer, double gap, double range) {
  const double share = std::max(0.0, gap) / range;
  return regularizer * (1.0 + share * share);
}

KineticEnergyResult solve_kinetic_energy(const KineticEnergyProblem& problem, const VectorX& c,
                                         const Settings& settings) {
  KineticEnergyResult out;
  const int contacts = problem.num_contacts();
  out.f.setZero(3 * contacts);
  out.v = c;
  out.c = c;
  if (!problem.A.allFinite() || !c.allFinite()) {
    out.status = Status::kNotFinite;
    return out;
  }
  if (contacts == 0) return out;
  const double speed = std::max(c.cwiseAbs().maxCoeff(), 1e-12);
  const double inverse_mass = problem.A.diagonal().maxCoeff();
  for (int i = 0; i < contacts; ++i) out.f[3 * i] = speed / inverse_mass;
  double kappa = speed * speed / inverse_mass;  // k on the path
  const double end = std::min(problem.smoothing, problem.velocity_smoothing);
  bool solved = true;
  for (bool last = false; !last && solved; kappa *= kPathFactor) {
    last = kappa <= end;
    const double cone_k = std::max(problem.smoothing, last ? 0.0 : kappa);
    const double bound_k = std::max(problem.velocity_smoothing, last ? 0.0 : kappa);
    const double s0 = std::max(problem.continuation_speed,
                               last ? 0.0 : speed * kappa * inverse_mass / (speed * speed) * 0.1);
    const Objective objective(problem, c, cone_k, bound_k, s0);
    const double goal = last ? 0.0 : kPathDecrement * kappa;
    solved = minimize(objective, std::min(cone_k, bound_k), goal, settings.max_iterations, out.f,
                      out.iterations);
  }
  out.v = c + problem.A * out.f;
  const VectorX again = invert_kinetic_energy(problem, out.v).f;
  out.residual = (again - out.f).norm() / out.f.norm();
  // The closed form amplifies the round-off of v by 1 / r and by the curvature of q.
  constexpr double kAcceptable = 1e-6;
  if (!(out.residual <= settings.tolerance)) {
    out.status = !solved                       ? Status::kMaxIterations
                 : out.residual <= kAcceptable ? Status::kRoundoffFloor
                                               : Status::kLineSearchFailed;
  }
  return out;
}

KineticEnergyResult invert_kinetic_energy(const KineticEnergyProblem& problem, const VectorX& v) {
  KineticEnergyResult out;
  const VectorX y =
      v + bound_velocity(problem, v, problem.velocity_smoothing, problem.continuation_speed);
  out.f.setZero(v.size());
  for (int i = 0; i < problem.num_contacts(); ++i) {
    impulse(cone_law(problem, i, problem.smoothing), y.data() + 3 * i, out.f.data() + 3 * i);
  }
  out.v = v;
  out.c = v - problem.A * out.f;
  return out;
}

}  // namespace counterpoint::contact
