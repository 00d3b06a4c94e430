#include "counterpoint/engine/estimate/sensors/pose_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/estimate/sensors/motion_filter.h"
#include "counterpoint/engine/optimize/terms/kinematic_terms.h"

namespace counterpoint::estimation {
namespace {

/// Prior standard deviation of coordinates about the row before [m, rad]; a coordinate counts as
/// seen if the sensors alone determine it better than kSeen.
constexpr double kLoose = 1.0, kSeen = 0.1;
/// Limits of steps in the first row and in the others; the search ends at steps below kStillPose
/// [m, rad].
constexpr int kFirstSteps = 200, kRowSteps = 20;
constexpr double kStillPose = 1e-9;
/// Largest step of a coordinate [m, rad].
constexpr double kLongestPoseStep = 0.5;

class PoseFit {
 public:
  PoseFit(const Model& model, const std::vector<SensorTerm>& sensors, double start, double h,
          const VectorX& recorded)
      : model_(model),
        sensors_(sensors),
        rows_(model, sensors_, 0),
        start_(start),
        h_(h),
        free_(VectorX::Ones(model.nv()) - recorded) {}

  /// Fits frame t; sets `seen` (nv) to 1 where sensors determine a coordinate.
  void fit(int t, int most_steps, std::vector<VectorX>& frames, Eigen::Ref<VectorX> seen) {
    VectorX& q = frames[static_cast<std::size_t>(t)];
    const VectorX before = q;
    double damping = 1e-6, cost = cost_of(frames, t, before);
    for (int step = 0; step < most_steps; ++step) {
      rows_.evaluate(model_, at(frames), t, true);
      const auto& rows = rows_.of_frame();
      const MatrixX J = rows.by_frames.topRows(rows.size) * free_.asDiagonal();
      const VectorX r = rows.residual.head(rows.size);
      MatrixX gram = J.transpose() * J;
      seen = (gram.diagonal().array() > 1.0 / (kSeen * kSeen)).cast<double>();
      VectorX gradient = J.transpose() * r + difference(model_, before, q) / (kLoose * kLoose);
      gram.diagonal().array() += 1.0 / (kLoose * kLoose);
      bool better = false;
      double longest = 0.0;
      for (int trial = 0; trial < 8 && !better; ++trial) {
        MatrixX damped = gram;
        damped.diagonal() *= 1.0 + damping;
        VectorX by = -damped.llt().solve(gradient);
        longest = by.cwiseAbs().maxCoeff();
        if (longest > kLongestPoseStep) by *= kLongestPoseStep / longest;
        const VectorX last = q;
        q = moved(model_, last, by);
        const double now = cost_of(frames, t, before);
        better = now < cost;
        damping = better ? 0.2 * damping : std::max(1e-6, 10.0 * damping);
        if (better)
          cost = now;
        else
          q = last;
      }
      if (!better || longest < kStillPose) return;
    }
  }

  /// Places floating trees by their points, with joints as in frame 0.
  void place(std::vector<VectorX>& frames) {
    VectorX& q = frames.front();
    Data data(model_);
    compute_poses(model_, q, data);
    for (const Tree& tree : model_.trees()) {
      const Body& root = model_.body(tree.body_begin);
      if (root.joint_type != JointType::kFloating || free_[root.v_index] == 0.0) continue;
      std::vector<Vector3> here, there;
      for (const SensorTerm& term : sensors_) {
        Reading reading;
        const int body = term.sensor.body;
        if (term.sensor.kind != SensorKind::kPoint || body < tree.body_begin ||
            body >= tree.body_end || !term.signal.read_frame(start_ + term.delay, h_, reading))
          continue;
        here.push_back(optimization::point_position(data, body, term.sensor.point));
        there.push_back(reading.head<3>());
      }
      if (here.size() < 3) continue;
      const auto n = static_cast<Eigen::Index>(here.size());
      const Eigen::Matrix3Xd from = Eigen::Map<const Eigen::Matrix3Xd>(here[0].data(), 3, n);
      const Eigen::Matrix3Xd to = Eigen::Map<const Eigen::Matrix3Xd>(there[0].data(), 3, n);
      const Eigen::Matrix4d move = Eigen::umeyama(from, to, false);
      const Matrix3 turn = move.topLeftCorner<3, 3>();
      auto position = q.segment<3>(root.q_index);
      position = turn * position + move.topRightCorner<3, 1>();
      auto orientation = q.segment<4>(root.q_index + 3);
      const Quaternion old(orientation[0], orientation[1], orientation[2], orientation[3]);
      const Quaternion turned = (Quaternion(turn) * old).normalized();
      orientation << turned.w(), turned.x(), turned.y(), turned.z();
    }
  }

