// 64-bit FNV-1a over numbers, byte by byte from the lowest: the same on every machine.
#pragma once

#include <bit>
#include <cstdint>
#include <string_view>

#include "counterpoint/model/types.h"

namespace counterpoint {

class Hash {
 public:
  void add_byte(unsigned char byte) { value_ = (value_ ^ byte) * 1099511628211u; }
  void add(std::uint64_t word) {
    for (int i = 0; i < 8; ++i) add_byte(static_cast<unsigned char>(word >> (8 * i)));
  }
  void add(int number) { add(static_cast<std::uint64_t>(static_cast<std::int64_t>(number))); }
  /// The bits: 0 and -0 differ.
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(bool) = delete;
  /// All numbers of a vector or matrix of Eigen, column by column.
  template <class Derived>
  void add(const Eigen::DenseBase<Derived>& numbers) {
    for (Eigen::Index j = 0; j < numbers.cols(); ++j)
      for (Eigen::Index i = 0; i < numbers.rows(); ++i) add(numbers(i, j));
  }
  /// The characters, and how many.
  void add(std::string_view text) {
    add(static_cast<std::uint64_t>(text.size()));
    for (const char c : text) add_byte(static_cast<unsigned char>(c));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 14695981039346656037u;
};

}  // namespace counterpoint
