#include "counterpoint/engine/estimate/torques/torque_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace counterpoint::estimation {
namespace {

using K = ParameterKind;

/// Rounds of a pass in which the channels' deviations are found.
constexpr int kRounds = 30;
constexpr int kSteps = 60;  ///< Gauss-Newton steps in a round
constexpr int kBack = 2;    ///< corrections of a trial
/// Least deviation of a channel as a share of its largest force, better than any sensor's: exact
/// data have none.
constexpr double kLeastDeviation = 1e-6;
/// Least ratio of a channel's deviations in two rounds: the others are to keep up.
constexpr double kShrink = 0.2;

/// Whether a joint may be at rest: it has dry friction, or is to be given some.
bool may_rest(int coordinate, const std::vector<Parameter>& parameters, const VectorX& friction) {
  return friction[coordinate] > 0.0 ||
         std::any_of(parameters.begin(), parameters.end(), [&](const Parameter& p) {
           return (p.kind == K::kDryFriction || p.kind == K::kBreakawayFriction) &&
                  p.sign_of(coordinate) != 0.0;
         });
}

}  // namespace

TorqueSearch::TorqueSearch(const Coordinates& coordinates, const LinearQuantities& quantities,
                           const std::vector<ChannelRows>& rows, const VectorX& x,
                           const VectorX& friction)
    : coordinates_(coordinates),
      quantities_(quantities),
      x_(x),
      at_pass_(quantities.at(coordinates.values(x))) {
  for (const ChannelRows& one : rows) forces_.push_back(one.coordinate);
  const std::vector<ChannelValues> values =
      channel_values(forces_, coordinates.parameters, coordinates.values(x));
  for (std::size_t c = 0; c < rows.size(); ++c) {
    const ChannelRows& from = rows[c];
    const bool rests = may_rest(from.coordinate, coordinates.parameters, friction);
    std::vector<Eigen::Index> kept;
    Channel& model = models_.emplace_back();
    for (std::size_t i = 0; i < from.rests.size(); ++i) {
      if (rests && from.rests[i]) continue;
      kept.push_back(static_cast<Eigen::Index>(i));
      model.recording.push_back(from.recording[i]);
    }
    const auto count = static_cast<Eigen::Index>(kept.size());
    model.columns.resize(count, quantities.size() + 4);
    model.columns << from.derivatives(kept, Eigen::all), from.modelled(kept), from.slope(kept),
        VectorX::Ones(count), -from.recorded(kept);
    model.gram = model.columns.transpose() * model.columns;
    model.delay = values[c].delay;
    TorqueChannel& channel = channels_.emplace_back();
    channel.coordinate = from.coordinate;
    channel.rows = static_cast<int>(count);
  }
  find_deviations();
}

void TorqueSearch::run() {
  for (int round = 0; round < kRounds; ++round) {
    const VectorX before = x_;
    for (int step = 0; step < kSteps && improve();) ++step;
    find_deviations();
    if (moved(before) <= kSettled) break;
  }
}

double TorqueSearch::moved(const VectorX& before) const {
  double most = 0.0;
  for (Eigen::Index i = 0; i < x_.size(); ++i)
    most = std::max(most, std::abs(x_[i] - before[i]) / coordinates_.range(i));
  return most;
}

double TorqueSearch::misfit() const {
  double sum = 0.0;
  for (const TorqueChannel& channel : channels_) sum += std::log(channel.deviation);
  return sum;
}

MatrixX TorqueSearch::information(MatrixX* by_recording) const {
  const Point point = point_at(x_, true);
  MatrixX H = MatrixX::Zero(x_.size(), x_.size());
  for (std::size_t c = 0; c < models_.size(); ++c) {
    const Channel& model = models_[c];
    const MatrixX d = mixture_derivatives(c, point);
    H.noalias() += weight(c) * d.transpose() * model.gram * d;
    if (by_recording == nullptr) continue;
    const MatrixX J = model.columns * d;
    for (Eigen::Index i = 0; i < J.rows(); ++i)
      by_recording->col(model.recording[static_cast<std::size_t>(i)]) +=
          weight(c) * J.row(i).cwiseAbs2().transpose();
  }
  return H;
}

