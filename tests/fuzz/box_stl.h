// A cube with edges of 2 m as a binary STL file.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>

namespace counterpoint::fuzz {

inline std::string box_stl() {
  std::string out(80, ' ');
  const auto append = [&out](const auto& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  append(std::uint32_t{12});
  const auto corner = [&](int i) {
    for (int k = 0; k < 3; ++k) append((i >> k & 1) != 0 ? 1.0f : -1.0f);
  };
  constexpr std::array<std::array<int, 4>, 6> kFaces{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& f : kFaces) {
    for (const auto& t : {std::array{f[0], f[1], f[2]}, std::array{f[0], f[2], f[3]}}) {
      for (int k = 0; k < 3; ++k) append(0.0f);
      for (const int i : t) corner(i);
      append(std::uint16_t{0});
    }
  }
  return out;
}

}  // namespace counterpoint::fuzz
