#include "counterpoint/engine/optimize/feedback.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/terms/effort_limits.h"
#include "counterpoint/engine/optimize/terms/evaluator.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::optimization {
namespace {

/// Force scale of joints without an effort limit [N, N m].
constexpr double kEffort = 100.0;

struct LinearStep {
  MatrixX A, B;
  bool known = false;
};

VectorX effort_scales(const Model& model) {
  VectorX scale = VectorX::Constant(model.nv(), kEffort);
  for (int i = 1; i < model.num_bodies(); ++i) {
    const double limit = model.joint(i - 1).effort_limit;
    const Body& body = model.body(i);
    if (std::isfinite(limit) && limit > 0.0)
      scale.segment(body.v_index, joint_nv(body.joint_type)).setConstant(limit);
  }
  return scale;
}

std::vector<LinearStep> linearize(const Problem& problem, const Stage& stage,
                                  const Result& result) {
  const Model& model = *problem.model;
  const int nv = model.nv();
  Workspace workspace(model);
  Inverse inverse;
  InverseDerivatives by_inverse;
  ForwardDerivatives d;
  std::vector<LinearStep> steps(static_cast<std::size_t>(problem.steps));
  for (std::size_t t = 0; t < steps.size(); ++t) {
    steps[t].known =
        step_forward_derivatives(model, stage.options, result.q[t], result.v[t], result.v[t + 1],
                                 Input(), workspace, inverse, by_inverse, d);
    if (!steps[t].known) continue;
    steps[t].A.resize(2 * nv, 2 * nv);
    steps[t].A << d.dq_dq, d.dq_dv, d.dv_dq, d.dv_dv;
    steps[t].B.resize(2 * nv, nv);
    steps[t].B << d.dq_du, d.dv_du;
    steps[t].known = steps[t].A.allFinite() && steps[t].B.allFinite();
    for (int i = 0; i < nv; ++i)
      if (!problem.motors[static_cast<std::size_t>(i)]) steps[t].B.col(i).setZero();
  }
  return steps;
}

/// Permutes and signs rows and columns of M, over (q, v) or over v, by the mirror.
MatrixX mirrored(const MatrixX& M, const Mirror& mirror) {
  const Eigen::Index nv = mirror.v_sign.size();
  MatrixX out(M.rows(), M.cols());
  const auto source = [&](Eigen::Index i) {
    return i / nv * nv + mirror.v_index[static_cast<std::size_t>(i % nv)];
  };
  for (Eigen::Index j = 0; j < M.cols(); ++j)
    for (Eigen::Index i = 0; i < M.rows(); ++i)
      out(i, j) = mirror.v_sign[i % nv] * mirror.v_sign[j % nv] * M(source(i), source(j));
  return out;
}

VectorX mirrored_velocity(const VectorX& v, const Mirror& mirror) {
  VectorX out(v.size());
  for (Eigen::Index i = 0; i < v.size(); ++i)
    out[i] = mirror.v_sign[i] * v[mirror.v_index[static_cast<std::size_t>(i)]];
  return out;
}

}  // namespace

Feedback compute_feedback(const Problem& problem, const Settings& settings, const Result& result,
                          const FeedbackSettings& feedback) {
  check_problem(problem);
  const int nv = problem.model->nv();
  Stage stage = stage_at(problem, settings, feedback.smoothing);
  stage.options.time_step = result.options.time_step;
  const std::vector<LinearStep> steps = linearize(problem, stage, result);
  VectorX weight(2 * nv);
  weight << VectorX::Constant(nv, feedback.position_weight),
      VectorX::Constant(nv, feedback.velocity_weight);
  const MatrixX Q = weight.cwiseAbs2().asDiagonal();
  const MatrixX R = (feedback.effort_weight * effort_scales(*problem.model).cwiseInverse())
                        .cwiseAbs2()
                        .asDiagonal();
  Feedback out;
  out.gains.assign(steps.size(), MatrixX::Zero(nv, 2 * nv));
  MatrixX P = Q;
  const int cycles = problem.periodic ? feedback.cycles : 1;
  for (int cycle = 0; cycle < cycles; ++cycle) {
    out.missing = 0;
    if (cycle > 0 && problem.mirror) P = mirrored(P, *problem.mirror);
    for (std::size_t t = steps.size(); t-- > 0;) {
      if (!steps[t].known) {
        ++out.missing;
        if (t + 1 < steps.size()) out.gains[t] = out.gains[t + 1];
        continue;
      }
      const MatrixX PB = P * steps[t].B;
      const MatrixX PA = P * steps[t].A;
      const MatrixX S = R + steps[t].B.transpose() * PB;
      out.gains[t] = S.llt().solve(steps[t].B.transpose() * PA);
      P = Q + steps[t].A.transpose() * (PA - PB * out.gains[t]);
      P = MatrixX(0.5 * (P + P.transpose()));
    }
  }
  return out;
}

