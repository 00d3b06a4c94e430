#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <sstream>

#include "counterpoint/model/files/file_format.h"
#include "counterpoint/model/limits.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

/// Records the line of the document that the parser found last.
class DocumentLine : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override { line_ = mark.line + 1; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
  int line() const { return line_; }

 private:
  int line_ = 1;
};

/// Refuses further documents, which would be dropped without a message. (YAML::LoadAll does not
/// help: where text stands to the left of the first document, yaml-cpp 0.7 finds empty documents
/// without end.)
void expect_one_document(const std::string& text, const std::string& file) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentLine documents;
  if (!parser.HandleNextDocument(documents) || !parser.HandleNextDocument(documents)) return;
  throw InputError(
      fmt::format("{}:{}: a second YAML document begins here; one is expected (or the "
                  "indentation of the first is off)",
                  file, documents.line()));
}

/// Counts the nodes that a reader visits. @throws InputError if there are too many or they are
/// nested too deeply: an alias may contain itself, and aliases of aliases multiply.
void check_extent(const YAML::Node& node, const std::string& file, int depth, size_t& count) {
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("{}:{}: {}", file, node.Mark().line + 1, why));
  };
  if (depth > limits::kMaxYamlDepth) {
    refuse(fmt::format("nested deeper than {} lists and maps (or an alias within itself)",
                       limits::kMaxYamlDepth));
  }
  if (++count > limits::kMaxYamlNodes) {
    refuse(fmt::format("more than {} values, those of aliases counted wherever they are used",
                       limits::kMaxYamlNodes));
  }
  if (node.IsMap()) {
    for (const auto& entry : node) {
      check_extent(entry.first, file, depth + 1, count);
      check_extent(entry.second, file, depth + 1, count);
    }
  } else if (node.IsSequence()) {
    for (const auto& item : node) check_extent(item, file, depth + 1, count);
  }
}

/// Checks the key `format` of a file and takes it away, so that no reader needs to know it.
void take_format(YAML::Node& root, const std::string& file) {
  if (!root.IsMap()) return;
  int given = 0;
  for (const auto& entry : root) {
    if (!entry.first.IsScalar() || entry.first.Scalar() != "format") continue;
    const std::string where = fmt::format("{}:{}: format", file, entry.first.Mark().line + 1);
    if (++given > 1) throw InputError(where + ": 'format' is given twice");
    check_file_format(entry.second.IsScalar() ? entry.second.Scalar() : "", where);
  }
  if (given > 0) root.remove("format");
}

}  // namespace

YAML::Node load_yaml_file(const std::filesystem::path& file, const char* missing) {
  const std::string text = read_text_file(file, limits::kMaxYamlBytes, missing);
  YAML::Node root;
  try {
    root = YAML::Load(text);
    expect_one_document(text, file.string());
  } catch (const YAML::Exception& exception) {
    throw InputError(fmt::format("{}:{}: malformed YAML: {}", file.string(),
                                 exception.mark.line + 1, exception.msg));
  }
  size_t count = 0;
  check_extent(root, file.string(), 0, count);
  take_format(root, file.string());
  return root;
}

YamlValue YamlValue::load(const std::filesystem::path& file) {
  return {load_yaml_file(file, "there is no such file"), file.string(), ""};
}

YamlValue YamlValue::setting(const std::string& key, const std::string& value) {
  YAML::Node node;
  try {
    node = YAML::Load(value);
  } catch (const YAML::Exception& exception) {
    throw InputError(fmt::format("{}: malformed value: {}", key, exception.msg));
  }
  size_t count = 0;
  check_extent(node, key, 0, count);
  for (size_t end = key.size(), dot = key.rfind('.'); end != std::string::npos;
       end = dot, dot = dot == std::string::npos || dot == 0 ? std::string::npos
                                                             : key.rfind('.', dot - 1)) {
    const size_t begin = dot == std::string::npos ? 0 : dot + 1;
    YAML::Node outer;
    outer[key.substr(begin, end - begin)] = node;
    node = outer;
  }
  return {node, "option " + key, ""};
}

