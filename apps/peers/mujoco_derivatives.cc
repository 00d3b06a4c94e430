#include "mujoco_derivatives.h"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

namespace counterpoint::peers {

namespace {

constexpr double kAdvised = 1e-6;  ///< step of the differences in MuJoCo's documentation

/// Richardson extrapolation (4 near - far) / 3 of central differences with one step and with twice
/// that.
void extrapolate(const std::vector<double>& far, std::vector<double>& near) {
  for (std::size_t i = 0; i < near.size(); ++i) near[i] = (4.0 * near[i] - far[i]) / 3.0;
}

}  // namespace

MujocoDerivatives::MujocoDerivatives(Mujoco& mujoco)
    : m_(mujoco.own_model()), d_(mujoco.own_data()) {}

void MujocoDerivatives::set(const MujocoMoment& moment) {
  std::copy(moment.qpos.begin(), moment.qpos.end(), d_->qpos);
  std::copy(moment.qvel.begin(), moment.qvel.end(), d_->qvel);
  std::copy(moment.qacc.begin(), moment.qacc.end(), d_->qacc);
  std::copy(moment.qacc.begin(), moment.qacc.end(), d_->qacc_warmstart);
}

void MujocoDerivatives::inverse(const MujocoMoment& moment) {
  const auto block = static_cast<std::size_t>(m_->nv * m_->nv);
  out_.resize(3 * block);
  set(moment);
  mjd_inverseFD(m_, d_, kAdvised, 0, out_.data(), out_.data() + block, out_.data() + 2 * block,
                nullptr, nullptr, nullptr, nullptr);
}

void MujocoDerivatives::differences(const MujocoMoment& moment, double eps, bool centered) {
  const auto size = static_cast<std::size_t>(2 * m_->nv + m_->na);
  out_.resize(size * size);
  set(moment);
  mjd_transitionFD(m_, d_, eps, centered, out_.data(), nullptr, nullptr, nullptr);
}

void MujocoDerivatives::transition(const MujocoMoment& moment, bool centered) {
  differences(moment, kAdvised, centered);
}

double MujocoDerivatives::error(const std::vector<double>& reference, std::size_t blocks) const {
  const std::size_t size = reference.size() / blocks;
  double worst = 0.0;
  for (std::size_t b = 0; b < blocks; ++b) {
    double apart = 0.0, scale = 0.0;
    for (std::size_t i = b * size; i < (b + 1) * size; ++i) {
      apart = std::max(apart, std::abs(out_[i] - reference[i]));
      scale = std::max(scale, std::abs(reference[i]));
    }
    if (scale > 0.0) worst = std::max(worst, apart / scale);
  }
  return worst;
}

double MujocoDerivatives::inverse_error(const MujocoMoment& moment) {
  const int nv = m_->nv;
  const auto n = static_cast<std::size_t>(nv);
  std::vector<double> direction(n, 0.0), plus(n);
  // Blocks with respect to q, v and a; one row per coordinate, as in mjd_inverseFD.
  const auto central = [&](double eps, std::vector<double>& out) {
    out.resize(3 * n * n);
    for (std::size_t b = 0; b < 3; ++b)
      for (std::size_t k = 0; k < n; ++k) {
        for (const double s : {eps, -eps}) {
          set(moment);
          direction[k] = 1.0;
          if (b == 0) mj_integratePos(m_, d_->qpos, direction.data(), s);
          direction[k] = 0.0;
          if (b > 0) (b == 1 ? d_->qvel : d_->qacc)[k] += s;
          mj_inverse(m_, d_);
          double* row = out.data() + (b * n + k) * n;
          if (s > 0.0) {
            std::copy(d_->qfrc_inverse, d_->qfrc_inverse + nv, plus.begin());
          } else {
            for (std::size_t i = 0; i < n; ++i)
              row[i] = (plus[i] - d_->qfrc_inverse[i]) / (2 * eps);
          }
        }
      }
  };
  constexpr double kStep = 1e-5;
  std::vector<double> reference, far;
  central(2.0 * kStep, far);
  central(kStep, reference);
  extrapolate(far, reference);
  inverse(moment);
  return error(reference, 3);
}

double MujocoDerivatives::transition_error(const MujocoMoment& moment, bool centered) {
  constexpr double kStep = 1e-5;
  constexpr int kEnough = 200;
  const double tolerance = m_->opt.tolerance;
  const int iterations = m_->opt.iterations;
  m_->opt.tolerance = 0.0;
  m_->opt.iterations = kEnough;
  differences(moment, 2.0 * kStep, true);
  const std::vector<double> far = out_;
  differences(moment, kStep, true);
  std::vector<double> reference = out_;
  extrapolate(far, reference);
  m_->opt.tolerance = tolerance;
  m_->opt.iterations = iterations;
  transition(moment, centered);
  return error(reference, 1);
}

}  // namespace counterpoint::peers
