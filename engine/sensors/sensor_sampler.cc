#include <cmath>

#include "counterpoint/engine/sensors/sensor_table.h"
#include "counterpoint/engine/sensors/white_noise.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

/// Part of a period or of a delay by which times that are sums of steps may be off.
constexpr double kSampleSlack = 1e-6;

}  // namespace

SensorSampler::SensorSampler(const Model& model, std::uint64_t seed) {
  Eigen::Index first = 0;
  for (const Sensor& sensor : model.sensors()) {
    Channel channel;
    channel.errors = sensor.errors;
    channel.first = first;
    for (const SensorRow& row : sensor_rows(model, sensor)) {
      Hash hash;
      hash.add(seed);
      hash.add(sensor.name);
      hash.add(row.suffix);
      channel.seeds.push_back(hash.value());
    }
    channel.rows = static_cast<Eigen::Index>(channel.seeds.size());
    channel.held.assign(channel.seeds.size(), kNaN);
    first += channel.rows;
    channels_.push_back(std::move(channel));
  }
}

void SensorSampler::take_sample(Channel& channel, double time, const VectorRef& exact) {
  const SensorErrors& errors = channel.errors;
  channel.waiting.push_back(time);
  for (Eigen::Index i = 0; i < channel.rows; ++i) {
    const auto k = static_cast<std::size_t>(i);
    double value = exact[channel.first + i];
    if (!errors.bias.empty()) value += errors.bias[k];
    if (!errors.noise.empty() && errors.noise[k] > 0.0)
      value += errors.noise[k] *
               normal_number(channel.seeds[k], static_cast<std::uint64_t>(channel.sample));
    if (!errors.quantum.empty() && errors.quantum[k] > 0.0)
      value = errors.quantum[k] * std::round(value / errors.quantum[k]);
    channel.waiting.push_back(value);
  }
}

/// Makes the last sample that is old enough at `time` [s] the value that is read.
void SensorSampler::advance(Channel& channel, double time) {
  const auto stride = static_cast<std::size_t>(channel.rows) + 1;
  const double delay = (1.0 - kSampleSlack) * channel.errors.delay;
  std::vector<double>& waiting = channel.waiting;
  while (channel.begin < waiting.size() && waiting[channel.begin] + delay <= time) {
    const auto sample = waiting.begin() + static_cast<std::ptrdiff_t>(channel.begin);
    channel.held.assign(sample + 1, sample + static_cast<std::ptrdiff_t>(stride));
    channel.begin += stride;
  }
  // Samples that were read are dropped once they are half of the list, so that each moves once.
  if (2 * channel.begin < waiting.size()) return;
  waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(channel.begin));
  channel.begin = 0;
}

void SensorSampler::read(double time, const VectorRef& exact, VectorOut readings) {
  for (Channel& channel : channels_) {
    const double rate = channel.errors.rate;
    const long sample =
        rate > 0.0 ? static_cast<long>(std::floor(time * rate + kSampleSlack)) : row_;
    if (sample > channel.sample) {
      channel.sample = sample;
      take_sample(channel, time, exact);
    }
    advance(channel, time);
    readings.segment(channel.first, channel.rows) =
        Eigen::Map<const VectorX>(channel.held.data(), channel.rows);
  }
  ++row_;
}

}  // namespace counterpoint
