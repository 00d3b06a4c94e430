// Numbers packed into text: whole numbers of seven bits a byte, then zlib, then base64. The page
// unpacks them (page/data.js).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace counterpoint::view {

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);
/// The reverse. @throws InputError for what is no base64.
std::string from_base64(std::string_view text);
/// zlib (RFC 1950), then base64. @throws std::runtime_error where zlib fails (memory).
std::string pack(std::string_view bytes);
/// The reverse, for tests. @throws InputError for what was not packed.
std::string unpack(std::string_view text);

/// As their bits, from the lowest byte.
std::string pack_doubles(const std::vector<double>& values);
std::string pack_floats(const std::vector<float>& values);
std::string pack_indices(const std::vector<std::uint32_t>& values);

/// A stream of signed whole numbers; small ones take little room.
class IntegerStream {
 public:
  void add(std::int64_t value);
  /// A curve by its second differences: little room where it is smooth.
  void add_smooth(const std::vector<std::int64_t>& values);
  /// The same by first differences: little room where it seldom changes.
  void add_steps(const std::vector<std::int64_t>& values);
  std::string packed() const { return pack(bytes_); }

 private:
  std::string bytes_;
};

}  // namespace counterpoint::view