TorqueSearch::Point TorqueSearch::point_at(const VectorX& x, bool derivatives) const {
  const VectorX values = coordinates_.values(x);
  Point out;
  out.change = quantities_.at(values) - at_pass_;
  if (derivatives) out.derivatives = quantities_.derivatives(coordinates_, x);
  out.channels = channel_values(forces_, coordinates_.parameters, values);
  return out;
}

VectorX TorqueSearch::mixture(std::size_t c, const Point& point) const {
  const ChannelValues& now = point.channels[c];
  VectorX out(point.change.size() + 4);
  out << now.gain * point.change, now.gain, now.gain * (now.delay - models_[c].delay), now.offset,
      1.0;
  return out;
}

MatrixX TorqueSearch::mixture_derivatives(std::size_t c, const Point& point) const {
  const ChannelValues& now = point.channels[c];
  const Eigen::Index linear = point.change.size();
  MatrixX out = MatrixX::Zero(linear + 4, x_.size());
  out.topRows(linear) = now.gain * point.derivatives;
  for (Eigen::Index i = 0; i < x_.size(); ++i) {
    const Parameter& p = coordinates_.parameters[static_cast<std::size_t>(i)];
    const double sign = p.sign_of(forces_[c]);
    if (!is_channel(p.kind) || sign == 0.0) continue;
    if (p.kind == K::kForceOffset) out(linear + 2, i) = sign;
    if (p.kind == K::kForceDelay) out(linear + 1, i) = now.gain;
    if (p.kind == K::kForceGain)  // its coordinate is its logarithm
      out.col(i).head(linear + 2) = mixture(c, point).head(linear + 2);
  }
  return out;
}

double TorqueSearch::weight(std::size_t c) const {
  const TorqueChannel& channel = channels_[c];
  return 1.0 / (channel.deviation * channel.deviation * channel.correlation);
}

double TorqueSearch::cost_of(const VectorX& x) const {
  double sum = (x - coordinates_.prior).cwiseAbs2().dot(coordinates_.prior_weights);
  const Point point = point_at(x, false);
  for (std::size_t c = 0; c < models_.size(); ++c) {
    const VectorX z = mixture(c, point);
    sum += weight(c) * z.dot(models_[c].gram * z);
  }
  return sum;
}

/// Makes a Gauss-Newton step within the bounds, shortened until the cost falls. Returns whether
/// another may help. Directions that are hardly told are long and curved valleys of the cost: each
/// trial is moved back to the bottom by what the step's curvature added to the residuals.
bool TorqueSearch::improve() {
  const Point point = point_at(x_, true);
  const VectorX& prior = coordinates_.prior_weights;
  MatrixX H = MatrixX(prior.asDiagonal());
  VectorX g = prior.cwiseProduct(x_ - coordinates_.prior);
  std::vector<MatrixX> derivatives, products;
  for (std::size_t c = 0; c < models_.size(); ++c) {
    derivatives.push_back(mixture_derivatives(c, point));
    products.push_back(weight(c) * models_[c].gram * derivatives[c]);
    H.noalias() += derivatives[c].transpose() * products[c];
    g.noalias() += products[c].transpose() * mixture(c, point);
  }
  const VectorX scale = H.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<MatrixX> factors(scale.asDiagonal() * H * scale.asDiagonal());
  const auto within = [&](const VectorX& x) -> VectorX {
    return x.cwiseMax(coordinates_.lower).cwiseMin(coordinates_.upper);
  };
  const VectorX step = bounded_step(H, g);
  const double before = cost_of(x_);
  for (double share = 1.0; share > 1e-3; share *= 0.5) {
    const VectorX moved_by = share * step;
    VectorX tried = within(x_ + moved_by);
    for (int back = 0; back < kBack; ++back) {
      const Point there = point_at(tried, false);
      VectorX curvature = VectorX::Zero(x_.size());
      for (std::size_t c = 0; c < models_.size(); ++c)
        curvature += products[c].transpose() *
                     (mixture(c, there) - mixture(c, point) - derivatives[c] * moved_by);
      tried = within(tried - scale.cwiseProduct(factors.solve(scale.cwiseProduct(curvature))));
    }
    if (!(cost_of(tried) < before)) continue;
    const VectorX from = std::exchange(x_, tried);
    return moved(from) > kSettled;
  }
  return false;
}

