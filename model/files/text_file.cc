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

/// Line number, from 1, of a position in a text.
auto line_of(const std::string& text, size_t position) {
  return 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(position), '\n');
}

/// The element that the message of tinyxml2 names, as "<NAME>: ", or "".
std::string faulty_element(const tinyxml2::XMLDocument& document) {
  constexpr std::string_view kNamed = "XMLElement name=";
  const std::string_view message = document.ErrorStr() == nullptr ? "" : document.ErrorStr();
  const size_t at = message.find(kNamed);
  return at == std::string_view::npos ? ""
                                      : fmt::format("<{}>: ", message.substr(at + kNamed.size()));
}

/// Explanation of an error of tinyxml2.
const char* xml_fault(const tinyxml2::XMLDocument& document) {
  switch (document.ErrorID()) {
    case tinyxml2::XML_ERROR_EMPTY_DOCUMENT:
      return "the file holds no element";
    case tinyxml2::XML_ERROR_MISMATCHED_ELEMENT:
      return "the element that begins here is closed under another name, or not at all: </NAME> is "
             "expected";
    case tinyxml2::XML_ERROR_PARSING_ELEMENT:
      return "an element that is not written to its end: > or /> is missing";
    case tinyxml2::XML_ERROR_PARSING_ATTRIBUTE:
      return "an attribute is not written NAME=\"VALUE\" (a quotation mark or = is missing), or "
             "stands twice";
    case tinyxml2::XML_ERROR_PARSING_TEXT:
      return "text outside of all elements, or the file ends before </NAME>";
    case tinyxml2::XML_ERROR_PARSING_CDATA:
      return "<![CDATA[ without ]]>";
    case tinyxml2::XML_ERROR_PARSING_COMMENT:
      return "a comment <!-- without -->";
    case tinyxml2::XML_ERROR_PARSING_DECLARATION:
      return "<? without ?>, or a declaration that does not stand at the start of the file";
    case tinyxml2::XML_ERROR_PARSING_UNKNOWN:
      return "<! without >";
    case tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED:
      return "elements within elements more than 100 deep";
    default:
      return "< that begins no element (write &lt; for the sign), or the file ends before </NAME>";
  }
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

void Faults::add(const std::string& fault) {
  if (std::find(faults_.begin(), faults_.end(), fault) == faults_.end()) faults_.push_back(fault);
}

void Faults::throw_if_any() const {
  constexpr std::size_t kMost = 20;
  if (faults_.empty()) return;
  std::string all;
  for (std::size_t i = 0; i < std::min(kMost, faults_.size()); ++i)
    all += (i == 0 ? "" : "\n") + faults_[i];
  if (faults_.size() > kMost) all += fmt::format("\nand {} more faults", faults_.size() - kMost);
  throw InputError(all);
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
  if (zero != std::string::npos) {  // tinyxml2 would take it for the end of the text
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
    // Refused in comments as well, where it is harmless but never written.
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

void parse_xml(const std::filesystem::path& file, const std::string& text,
               tinyxml2::XMLDocument& document) {
  const size_t declaration = text.find("<?xml");
  if (declaration != std::string::npos && declaration > 0 &&
      text.find_first_not_of(" \t\r\n") == declaration) {
    throw InputError(
        fmt::format("{}:1: not well-formed XML: the declaration <?xml ...?> must be the very first "
                    "characters of the file; delete the blank before it",
                    file.string()));
  }
  if (document.Parse(text.data(), text.size()) == tinyxml2::XML_SUCCESS) return;
  throw InputError(fmt::format("{}:{}: not well-formed XML: {}{}", file.string(),
                               std::max(1, document.ErrorLineNum()), faulty_element(document),
                               xml_fault(document)));
}

void parse_xml_file(const std::filesystem::path& file, const char* missing,
                    tinyxml2::XMLDocument& document) {
  parse_xml(file, read_xml_file(file, missing), document);
}

std::string root_element_name(const std::filesystem::path& file) {
  tinyxml2::XMLDocument document;
  parse_xml_file(file, "there is no such file", document);
  return document.RootElement() == nullptr ? "" : document.RootElement()->Name();
}

}  // namespace counterpoint
