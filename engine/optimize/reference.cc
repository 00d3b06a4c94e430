#include "counterpoint/engine/optimize/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "counterpoint/engine/dynamics.h"

namespace counterpoint::optimization {
namespace {

/// True for quantities that scale with the speed of the replay.
bool is_speed(Quantity quantity) {
  return quantity == Quantity::kVelocity || quantity == Quantity::kPointVelocity ||
         quantity == Quantity::kMomentum;
}

VectorX moving_rows(const Model& model, Quantity quantity) {
  VectorX moves = VectorX::Zero(target_size(model, quantity));
  if (quantity == Quantity::kPosition || quantity == Quantity::kCenterOfMass) moves.setOnes();
  if (quantity != Quantity::kConfiguration) return moves;
  for (int i = 1; i < model.num_bodies(); ++i)
    if (model.body(i).joint_type == JointType::kFloating)
      moves.segment<3>(model.body(i).q_index).setOnes();
  return moves;
}

}  // namespace

bool may_follow(Quantity quantity) {
  switch (quantity) {
    case Quantity::kConfiguration:
    case Quantity::kVelocity:
    case Quantity::kAppliedForce:
    case Quantity::kPosition:
    case Quantity::kOrientation:
    case Quantity::kPointVelocity:
    case Quantity::kClearance:
    case Quantity::kCenterOfMass:
    case Quantity::kMomentum:
    case Quantity::kContactForce:
      return true;
    default:
      return false;
  }
}

int target_size(const Model& model, Quantity quantity) {
  if (quantity == Quantity::kConfiguration) return model.nq();
  return quantity == Quantity::kOrientation ? 4 : rows_of(model, quantity);
}

Reference::Reference(const Model& model, Quantity quantity, const Samples& samples,
                     const Playback& playback, const MatrixX* mirrored)
    : model_(&model),
      quantity_(quantity),
      playback_(playback),
      moves_(moving_rows(model, quantity)),
      advance_(VectorX::Zero(moves_.size())) {
  const auto count = static_cast<Eigen::Index>(samples.time.size());
  if (count == 0 || (playback.loop && count < 2))
    throw InputError("a reference needs a row, and one that loops two");
  if (samples.values.rows() != moves_.size() || samples.values.cols() != count)
    throw InputError(fmt::format("a reference of {} x {} values, {} x {} are expected",
                                 samples.values.rows(), samples.values.cols(), moves_.size(),
                                 count));
  for (std::size_t i = 1; i < samples.time.size(); ++i)
    if (!(samples.time[i] > samples.time[i - 1]))
      throw InputError(
          fmt::format("a reference whose time {} does not rise in its row {}", samples.time[i], i));
  const bool only_mirrored = mirrored != nullptr && !playback.loop;
  samples_ = {samples.time, only_mirrored ? *mirrored : samples.values};
  if (mirrored != nullptr && playback.loop) append(*mirrored, samples.time);
  if (playback.loop)
    advance_ = moves_.cwiseProduct(samples_.values.rightCols<1>() - samples_.values.leftCols<1>());
  find_differences();
  if (is_speed(quantity)) {
    samples_.values *= playback.rate;
    difference_ *= playback.rate;
  }
}

/// Appends samples whose first one coincides with the last one so far.
void Reference::append(const MatrixX& values, const std::vector<double>& time) {
  const Eigen::Index before = samples_.values.cols(), more = values.cols() - 1;
  const VectorX shift = moves_.cwiseProduct(samples_.values.rightCols<1>() - values.leftCols<1>());
  samples_.values.conservativeResize(Eigen::NoChange, before + more);
  samples_.values.rightCols(more) = values.rightCols(more).colwise() + shift;
  const double end = samples_.time.back();
  for (std::size_t i = 1; i < time.size(); ++i)
    samples_.time.push_back(end + time[i] - time.front());
}

void Reference::find_differences() {
  const MatrixX& x = samples_.values;
  const Eigen::Index count = x.cols() - 1;
  if (quantity_ == Quantity::kConfiguration) {
    difference_.resize(model_->nv(), count);
    for (Eigen::Index i = 0; i < count; ++i)
      configuration_difference(*model_, x.col(i), x.col(i + 1), difference_.col(i));
  } else if (quantity_ == Quantity::kOrientation) {
    difference_.resize(3, count);
    for (Eigen::Index i = 0; i < count; ++i)
      difference_.col(i) =
          quaternion_log(quaternion_of(x.col(i)).conjugate() * quaternion_of(x.col(i + 1)));
  } else {
    difference_ = x.rightCols(count) - x.leftCols(count);
  }
}

void Reference::sample(double time, VectorX& out) const {
  const std::vector<double>& times = samples_.time;
  double at = playback_.start + playback_.rate * time, cycle = 0.0;
  if (playback_.loop) {
    const double period = times.back() - times.front();
    cycle = std::floor((at - times.front()) / period);
    at -= cycle * period;
  } else if (is_speed(quantity_) && (at < times.front() || at > times.back())) {
    out.setZero(moves_.size());
    return;
  }
  at = std::clamp(at, times.front(), times.back());
  const auto next = std::upper_bound(times.begin() + 1, times.end(), at);
  const auto i = static_cast<std::size_t>(next - times.begin()) - 1;
  const auto column = static_cast<Eigen::Index>(i);
  out = samples_.values.col(column);
  const double share = next == times.end() ? 0.0 : (at - times[i]) / (times[i + 1] - times[i]);
  if (next != times.end() && (share > 0.0 || !difference_.col(column).hasNaN())) {
    const auto difference = difference_.col(column);
    if (quantity_ == Quantity::kConfiguration) {
      integrate_configuration(*model_, samples_.values.col(column), difference, share, out);
    } else if (quantity_ == Quantity::kOrientation) {
      const Quaternion turned = quaternion_of(out) * quaternion_exp(share * difference);
      out << turned.w(), turned.x(), turned.y(), turned.z();
    } else {
      out += share * difference;
    }
  }
  if (cycle != 0.0) out += cycle * advance_;
}

void set_targets(Problem& problem, double time) {
  for (Term& term : problem.terms) {
    if (term.reference == nullptr) continue;
    term.targets.resize(static_cast<std::size_t>(problem.steps) + 1);
    for (std::size_t t = 0; t < term.targets.size(); ++t)
      term.reference->sample(time + static_cast<double>(t) * problem.h(), term.targets[t]);
  }
}

}  // namespace counterpoint::optimization