std::string YamlValue::where() const {
  const YAML::Mark mark = node_.Mark();
  const std::string at = mark.is_null() ? file_ : fmt::format("{}:{}", file_, mark.line + 1);
  return path_.empty() ? at : at + ": " + path_;
}

void YamlValue::fail(const std::string& message) const {
  throw InputError(where() + ": " + message);
}

YamlValue YamlValue::at(const char* key) const {
  if (!has(key)) fail(fmt::format("'{}' is missing", key));
  return {node_[key], file_, path_.empty() ? key : path_ + "." + key};
}

void YamlValue::expect_map(std::initializer_list<const char*> names,
                           std::span<const char* const> more) const {
  std::vector<const char*> known(names);
  known.insert(known.end(), more.begin(), more.end());
  const auto list = [&] { return fmt::format("{}", fmt::join(known, ", ")); };
  if (!node_.IsMap()) fail("a map is expected, with keys out of: " + list());
  Faults faults;
  for (const auto& [key, value] : entries()) {
    const bool is_known = std::any_of(known.begin(), known.end(),
                                      [&, &k = key](const char* name) { return k == name; });
    if (!is_known)
      faults.collect([&, &k = key, &v = value] {
        v.fail(fmt::format("'{}' is not known here; known: {}", k, list()));
      });
  }
  faults.throw_if_any();
}

std::vector<YamlValue> YamlValue::list() const {
  if (!node_.IsSequence()) fail("a list is expected");
  std::vector<YamlValue> values;
  for (size_t i = 0; i < node_.size(); ++i) {
    values.push_back({node_[i], file_, fmt::format("{}[{}]", path_, i)});
  }
  return values;
}

std::vector<std::pair<std::string, YamlValue>> YamlValue::entries() const {
  if (!node_.IsMap()) fail("a map (key: value) is expected");
  std::vector<std::pair<std::string, YamlValue>> result;
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) fail("keys must be plain words");
    const std::string key = entry.first.Scalar();
    result.emplace_back(key,
                        YamlValue(entry.second, file_, path_.empty() ? key : path_ + "." + key));
    if (!seen.insert(key).second) {
      result.back().second.fail(fmt::format("'{}' is given twice", key));
    }
  }
  return result;
}

std::string YamlValue::text() const {
  if (!node_.IsScalar() || node_.Scalar().empty()) fail("a text is expected");
  return node_.Scalar();
}

bool YamlValue::boolean() const {
  if (node_.IsScalar()) {
    const std::string& text = node_.Scalar();
    if (text == "true" || text == "on") return true;
    if (text == "false" || text == "off") return false;
  }
  fail("true or false (or on, off) is expected");
}

double YamlValue::number() const {
  const std::optional<double> value =
      node_.IsScalar() ? parse_number(node_.Scalar()) : std::nullopt;
  if (!value || !std::isfinite(*value)) {
    fail(fmt::format("a finite number is expected{}",
                     node_.IsScalar() ? ", not '" + node_.Scalar() + "'" : ""));
  }
  return *value;
}

double YamlValue::number(double low, double high) const {
  const double value = number();
  if (value >= low && value <= high) return value;
  if (high == std::numeric_limits<double>::infinity()) {
    fail(fmt::format("{} is too small; {} or more is expected", value, low));
  }
  fail(fmt::format("{} is out of range; {} ... {} is expected", value, low, high));
}

double YamlValue::positive() const {
  const double value = number();
  if (!(value > 0.0)) fail(fmt::format("{} is not positive", value));
  return value;
}

int YamlValue::integer(int low, int high) const {
  const double value = number(low, high);
  if (value != std::floor(value)) fail(fmt::format("{} is not a whole number", value));
  return static_cast<int>(value);
}

std::vector<double> YamlValue::numbers() const {
  if (!node_.IsSequence()) return {number()};
  std::vector<double> values;
  for (const YamlValue& value : list()) values.push_back(value.number());
  return values;
}

Vector3 YamlValue::vector3() const {
  if (!node_.IsSequence() || node_.size() != 3) fail("three numbers [x, y, z] are expected");
  const std::vector<double> v = numbers();
  return {v[0], v[1], v[2]};
}

}  // namespace counterpoint
