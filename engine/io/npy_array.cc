#include "counterpoint/engine/io/npy_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "counterpoint/engine/io/bytes.h"
#include "counterpoint/engine/io/table_format.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

constexpr std::string_view kNpyMagic = "\x93NUMPY";
constexpr std::size_t kHeaderSize = 128;     // size of written headers, a multiple of 64
constexpr std::size_t kMaxHeader = 1 << 20;  // bytes
constexpr std::uint64_t kMaxSide = 1ull << 48;

std::string header(const std::string& type, const std::string& shape) {
  std::string text =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, shape);
  std::string out(kNpyMagic);
  out += '\1';
  out += '\0';
  append_number(out, static_cast<std::uint16_t>(kHeaderSize - 10));
  text.resize(kHeaderSize - 11, ' ');
  return out + text + '\n';
}

std::string take(ZipEntry& entry, std::size_t count) {
  std::string bytes(count, '\0');
  if (entry.read(bytes.data(), count) < count) throw InputError("cut short");
  return bytes;
}

/// Returns the text after 'key': in the header, a Python dictionary.
std::string_view value_of(std::string_view text, const std::string& key) {
  const std::size_t at = text.find("'" + key + "'");
  const std::size_t colon = at == std::string_view::npos ? at : text.find(':', at);
  if (colon == std::string_view::npos) throw InputError(fmt::format("its header has no '{}'", key));
  text.remove_prefix(colon + 1);
  while (text.starts_with(' ')) text.remove_prefix(1);
  return text;
}

void append_utf8(std::string& out, std::uint32_t code) {
  const auto tail = [&](int shift) { out += static_cast<char>(0x80 | ((code >> shift) & 0x3f)); };
  if (code < 0x80) {
    out += static_cast<char>(code);
  } else if (code < 0x800) {
    out += static_cast<char>(0xc0 | (code >> 6));
    tail(0);
  } else if (code < 0x10000) {
    out += static_cast<char>(0xe0 | (code >> 12));
    tail(6);
    tail(0);
  } else if (code < 0x110000) {
    out += static_cast<char>(0xf0 | (code >> 18));
    tail(12);
    tail(6);
    tail(0);
  } else {
    throw InputError("holds what is no character");
  }
}

/// Decodes UTF-8 to code points; an invalid byte counts as a character.
std::vector<std::uint32_t> characters(const std::string& text) {
  std::vector<std::uint32_t> out;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const std::size_t length = lead < 0xc0 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    std::uint32_t code = length == 1 ? lead : lead & (0x7fu >> length);
    for (std::size_t k = 1; k < length && i + k < text.size(); ++k)
      code = code << 6 | (static_cast<unsigned char>(text[i + k]) & 0x3fu);
    out.push_back(code);
    i += length;
  }
  return out;
}

}  // namespace

std::string npy_header(const std::string& type, std::size_t rows, std::size_t columns) {
  return header(type, fmt::format("{}, {}", rows, columns));
}

std::string npy_strings(const std::vector<std::string>& names, std::size_t width) {
  std::vector<std::vector<std::uint32_t>> all;
  std::size_t length = 1;
  for (const std::string& name : names) {
    all.push_back(characters(name));
    length = std::max(length, all.back().size());
  }
  std::string out = header(fmt::format("<U{}", length),
                           width == 1 ? fmt::format("{},", names.size())
                                      : fmt::format("{}, {}", names.size() / width, width));
  for (std::vector<std::uint32_t>& name : all) {
    name.resize(length, 0);
    for (const std::uint32_t c : name) append_number(out, c);
  }
  return out;
}

NpyHeader read_npy_header(ZipEntry& entry) {
  const std::string start = take(entry, kNpyMagic.size() + 2);
  if (!start.starts_with(kNpyMagic)) throw InputError("no NumPy array");
  const bool first_version = start[kNpyMagic.size()] == 1;
  const std::size_t size = first_version ? number_at<std::uint16_t>(take(entry, 2), 0)
                                         : number_at<std::uint32_t>(take(entry, 4), 0);
  if (size > kMaxHeader) throw InputError(fmt::format("a header of {} bytes", size));
  const std::string text = take(entry, size);
  NpyHeader header;
  std::string_view type = value_of(text, "descr");
  const std::size_t end = type.find('\'', 1);
  if (!type.starts_with('\'') || end == std::string_view::npos)
    throw InputError("of fields with names");
  header.type = type.substr(1, end - 1);
  header.fortran_order = value_of(text, "fortran_order").starts_with("True");
  std::string_view shape = value_of(text, "shape");
  shape = shape.substr(0, shape.find(')'));
  while (!shape.empty()) {
    std::size_t side = 0;
    const auto [stop, error] = std::from_chars(shape.data(), shape.data() + shape.size(), side);
    if (error == std::errc()) {
      if (side > kMaxSide) throw InputError(fmt::format("{} rows", side));
      header.shape.push_back(side);
      shape.remove_prefix(static_cast<std::size_t>(stop - shape.data()));
    } else {
      shape.remove_prefix(1);
    }
  }
  return header;
}

std::vector<std::string> read_npy_strings(ZipEntry& entry, std::size_t width) {
  const NpyHeader header = read_npy_header(entry);
  const bool wide = header.type.starts_with("<U");
  std::size_t length = 0;
  const char* const last = header.type.data() + header.type.size();
  if ((!wide && !header.type.starts_with("|S")) ||
      std::from_chars(header.type.data() + 2, last, length).ptr != last)
    throw InputError(fmt::format("of type {}, no names", header.type));
  if (header.fortran_order || header.shape.size() != (width == 1 ? 1u : 2u) ||
      (width > 1 && header.shape[1] != width))
    throw InputError(fmt::format("not of {} names a row", width));
  const std::size_t size = wide ? 4 : 1;
  if (length == 0 || length > limits::kMaxTableLine || header.shape[0] > kMaxColumns ||
      length * size * header.shape[0] * width > limits::kMaxTableLine)
    throw InputError(
        fmt::format("more than {} names, of more than 64 MB, or empty ones", kMaxColumns));
  std::vector<std::string> names;
  for (std::size_t i = 0; i < header.shape[0] * width; ++i) {
    const std::string bytes = take(entry, length * size);
    std::string name;
    for (std::size_t k = 0; k < length; ++k) {
      if (!wide) {
        name += bytes[k];
      } else {
        append_utf8(name, number_at<std::uint32_t>(bytes, 4 * k));
      }
    }
    while (!name.empty() && name.back() == '\0') name.pop_back();
    names.push_back(std::move(name));
  }
  return names;
}

}  // namespace counterpoint
