#include <cmath>

#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::estimation {

CoordinateMetrics coordinate_metrics(const std::string& name, const VectorX& difference,
                                     const VectorX& recorded) {
  const double count = static_cast<double>(difference.size());
  CoordinateMetrics out;
  out.name = name;
  out.rms = difference.norm() / std::sqrt(count);
  out.mean = difference.mean();
  const double deviation = (recorded.array() - recorded.mean()).matrix().norm() / std::sqrt(count);
  // For a constant column the deviation is only round-off.
  if (!(deviation > 1e-12 * recorded.lpNorm<Eigen::Infinity>())) return out;
  out.recorded_deviation = deviation;
  out.r2 = 1.0 - out.rms * out.rms / (deviation * deviation);
  return out;
}

}  // namespace counterpoint::estimation
