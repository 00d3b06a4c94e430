#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/spatial.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// Line, from 1, of a place in a text.
auto line_of(const std::string& text, size_t position) {
  return 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(position), '\n');
}

}  // namespace

std::string why_unreadable(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) return "there is no such file";
  if (std::filesystem::is_directory(status)) return "a folder; a file is expected";
  if (error) return fmt::format("cannot be opened: {}", error.message());
  errno = 0;
  const std::unique_ptr<std::FILE, CloseFile> stream(std::fopen(file.c_str(), "rb"));
  return fmt::format("cannot be opened: {}", std::generic_category().message(errno));
}

std::string read_text_file(const std::filesystem::path& file, std::uintmax_t max_bytes,
                           const char* missing) {
  std::error_code error;
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("{}: {}", file.string(), why));
  };
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) refuse(missing);
  const std::unique_ptr<std::FILE, CloseFile> stream(
      std::filesystem::is_directory(status) ? nullptr : std::fopen(file.c_str(), "rb"));
  if (!stream) refuse(why_unreadable(file));
  std::string text;
  if (std::filesystem::is_regular_file(status)) {
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (!error && size <= max_bytes) text.reserve(size);
  }
  std::array<char, 1 << 16> block;
  while (const size_t count = std::fread(block.data(), 1, block.size(), stream.get())) {
    text.append(block.data(), count);
    if (text.size() > max_bytes) {
      refuse(fmt::format("larger than {} MB, which no such file needs; reduce it",
                         max_bytes / 1'000'000));
    }
  }
  if (std::ferror(stream.get()) != 0) refuse("the file cannot be read");
  return text;
}

std::string read_xml_file(const std::filesystem::path& file, const char* missing) {
  std::string text = read_text_file(file, limits::kMaxXmlBytes, missing);
  const size_t zero = text.find('\0');
  if (zero != std::string::npos) {  // the XML library would take it for the end
    throw InputError(fmt::format("{}:{}: a zero byte, which no XML has (UTF-8 is expected)",
                                 file.string(), line_of(text, zero)));
  }
  size_t marks = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '<' && text[i] != '=') continue;
    if (++marks > limits::kMaxXmlMarks) {
      throw InputError(fmt::format("{}:{}: more than {} elements and attributes; reduce the file",
                                   file.string(), line_of(text, i), limits::kMaxXmlMarks));
    }
    // Within a comment it does no harm, but nobody writes it there.
    for (const char* name : {"<!DOCTYPE", "<!ENTITY"}) {
      if (text.compare(i, std::char_traits<char>::length(name), name) != 0) continue;
      throw InputError(
          fmt::format("{}:{}: {}> is not taken, since entities can stand for anything; remove it, "
                      "and write out "
                      "what it defines",
                      file.string(), line_of(text, i), name));
    }
  }
  return text;
}

void parse_xml_file(const std::filesystem::path& file, const char* missing,
                    tinyxml2::XMLDocument& document) {
  const std::string text = read_xml_file(file, missing);
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    throw InputError(fmt::format("{}:{}: not well-formed XML: {}", file.string(),
                                 std::max(1, document.ErrorLineNum()), document.ErrorName()));
  }
}

std::string root_element_name(const std::filesystem::path& file) {
  tinyxml2::XMLDocument document;
  parse_xml_file(file, "there is no such file", document);
  return document.RootElement() == nullptr ? "" : document.RootElement()->Name();
}

}  // namespace counterpoint
