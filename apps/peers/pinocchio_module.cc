// Module behind pinocchio.h, the only file that includes Pinocchio.
#include <cstdio>
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/parsers/urdf.hpp>
#include <vector>

#include "pinocchio.h"

#define COUNTERPOINT_EXPORT extern "C" __attribute__((visibility("default")))

namespace counterpoint::peers {
namespace {

namespace pin = ::pinocchio;
using VectorX = Eigen::VectorXd;

class Robot final : public PinocchioRobot {
 public:
  Robot(const char* urdf, bool floating, const double* gravity, PinocchioConvention convention)
      : convention_(convention == PinocchioConvention::kWorld ? pin::Convention::WORLD
                                                              : pin::Convention::LOCAL) {
    if (floating) {
      pin::urdf::buildModel(urdf, pin::JointModelFreeFlyer(), model_);
    } else {
      pin::urdf::buildModel(urdf, model_);
    }
    model_.gravity.linear() = Eigen::Vector3d(gravity[0], gravity[1], gravity[2]);
    model_.armature.setZero();
    data_ = pin::Data(model_);
  }

  int nq() const override { return model_.nq; }
  int nv() const override { return model_.nv; }

  bool find_joint(const char* name, PinocchioJoint* joint) const override {
    const std::string wanted = *name ? name : "root_joint";
    if (!model_.existJointName(wanted)) return false;
    const auto id = model_.getJointId(wanted);
    *joint = {static_cast<int>(id) - 1, model_.idx_qs[id], model_.nqs[id], model_.idx_vs[id],
              model_.nvs[id]};
    return true;
  }

  void set_states(int count, const double* q, const double* v, const double* x) override {
    q_.clear();
    v_.clear();
    x_.clear();
    for (int i = 0; i < count; ++i) {
      q_.push_back(Eigen::Map<const VectorX>(q + i * model_.nq, model_.nq));
      v_.push_back(Eigen::Map<const VectorX>(v + i * model_.nv, model_.nv));
      x_.push_back(Eigen::Map<const VectorX>(x + i * model_.nv, model_.nv));
    }
  }

  void run(PinocchioAlgorithm algorithm, int evaluations) override {
    switch (algorithm) {
      case PinocchioAlgorithm::kKinematics:
        return repeat(evaluations,
                      [this](std::size_t i) { pin::forwardKinematics(model_, data_, q_[i]); });
      case PinocchioAlgorithm::kRnea:
        return repeat(evaluations,
                      [this](std::size_t i) { pin::rnea(model_, data_, q_[i], v_[i], x_[i]); });
      case PinocchioAlgorithm::kAba:
        return repeat(evaluations, [this](std::size_t i) {
          pin::aba(model_, data_, q_[i], v_[i], x_[i], convention_);
        });
      case PinocchioAlgorithm::kCrba:
        return repeat(evaluations,
                      [this](std::size_t i) { pin::crba(model_, data_, q_[i], convention_); });
      case PinocchioAlgorithm::kRneaDerivatives:
        return repeat(evaluations, [this](std::size_t i) {
          pin::computeRNEADerivatives(model_, data_, q_[i], v_[i], x_[i]);
        });
      case PinocchioAlgorithm::kAbaDerivatives:
        return repeat(evaluations, [this](std::size_t i) {
          pin::computeABADerivatives(model_, data_, q_[i], v_[i], x_[i]);
        });
    }
  }

  int evaluate(PinocchioAlgorithm algorithm, int state, double* out) override {
    const auto i = static_cast<std::size_t>(state);
    switch (algorithm) {
      case PinocchioAlgorithm::kKinematics: {
        pin::forwardKinematics(model_, data_, q_[i]);
        for (std::size_t j = 1; j < static_cast<std::size_t>(model_.njoints); ++j)
          Eigen::Map<Eigen::Vector3d>(out + 3 * (j - 1)) = data_.oMi[j].translation();
        return 3 * (model_.njoints - 1);
      }
      case PinocchioAlgorithm::kRnea:
        Eigen::Map<VectorX>(out, model_.nv) = pin::rnea(model_, data_, q_[i], v_[i], x_[i]);
        return model_.nv;
      case PinocchioAlgorithm::kAba:
        Eigen::Map<VectorX>(out, model_.nv) =
            pin::aba(model_, data_, q_[i], v_[i], x_[i], convention_);
        return model_.nv;
      case PinocchioAlgorithm::kCrba: {
        data_.M.setZero();
        pin::crba(model_, data_, q_[i], convention_);
        // crba fills the upper triangle only.
        Eigen::Map<Eigen::MatrixXd> M(out, model_.nv, model_.nv);
        M = data_.M.selfadjointView<Eigen::Upper>();
        return model_.nv * model_.nv;
      }
      case PinocchioAlgorithm::kRneaDerivatives:
        pin::computeRNEADerivatives(model_, data_, q_[i], v_[i], x_[i]);
        return put(data_.dtau_dq, data_.dtau_dv, data_.M, out);
      case PinocchioAlgorithm::kAbaDerivatives:
        pin::computeABADerivatives(model_, data_, q_[i], v_[i], x_[i]);
        return put(data_.ddq_dq, data_.ddq_dv, data_.Minv, out);
    }
    return 0;
  }

 private:
  template <class Evaluate>
  void repeat(int evaluations, Evaluate evaluate) {
    const std::size_t count = q_.size();
    for (std::size_t k = 0, i = 0; k < static_cast<std::size_t>(evaluations); ++k) {
      evaluate(i);
      if (++i == count) i = 0;
    }
  }

  /// Copies three nv x nv matrices; of the last only the upper triangle is filled by Pinocchio.
  template <class Matrix, class Symmetric>
  int put(const Matrix& q, const Matrix& v, const Symmetric& x, double* out) const {
    const int nv = model_.nv, size = nv * nv;
    using Map = Eigen::Map<Eigen::MatrixXd>;
    Map(out, nv, nv) = q;
    Map(out + size, nv, nv) = v;
    Map(out + 2 * size, nv, nv) = Eigen::MatrixXd(x).selfadjointView<Eigen::Upper>();
    return 3 * size;
  }

  pin::Model model_;
  pin::Data data_;
  pin::Convention convention_;
  std::vector<VectorX> q_, v_, x_;
};

}  // namespace
}  // namespace counterpoint::peers

COUNTERPOINT_EXPORT const char* counterpoint_pinocchio_version() {
  return PINOCCHIO_VERSION " (" COUNTERPOINT_MODULE_FLAGS ")";
}

COUNTERPOINT_EXPORT counterpoint::peers::PinocchioRobot* counterpoint_pinocchio_load(
    const char* urdf, bool floating, const double* gravity,
    counterpoint::peers::PinocchioConvention convention, char* error, int size) {
  try {
    return new counterpoint::peers::Robot(urdf, floating, gravity, convention);
  } catch (const std::exception& failure) {
    std::snprintf(error, static_cast<std::size_t>(size), "%s", failure.what());
    return nullptr;
  }
}
