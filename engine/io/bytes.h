// Numbers as bytes, lowest first, as the binary formats of tables have them.
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

/// The caller checked that there are as many bytes.
template <class Number>
Number number_at(std::string_view bytes, std::size_t position) {
  Number x;
  std::memcpy(&x, bytes.data() + position, sizeof x);
  return x;
}

}  // namespace counterpoint