/// Minimizes the quadratic model over the box: coordinates that leave it are held at their bound,
/// and let go where the slope points back.
VectorX TorqueSearch::bounded_step(const MatrixX& H, const VectorX& g) const {
  const Eigen::Index n = x_.size();
  std::vector<char> held(static_cast<std::size_t>(n), 0);
  VectorX step = VectorX::Zero(n);
  for (Eigen::Index round = 0; round < 2 * n + 2; ++round) {
    std::vector<Eigen::Index> loose;
    for (Eigen::Index i = 0; i < n; ++i)
      if (!held[static_cast<std::size_t>(i)]) loose.push_back(i);
    VectorX right = -g;
    for (Eigen::Index i = 0; i < n; ++i)
      if (held[static_cast<std::size_t>(i)]) right -= H.col(i) * step[i];
    const MatrixX part = H(loose, loose);
    const VectorX scale = part.diagonal().cwiseSqrt().cwiseInverse();
    const VectorX solved =
        scale.cwiseProduct((scale.asDiagonal() * part * scale.asDiagonal())
                               .ldlt()
                               .solve(scale.cwiseProduct(VectorX(right(loose)))));
    bool changed = false;
    for (std::size_t k = 0; k < loose.size(); ++k) {
      const Eigen::Index i = loose[k];
      const double at = x_[i] + solved[static_cast<Eigen::Index>(k)];
      step[i] = std::clamp(at, coordinates_.lower[i], coordinates_.upper[i]) - x_[i];
      if (at < coordinates_.lower[i] || at > coordinates_.upper[i]) {
        held[static_cast<std::size_t>(i)] = 1;
        changed = true;
      }
    }
    if (changed) continue;
    const VectorX slope = g + H * step;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!held[static_cast<std::size_t>(i)]) continue;
      const bool low = x_[i] + step[i] <= coordinates_.lower[i];
      if ((low && slope[i] < 0.0) || (!low && slope[i] > 0.0)) {
        held[static_cast<std::size_t>(i)] = 0;
        changed = true;
        break;  // one at a time, so that none goes in circles with another
      }
    }
    if (!changed) break;
  }
  return step;
}

/// Sets the deviations of the channels, and how much their errors are alike from row to row: the
/// sum of the autocorrelations up to the first that is not above its own noise.
void TorqueSearch::find_deviations() {
  const Point point = point_at(x_, false);
  const double share = static_cast<double>(x_.size()) / static_cast<double>(models_.size());
  for (std::size_t c = 0; c < models_.size(); ++c) {
    TorqueChannel& channel = channels_[c];
    const MatrixX& columns = models_[c].columns;
    const VectorX r = columns * mixture(c, point);
    const double square = r.squaredNorm(), degrees = std::max(1.0, channel.rows - share);
    const double least = kLeastDeviation * columns.rightCols(1).lpNorm<Eigen::Infinity>();
    channel.deviation =
        std::max({least, std::sqrt(square / degrees), kShrink * channel.deviation, 1e-300});
    channel.correlation = 1.0;
    for (Eigen::Index lag = 1; lag < r.size() / 4 && square > 0.0; ++lag) {
      const double correlation = r.head(r.size() - lag).dot(r.tail(r.size() - lag)) / square;
      if (correlation < 2.0 / std::sqrt(static_cast<double>(r.size()))) break;
      channel.correlation += 2.0 * correlation;
    }
  }
}

}  // namespace counterpoint::estimation
