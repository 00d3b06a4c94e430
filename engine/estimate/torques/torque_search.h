// Gauss-Newton on the rows of a pass over the recordings, within bounds.
#pragma once

#include <vector>

#include "counterpoint/engine/estimate/torques/linear_quantities.h"

namespace counterpoint::estimation {

/// A change of all coordinates by less than this share of their ranges ends a search, or passes.
inline constexpr double kSettled = 1e-7;

class TorqueSearch {
 public:
  /// rows: of a pass at the coordinates x. The first two arguments must outlive this.
  /// friction (nv): that at rest in the scene; only joints that have some, or may, can be at rest.
  TorqueSearch(const Coordinates& coordinates, const LinearQuantities& quantities,
               const std::vector<ChannelRows>& rows, const VectorX& x, const VectorX& friction);

  /// Minimizes the squared residuals over their variances, which are found on the way, and the
  /// priors.
  void run();

  const VectorX& x() const { return x_; }
  const std::vector<TorqueChannel>& channels() const { return channels_; }
  double cost() const { return cost_of(x_); }
  /// Sum over the channels of the logarithms of their deviations: falls from pass to pass as the
  /// agreement grows.
  double misfit() const;
  /// Largest change since `before`, in ranges.
  double moved(const VectorX& before) const;
  /// J' W J at the present coordinates; its diagonal by recording, if that is not null.
  MatrixX information(MatrixX* by_recording = nullptr) const;

 private:
  /// A channel as a linear model: its residuals, modelled minus recorded, are columns times a
  /// mixture, which depends on the coordinates alone. Rows at rest are left out.
  ///   columns: derivatives, modelled, slope, 1, -recorded
  ///   mixture: gain change of the quantities, gain, gain change of the delay, offset, 1
  struct Channel {
    MatrixX columns, gram;
    std::vector<int> recording;  ///< index of each row's recording
    double delay = 0.0;          ///< at the pass [s]
  };
  /// The quantities and channel properties at some coordinates.
  struct Point {
    VectorX change;       ///< change of the quantities since the pass
    MatrixX derivatives;  ///< derivatives of the quantities by the coordinates, if wanted
    std::vector<ChannelValues> channels;
  };

  Point point_at(const VectorX& x, bool derivatives) const;
  VectorX mixture(std::size_t channel, const Point& point) const;
  MatrixX mixture_derivatives(std::size_t channel, const Point& point) const;
  double weight(std::size_t channel) const;
  double cost_of(const VectorX& x) const;
  bool improve();
  VectorX bounded_step(const MatrixX& H, const VectorX& g) const;
  void find_deviations();

  const Coordinates& coordinates_;
  const LinearQuantities& quantities_;
  VectorX x_;
  const VectorX at_pass_;    ///< quantities
  std::vector<int> forces_;  ///< coordinates of v, by channel
  std::vector<Channel> models_;
  std::vector<TorqueChannel> channels_;
};

}  // namespace counterpoint::estimation
