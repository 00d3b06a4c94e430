// The page's decoder of integers (apps/view/page/data.js), reimplemented.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "view/packing.h"

namespace counterpoint::test {

class StreamReader {
 public:
  explicit StreamReader(const std::string& text) : bytes_(view::unpack(text)) {}

  std::int64_t next() {
    std::uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      const auto byte = static_cast<unsigned char>(bytes_.at(at_++));
      value |= static_cast<std::uint64_t>(byte & 127) << shift;
      if (!(byte & 128)) break;
    }
    return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
  }
  std::vector<std::int64_t> smooth(size_t count) {
    std::vector<std::int64_t> out;
    std::int64_t slope = 0;
    for (size_t k = 0; k < count; ++k) {
      if (k > 0) slope += next();
      out.push_back(k == 0 ? next() : out.back() + slope);
    }
    return out;
  }
  std::vector<std::int64_t> steps(size_t count) {
    std::vector<std::int64_t> out;
    for (size_t k = 0; k < count; ++k) out.push_back(next() + (k == 0 ? 0 : out.back()));
    return out;
  }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  std::string bytes_;
  size_t at_ = 0;
};

}  // namespace counterpoint::test
