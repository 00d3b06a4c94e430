#include "counterpoint/engine/io/c3d_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <limits>
#include <utility>

#include "counterpoint/engine/io/bytes.h"
#include "counterpoint/model/spatial.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

constexpr std::size_t kMaxC3dParameters = 20'000;  // a file has about 100

/// Decodes a VAX F float: exponent biased by 128, fraction in [1/2, 1) whose first bit is not
/// stored.
double vax_real(std::uint32_t bits) {
  const bool negative = bits >> 31 != 0;
  const int exponent = static_cast<int>(bits >> 23 & 0xff);
  if (exponent == 0) return negative ? std::numeric_limits<double>::quiet_NaN() : 0.0;
  const double fraction = bits & 0x7fffff;
  const double size = std::ldexp(fraction + 0x800000, exponent - 152);
  return negative ? -size : size;
}

std::string capitals(std::string_view text) {
  std::string all(text);
  std::transform(all.begin(), all.end(), all.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return all;
}

/// Returns the name of part 1, 2, 3 ... of a list that goes on: NAME, NAME2, NAME3 ...
std::string continued(const std::string& name, int part) {
  return part == 1 ? name : name + std::to_string(part);
}

}  // namespace

std::uint16_t c3d_word(C3dProcessor processor, std::string_view bytes, std::size_t position) {
  const auto x = number_at<std::uint16_t>(bytes, position);
  return processor == C3dProcessor::kMips ? static_cast<std::uint16_t>(x << 8 | x >> 8) : x;
}

double c3d_real(C3dProcessor processor, std::string_view bytes, std::size_t position) {
  std::uint32_t high = c3d_word(processor, bytes, position);
  std::uint32_t low = c3d_word(processor, bytes, position + 2);
  if (processor == C3dProcessor::kIntel) std::swap(high, low);
  const std::uint32_t bits = high << 16 | low;
  return processor == C3dProcessor::kDec ? vax_real(bits) : std::bit_cast<float>(bits);
}

C3dParameters::C3dParameters(std::string bytes, std::size_t start, C3dProcessor processor,
                             std::string file)
    : bytes_(std::move(bytes)), file_(std::move(file)), processor_(processor) {
  read(start + 4);
}

void C3dParameters::fail(std::size_t position, const std::string& what) const {
  throw InputError(fmt::format("{}: byte {}: {}", file_, position, what));
}

void C3dParameters::read(std::size_t position) {
  std::map<int, std::string> groups;
  std::vector<std::pair<int, std::pair<std::string, Record>>> members;
  while (position + 2 <= bytes_.size() && bytes_[position] != 0) {
    const int length = std::abs(
        static_cast<std::int8_t>(bytes_[position]));  // a negative length marks a locked parameter
    const int group = static_cast<std::int8_t>(bytes_[position + 1]);
    const std::size_t end = position + 2 + static_cast<std::size_t>(length);
    if (end + 2 > bytes_.size())
      fail(position, fmt::format("the name of a parameter of {} letters goes beyond the data's "
                                 "begin, byte {}",
                                 length, bytes_.size()));
    const std::string name =
        capitals(std::string_view(bytes_).substr(position + 2, end - position - 2));
    if (group < 0)
      groups[-group] = name;
    else
      members.push_back({group, {name, record(end + 2)}});
    if (members.size() > kMaxC3dParameters)
      fail(position, fmt::format("more than {} parameters", kMaxC3dParameters));
    const std::size_t step = c3d_word(processor_, bytes_, end);
    if (step == 0) break;
    position = end + step;
  }
  for (auto& [group, member] : members)  // the record that names a group may follow its members
    records_.emplace(groups[group] + ":" + member.first, member.second);
}

C3dParameters::Record C3dParameters::record(std::size_t position) const {
  const auto byte = [&](std::size_t at) {
    if (at >= bytes_.size())
      fail(position,
           fmt::format("a parameter goes beyond the data's begin, byte {}", bytes_.size()));
    return static_cast<unsigned char>(bytes_[at]);
  };
  Record record;
  record.type = static_cast<std::int8_t>(byte(position));
  if (record.type != -1 && record.type != 1 && record.type != 2 && record.type != 4)
    fail(position, fmt::format("a parameter of type {}; expected -1 (text), 1, 2 (integers) or 4 "
                               "(reals)",
                               record.type));
  const std::size_t dimensions = byte(position + 1);
  record.position = position + 2 + dimensions;
  record.width = record.count = 1;
  for (std::size_t i = 0; i < dimensions; ++i) {
    const std::size_t size = byte(position + 2 + i);
    if (i == 0) record.width = size;
    record.count = std::min(record.count * size, bytes_.size());
  }
  const std::size_t size = static_cast<std::size_t>(std::abs(record.type)) * record.count;
  if (size > 0 && record.position + size > bytes_.size())
    fail(position, fmt::format("a parameter of {} bytes goes beyond the data's begin, byte {}",
                               size, bytes_.size()));
  return record;
}

std::vector<double> C3dParameters::numbers(const std::string& name) const {
  std::vector<double> all;
  for (int part = 1; has(continued(name, part)); ++part) {
    const Record& record = records_.at(continued(name, part));
    for (std::size_t i = 0; record.type > 0 && i < record.count; ++i) {
      const std::size_t at = record.position + i * static_cast<std::size_t>(record.type);
      if (record.type == 4)
        all.push_back(c3d_real(processor_, bytes_, at));
      else if (record.type == 2)
        all.push_back(static_cast<std::int16_t>(c3d_word(processor_, bytes_, at)));
      else
        all.push_back(static_cast<std::int8_t>(bytes_[at]));
    }
  }
  return all;
}

std::optional<double> C3dParameters::number(const std::string& name) const {
  const std::vector<double> all = numbers(name);
  if (all.empty() || !std::isfinite(all[0])) return std::nullopt;
  return all[0];
}

std::vector<std::string> C3dParameters::texts(const std::string& name) const {
  std::vector<std::string> all;
  for (int part = 1; has(continued(name, part)); ++part) {
    const Record& record = records_.at(continued(name, part));
    if (record.type != -1 || record.width == 0) continue;
    for (std::size_t i = 0; i + record.width <= record.count; i += record.width)
      all.emplace_back(trimmed(std::string_view(bytes_).substr(record.position + i, record.width),
                               std::string_view(" \0\t\r\n", 5)));
  }
  return all;
}

}  // namespace counterpoint
