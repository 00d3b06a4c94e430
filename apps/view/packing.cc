#include "view/packing.h"

#include <zlib.h>

#include <array>
#include <bit>
#include <stdexcept>

#include "counterpoint/model/spatial.h"

namespace counterpoint::view {
namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

template <class Word>
void append_word(std::string& out, Word word) {
  for (size_t i = 0; i < sizeof(Word); ++i) out += static_cast<char>((word >> (8 * i)) & 0xff);
}

}  // namespace

std::string base64(std::string_view bytes) {
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k)
      out += i + k <= bytes.size() ? kDigits[word >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

std::string from_base64(std::string_view text) {
  std::string out;
  std::uint32_t word = 0;
  int bits = 0;
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  for (const char c : text) {
    const size_t digit = kDigits.find(c);
    if (digit == std::string_view::npos) throw InputError("not base64");
    word = word << 6 | static_cast<std::uint32_t>(digit);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    out += static_cast<char>(word >> bits & 0xff);
  }
  return out;
}

std::string pack(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), 7) != Z_OK)
    throw std::runtime_error("zlib cannot compress");
  out.resize(size);
  return base64(out);
}

std::string unpack(std::string_view text) {
  const std::string packed = from_base64(text);
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw std::runtime_error("zlib cannot start");
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  std::string out;
  int status = Z_OK;
  std::array<char, 1 << 16> part{};
  while (status == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(part.data());
    stream.avail_out = part.size();
    status = inflate(&stream, Z_NO_FLUSH);
    out.append(part.data(), part.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  if (status != Z_STREAM_END) throw InputError("not packed by zlib");
  return out;
}

std::string pack_doubles(const std::vector<double>& values) {
  std::string bytes;
  for (const double x : values) append_word(bytes, std::bit_cast<std::uint64_t>(x));
  return pack(bytes);
}

std::string pack_floats(const std::vector<float>& values) {
  std::string bytes;
  for (const float x : values) append_word(bytes, std::bit_cast<std::uint32_t>(x));
  return pack(bytes);
}

std::string pack_indices(const std::vector<std::uint32_t>& values) {
  std::string bytes;
  for (const std::uint32_t x : values) append_word(bytes, x);
  return pack(bytes);
}

void IntegerStream::add(std::int64_t value) {
  // Zigzag coding: the sign goes into the lowest bit, so that small negative numbers stay short.
  std::uint64_t rest = static_cast<std::uint64_t>(value) << 1 ^ (value < 0 ? ~0ull : 0ull);
  for (; rest > 127; rest >>= 7) bytes_ += static_cast<char>((rest & 127) | 128);
  bytes_ += static_cast<char>(rest);
}

void IntegerStream::add_smooth(const std::vector<std::int64_t>& values) {
  std::int64_t slope = 0;
  for (size_t k = 0; k < values.size(); ++k) {
    const std::int64_t step = k == 0 ? values[0] : values[k] - values[k - 1];
    add(k == 0 ? step : step - slope);
    slope = k == 0 ? 0 : step;
  }
}

void IntegerStream::add_steps(const std::vector<std::int64_t>& values) {
  std::int64_t last = 0;
  for (const std::int64_t value : values) {
    add(value - last);
    last = value;
  }
}

}  // namespace counterpoint::view
