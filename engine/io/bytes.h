// Numbers as little-endian bytes, as in the binary formats of tables.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace counterpoint {

static_assert(std::endian::native == std::endian::little, "tables are copied as bytes");

template <class Number>
void append_number(std::string& out, Number x) {
  char bytes[sizeof x];
  std::memcpy(bytes, &x, sizeof x);
  out.append(bytes, sizeof x);
}

/// Returns the number at a position; the caller must check that enough bytes follow it.
template <class Number>
Number number_at(std::string_view bytes, std::size_t position) {
  Number x{};
  bytes.copy(reinterpret_cast<char*>(&x), sizeof x, position);
  return x;
}

}  // namespace counterpoint
