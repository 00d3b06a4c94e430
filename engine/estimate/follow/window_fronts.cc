#include "counterpoint/engine/estimate/follow/window_fronts.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "counterpoint/engine/estimate/sensors/motion_filter.h"

namespace counterpoint::estimation {
namespace {

constexpr int kFrames = WindowFronts::kSeen - 1;  ///< number of frames of a front
/// Added to the diagonal for coordinates without weight [1/m^2, 1/rad^2], and relative increase of
/// the diagonal against round-off.
constexpr double kLeastWindowDiagonal = 1e-9, kRegular = 1e-13;

}  // namespace

WindowFronts::WindowFronts(const Model& model, int window, int parameters)
    : model_(model),
      nv_(model.nv()),
      parameters_(parameters),
      fronts_(index_of(window + 1)),
      panels_(index_of(window)) {
  for (int k = 0; k <= window; ++k) clear(k);
  for (Panel& panel : panels_) panel.factor.resize(kSeen * nv_ + parameters_, nv_);
}

void WindowFronts::clear(int frame) {
  WindowFront& front = fronts_[index_of(frame)];
  const int rows = kFrames * nv_ + parameters_;
  front.information.setZero(rows, rows);
  front.gradient.setZero(rows);
}

void WindowFronts::add(int frame, const InstantEquations& equations, int before) {
  WindowFront& front = fronts_[index_of(frame)];
  const int skip = before * nv_, rows = std::min(kFrames, kSeen - before) * nv_;
  front.information.topLeftCorner(rows, rows) += equations.gram.block(skip, skip, rows, rows);
  front.information.bottomLeftCorner(parameters_, rows) +=
      equations.border.middleRows(skip, rows).transpose();
  front.information.bottomRightCorner(parameters_, parameters_) += equations.corner;
  front.gradient.head(rows) += equations.gradient.segment(skip, rows);
  front.gradient.tail(parameters_) += equations.corner_gradient;
}

/// Difference from the front's linearization point; frames that do not exist yet count as zero.
VectorX WindowFronts::difference(int frame, const MotionPoint& point) const {
  const WindowFront& front = fronts_[index_of(frame)];
  VectorX x = VectorX::Zero(front.gradient.size());
  for (int a = 0; a < kFrames && index_of(frame + a) < point.q.size(); ++a)
    if (index_of(a) < front.at.q.size())
      configuration_difference(model_, front.at.q[index_of(a)], point.q[index_of(frame + a)],
                               x.segment(a * nv_, nv_));
  x.tail(parameters_) = point.parameters - front.at.parameters;
  return x;
}

void WindowFronts::move(int frame, const MotionPoint& point) {
  WindowFront& front = fronts_[index_of(frame)];
  const VectorX x = difference(frame, point);
  front.gradient += front.information.selfadjointView<Eigen::Lower>() * x;
  if (frame > 0 && panels_[index_of(frame - 1)].y.size() == nv_) {  // the panel's other rows belong
                                                                    // to this front's variables
    Panel& before = panels_[index_of(frame - 1)];
    before.y += before.factor.bottomRows(kFrames * nv_ + parameters_).transpose() * x;
  }
  front.at.q.resize(index_of(kFrames));
  for (int a = 0; a < kFrames && index_of(frame + a) < point.q.size(); ++a)
    front.at.q[index_of(a)] = point.q[index_of(frame + a)];
  front.at.parameters = point.parameters;
}

bool WindowFronts::eliminate(int frame, const InstantEquations* added, double damping,
                             const MotionPoint& point) {
  const int m = nv_, old = kFrames * m, all = kSeen * m;
  const WindowFront& front = fronts_[index_of(frame)];
  WindowFront& next = fronts_[index_of(frame + 1)];
  Panel& panel = panels_[index_of(frame)];
  work_.setZero(all + parameters_, all + parameters_);
  work_gradient_.setZero(all + parameters_);
  work_.topLeftCorner(old, old) = front.information.topLeftCorner(old, old);
  work_.bottomLeftCorner(parameters_, old) = front.information.bottomLeftCorner(parameters_, old);
  work_.bottomRightCorner(parameters_, parameters_) =
      front.information.bottomRightCorner(parameters_, parameters_);
  work_gradient_.head(old) = front.gradient.head(old);
  work_gradient_.tail(parameters_) = front.gradient.tail(parameters_);
  if (added != nullptr) {
    work_.topLeftCorner(all, all) += added->gram;
    work_.bottomLeftCorner(parameters_, all) += added->border.transpose();
    work_.bottomRightCorner(parameters_, parameters_) += added->corner;
    work_gradient_.head(all) += added->gradient;
    work_gradient_.tail(parameters_) += added->corner_gradient;
  }
  panel.factor = work_.leftCols(m);
  auto own = panel.factor.topRows(m);
  auto others = panel.factor.bottomRows(old + parameters_);
  own.diagonal() *= 1.0 + damping + kRegular;
  own.diagonal().array() += kLeastWindowDiagonal;
  Eigen::Ref<MatrixX> in_place = own;
  if (Eigen::LLT<Eigen::Ref<MatrixX>>(in_place).info() != Eigen::Success) return false;
  own.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(others);
  panel.y = work_gradient_.head(m);
  own.triangularView<Eigen::Lower>().solveInPlace(panel.y);
  panel.at = point.q[index_of(frame)];
  next.information = work_.bottomRightCorner(old + parameters_, old + parameters_);
  next.information.selfadjointView<Eigen::Lower>().rankUpdate(others, -1.0);
  next.gradient = work_gradient_.tail(old + parameters_);
  next.gradient.noalias() -= others * panel.y;
  next.at.q.resize(index_of(kFrames));
  for (int a = 0; a < kFrames && index_of(frame + 1 + a) < point.q.size(); ++a)
    next.at.q[index_of(a)] = point.q[index_of(frame + 1 + a)];
  next.at.parameters = point.parameters;
  return true;
}

bool WindowFronts::solve_parameters(int frames, double damping, VectorX& step) const {
  const WindowFront& last = fronts_[index_of(frames)];
  step = -last.gradient.tail(parameters_);
  if (parameters_ == 0) return true;
  MatrixX A = last.information.bottomRightCorner(parameters_, parameters_);
  A.diagonal() *= 1.0 + damping + kRegular;
  const Eigen::LLT<MatrixX> factor(A);
  if (factor.info() != Eigen::Success) return false;
  factor.solveInPlace(step);
  return true;
}

VectorX WindowFronts::substitute(int frame, const MotionPoint& point) const {
  const Panel& panel = panels_[index_of(frame)];
  const auto others = panel.factor.bottomRows(kFrames * nv_ + parameters_);
  VectorX out = -panel.y;
  out.noalias() -= others.transpose() * difference(frame + 1, point);
  panel.factor.topRows(nv_).triangularView<Eigen::Lower>().transpose().solveInPlace(out);
  return out;
}

VectorX WindowFronts::substitute(int frame, const MatrixX& steps, const VectorX& parameters) const {
  const Panel& panel = panels_[index_of(frame)];
  VectorX out = -panel.y;
  for (int a = 1; a < kSeen && frame + a < steps.cols(); ++a)
    out.noalias() -= panel.factor.middleRows(a * nv_, nv_).transpose() * steps.col(frame + a);
  out.noalias() -= panel.factor.bottomRows(parameters_).transpose() * parameters;
  panel.factor.topRows(nv_).triangularView<Eigen::Lower>().transpose().solveInPlace(out);
  return out;
}

double WindowFronts::cost(int frame, const MotionPoint& point) const {
  const VectorX x = difference(frame, point);
  const WindowFront& front = fronts_[index_of(frame)];
  const VectorX pull = front.information.selfadjointView<Eigen::Lower>() * x;
  return x.dot(0.5 * pull + front.gradient);
}

void WindowFronts::drop_first() {
  std::rotate(fronts_.begin(), fronts_.begin() + 1, fronts_.end());
  std::rotate(panels_.begin(), panels_.begin() + 1, panels_.end());
}

}  // namespace counterpoint::estimation