 private:
  SensorFrames at(const std::vector<VectorX>& frames) const {
    return {frames, no_constants_, start_, h_};
  }

  double cost_of(const std::vector<VectorX>& frames, int t, const VectorX& before) {
    rows_.evaluate(model_, at(frames), t, false);
    const auto& rows = rows_.of_frame();
    const double loose =
        difference(model_, before, frames[static_cast<std::size_t>(t)]).squaredNorm();
    return rows.residual.head(rows.size).squaredNorm() + loose / (kLoose * kLoose);
  }

  const Model& model_;
  const std::vector<SensorTerm> sensors_;
  SensorRows rows_;
  double start_, h_;
  VectorX free_;  ///< nv: 0 for recorded coordinates
  const VectorX no_constants_;
};

/// Returns the position sensors, without unknown constants.
std::vector<SensorTerm> position_terms(const std::vector<SensorTerm>& all) {
  std::vector<SensorTerm> out;
  for (SensorTerm term : all) {
    if (!is_position(term.sensor.kind)) continue;
    term.delay_constant = term.offset_constant = term.scale_constant = -1;
    term.position_constant = term.rotation_constant = -1;
    out.push_back(std::move(term));
  }
  return out;
}

}  // namespace

FittedPoses fit_poses(const Model& model, const std::vector<SensorTerm>& sensors, double start,
                      double h, const std::vector<VectorX>& frames, const VectorX& recorded) {
  FittedPoses out{frames, MatrixX::Zero(model.nv(), static_cast<Eigen::Index>(frames.size()))};
  PoseFit fit(model, position_terms(sensors), start, h, recorded);
  fit.place(out.frames);
  VectorX seen(model.nv());
  for (int t = 0; t < static_cast<int>(frames.size()); ++t) {
    const auto i = static_cast<std::size_t>(t);
    if (t > 0) {
      // Recorded coordinates come from this row; the others start from the row before.
      const VectorX by = difference(model, out.frames[i - 1], frames[i]).cwiseProduct(recorded);
      out.frames[i] = moved(model, out.frames[i - 1], by);
    }
    seen.setZero();
    fit.fit(t, t == 0 ? kFirstSteps : kRowSteps, out.frames, seen);
    out.seen.col(t) = seen;
  }
  MatrixX known = out.seen;
  known.colwise() += recorded;
  fill_gaps(model, known, out.frames);
  return out;
}

void fill_gaps(const Model& model, const MatrixX& seen, std::vector<VectorX>& frames) {
  const auto rows = static_cast<Eigen::Index>(frames.size());
  for (int b = 1; b < model.num_bodies(); ++b) {
    const Body& body = model.body(b);
    const int nq = joint_nq(body.joint_type), nv = joint_nv(body.joint_type);
    if (nv == 0) continue;
    const auto whole = seen.middleRows(body.v_index, nv).colwise().minCoeff();
    Eigen::Index last = -1;
    for (Eigen::Index row = 0; row < rows; ++row) {
      if (whole[row] == 0.0) continue;
      for (Eigen::Index k = last + 1; last >= 0 && k < row; ++k) {
        const auto from = static_cast<std::size_t>(last), to = static_cast<std::size_t>(row);
        const double share = static_cast<double>(k - last) / static_cast<double>(row - last);
        const VectorX between =
            moved(model, frames[from], share * difference(model, frames[from], frames[to]));
        frames[static_cast<std::size_t>(k)].segment(body.q_index, nq) =
            between.segment(body.q_index, nq);
      }
      last = row;
    }
  }
}

}  // namespace counterpoint::estimation