RepeatedMotion repeated(const Problem& problem, const Result& result, const Feedback* feedback,
                        int cycles) {
  RepeatedMotion out;
  const std::size_t steps = result.applied_force.size();
  std::vector<VectorX> q = result.q, v = result.v, u = result.applied_force;
  std::vector<MatrixX> gains = feedback ? feedback->gains : std::vector<MatrixX>();
  const int count = problem.periodic ? cycles : 1;
  Frames frames(problem, result.q);
  for (int cycle = 0; cycle < count; ++cycle) {
    for (std::size_t t = 0; t < steps; ++t) {
      out.q.push_back(q[t]);
      out.v.push_back(v[t]);
      out.applied_force.push_back(u[t]);
      if (!gains.empty()) out.gains.push_back(gains[t]);
    }
    if (cycle + 1 == count) {
      out.q.push_back(q[steps]);
      out.v.push_back(v[steps]);
      break;
    }
    for (VectorX& frame : q) frame = frames.image(frame, 1.0);
    if (!problem.mirror) continue;
    for (VectorX& velocity : v) velocity = mirrored_velocity(velocity, *problem.mirror);
    for (VectorX& force : u) force = mirrored_velocity(force, *problem.mirror);
    for (MatrixX& gain : gains) gain = mirrored(gain, *problem.mirror);
  }
  return out;
}

void write_feedback(const std::filesystem::path& file, const Model& model,
                    const std::vector<MatrixX>& gains) {
  std::vector<Column> columns{"step", "v_index"};
  const CoordinateNames names = coordinate_names(model);
  for (const char* of : {".dq", ".dv"})
    for (const std::string& name : names.v) columns.push_back(name + of);
  TableWriter table(file, columns);
  for (std::size_t t = 0; t < gains.size(); ++t) {
    for (Eigen::Index i = 0; i < gains[t].rows(); ++i) {
      if (gains[t].row(i).isZero(0.0)) continue;
      table.number(static_cast<double>(t));
      table.number(static_cast<double>(i));
      for (const double x : gains[t].row(i)) table.number(x);
      table.end_row();
    }
  }
  table.finish();
}

std::vector<MatrixX> read_feedback(const std::filesystem::path& file, const Model& model) {
  const Table table(file);
  const int step = table.column("step"), index = table.column("v_index");
  std::vector<int> columns;
  const CoordinateNames names = coordinate_names(model);
  for (const char* of : {".dq", ".dv"})
    for (const std::string& name : names.v) columns.push_back(table.column(name + of));
  std::vector<MatrixX> gains;
  for (int row = 0; row < table.num_rows(); ++row) {
    const double t = table.value(row, step), i = table.value(row, index);
    if (!(t >= 0.0 && t < 1e7) || !(i >= 0.0 && i < model.nv()))
      throw InputError(
          fmt::format("{}: step {} or v_index {} is none of this scene's", table.where(row), t, i));
    while (gains.size() <= static_cast<std::size_t>(t))
      gains.push_back(MatrixX::Zero(model.nv(), 2 * model.nv()));
    for (std::size_t k = 0; k < columns.size(); ++k)
      gains[static_cast<std::size_t>(t)](static_cast<Eigen::Index>(i),
                                         static_cast<Eigen::Index>(k)) =
          table.value(row, columns[k]);
  }
  return gains;
}

VectorX following_force(const Model& model, const VectorX& q_plan, const VectorX& v_plan,
                        const VectorX& u_plan, const MatrixX& gain, const VectorX& q,
                        const VectorX& v) {
  VectorX u = u_plan;
  if (gain.size() > 0) {
    VectorX x(2 * model.nv());
    configuration_difference(model, q_plan, q, x.head(model.nv()));
    x.tail(model.nv()) = v - v_plan;
    u.noalias() -= gain * x;
  }
  clamp_to_effort_limits(model, u);
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    if (!model.joint(i - 1).actuated) u.segment(body.v_index, joint_nv(body.joint_type)).setZero();
  }
  return u;
}

}  // namespace counterpoint::optimization
