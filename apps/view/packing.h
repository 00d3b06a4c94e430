// Numbers packed into text: integers of seven bits a byte, then zlib, then base64. The page unpacks
// them (page/data.js).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace counterpoint::view {

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);
/// Decodes base64. @throws InputError if the text is not base64.
std::string from_base64(std::string_view text);
/// zlib (RFC 1950), then base64. @throws std::runtime_error where zlib fails (memory).
std::string pack(std::string_view bytes);
/// Reverses pack(), for tests. @throws InputError if the text is not the result of pack().
std::string unpack(std::string_view text);

/// Pack the values bit by bit, little-endian.
std::string pack_doubles(const std::vector<double>& values);
std::string pack_floats(const std::vector<float>& values);
std::string pack_indices(const std::vector<std::uint32_t>& values);

/// A stream of signed integers with a variable length; small ones take few bytes.
class IntegerStream {
 public:
  void add(std::int64_t value);
  /// Adds second differences, which are small for smooth curves.
  void add_smooth(const std::vector<std::int64_t>& values);
  /// Adds first differences, which are small for values that seldom change.
  void add_steps(const std::vector<std::int64_t>& values);
  std::string packed() const { return pack(bytes_); }

 private:
  std::string bytes_;
};

}  // namespace counterpoint::view
