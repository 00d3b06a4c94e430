#include "counterpoint/engine/io/ros_rows.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <limits>
#include <sstream>

#include "counterpoint/engine/io/bytes.h"
#include "counterpoint/model/spatial.h"
#include "counterpoint/model/special_values.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

constexpr int kMaxDepth = 32;  // nesting depth of messages
// Largest number of values in a message: more means a point cloud or an image.
constexpr std::size_t kMaxValues = 100'000;

enum class Primitive {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64,
  kString
};

constexpr std::array kPrimitives = {
    std::pair{"bool", Primitive::kUint8},      std::pair{"byte", Primitive::kUint8},
    std::pair{"char", Primitive::kUint8},      std::pair{"int8", Primitive::kInt8},
    std::pair{"uint8", Primitive::kUint8},     std::pair{"int16", Primitive::kInt16},
    std::pair{"uint16", Primitive::kUint16},   std::pair{"int32", Primitive::kInt32},
    std::pair{"uint32", Primitive::kUint32},   std::pair{"int64", Primitive::kInt64},
    std::pair{"uint64", Primitive::kUint64},   std::pair{"float32", Primitive::kFloat32},
    std::pair{"float64", Primitive::kFloat64}, std::pair{"string", Primitive::kString}};

const Primitive* find_primitive(std::string_view type) {
  for (const auto& [name, primitive] : kPrimitives)
    if (type == name) return &primitive;
  return nullptr;
}

/// Returns true for types of seconds and nanoseconds, which become one number [ns].
bool is_time(std::string_view type) {
  return type == "builtin_interfaces/Time" || type == "builtin_interfaces/Duration" ||
         type == "time" || type == "duration";
}

/// Shortens pkg/msg/Type to pkg/Type.
std::string short_name(std::string name) {
  const std::size_t at = name.find("/msg/");
  if (at != std::string::npos) name.erase(at, 4);
  return name;
}

/// Parses a field such as "float64[3] position" of a message of package `package`; false if the
/// line holds a constant or nothing.
bool parse_field(const std::string& line, const std::string& package, RosField& out) {
  std::istringstream words(line.substr(0, line.find('#')));
  std::string type;
  if (!(words >> type >> out.name) || out.name.find('=') != std::string::npos) return false;
  std::string next;
  if (words >> next && next.front() == '=') return false;
  out.is_array = type.ends_with(']');
  if (out.is_array) {
    const std::size_t open = type.find('[');
    const std::string size = type.substr(open + 1, type.size() - open - 2);
    const bool fixed =
        !size.empty() && size.size() < 9 &&
        std::all_of(size.begin(), size.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
    if (fixed) out.fixed_size = std::stoi(size);
    type.erase(open);
  }
  type = short_name(type.substr(0, type.find("<=")));  // removes the bound of a bounded string
  if (type == "Header") type = "std_msgs/Header";
  const bool known = find_primitive(type) || is_time(type) || type == "wstring";
  out.type = known || type.find('/') != std::string::npos ? type : package + "/" + type;
  return true;
}

/// Reads the values of one message in order.
class MessageReader {
 public:
  MessageReader(const RosType& type, std::string_view bytes, std::string where,
                std::vector<RosValue>& out)
      : type_(type), bytes_(bytes), where_(std::move(where)), out_(out) {
    if (type.ros1) return;
    if (bytes_.size() < 4 || bytes_[0] != 0 || bytes_[1] != 1)
      fail("expected CDR with the lowest byte first");
    bytes_.remove_prefix(4);
  }

  void read() { message(type_.name, "field", false, 0); }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: a message {} cannot be read: {}", where_, type_.name, what));
  }

  // NOLINTNEXTLINE(misc-no-recursion): as deep as kMaxDepth
  void message(const std::string& name, const std::string& path, bool in_array, int depth) {
    const auto fields = type_.types.find(name);
    if (fields == type_.types.end()) fail(fmt::format("its schema says nothing about {}", name));
    if (depth > kMaxDepth) fail("messages in messages without an end");
    if (fields->second.empty() && !type_.ros1)
      number<std::uint8_t>();  // CDR has no empty structures
    for (const RosField& field : fields->second) {
      const std::string at = path + "." + field.name;
      if (!field.is_array) {
        value(field.type, at, in_array, depth);
        continue;
      }
      const std::uint32_t count = field.fixed_size >= 0
                                      ? static_cast<std::uint32_t>(field.fixed_size)
                                      : number<std::uint32_t>();
      for (std::uint32_t i = 0; i < count; ++i)
        value(field.type, fmt::format("{}{}", at, i), true, depth);
    }
  }

  // NOLINTNEXTLINE(misc-no-recursion)
  void value(const std::string& type, const std::string& path, bool in_array, int depth) {
    if (++values_ > kMaxValues) fail(fmt::format("it holds more than {} values", kMaxValues));
    if (is_time(type)) {
      const auto seconds = static_cast<double>(number<std::int32_t>());
      put(path, 1e9 * seconds + static_cast<double>(number<std::uint32_t>()), in_array);
    } else if (const Primitive* primitive = find_primitive(type)) {
      if (*primitive == Primitive::kString)
        out_.push_back({path, kNaN, string(), true, in_array});
      else
        put(path, number(*primitive), in_array);
    } else if (type == "wstring") {
      fail("wstring is not supported");
    } else {
      message(type, path, in_array, depth + 1);
    }
  }

  void put(const std::string& path, double x, bool in_array) {
    out_.push_back({path, x, {}, false, in_array});
  }

  double number(Primitive primitive) {
    switch (primitive) {
      case Primitive::kInt8:
        return number<std::int8_t>();
      case Primitive::kUint8:
        return number<std::uint8_t>();
      case Primitive::kInt16:
        return number<std::int16_t>();
      case Primitive::kUint16:
        return number<std::uint16_t>();
      case Primitive::kInt32:
        return number<std::int32_t>();
      case Primitive::kUint32:
        return number<std::uint32_t>();
      case Primitive::kInt64:
        return static_cast<double>(number<std::int64_t>());
      case Primitive::kUint64:
        return static_cast<double>(number<std::uint64_t>());
      case Primitive::kFloat32:
        return number<float>();
      case Primitive::kFloat64:
        return number<double>();
      case Primitive::kString:
        break;
    }
    return kNaN;
  }

  template <class Number>
  Number number() {
    if (!type_.ros1) at_ = (at_ + sizeof(Number) - 1) / sizeof(Number) * sizeof(Number);
    return number_at<Number>(take(sizeof(Number)), 0);
  }

  std::string string() {
    std::string text(take(number<std::uint32_t>()));
    if (!type_.ros1 && text.ends_with('\0')) text.pop_back();
    return text;
  }

  std::string_view take(std::size_t count) {
    if (at_ > bytes_.size() || count > bytes_.size() - at_)
      fail("it is shorter than its schema says");
    at_ += count;
    return bytes_.substr(at_ - count, count);
  }

  const RosType& type_;
  std::string_view bytes_;
  std::string where_;
  std::vector<RosValue>& out_;
  std::size_t at_ = 0, values_ = 0;
};

}  // namespace

void RosRows::add_schema(std::uint16_t id, std::string_view name, std::string_view encoding,
                         std::string_view definition) {
  if (encoding != "ros2msg" && encoding != "ros1msg") return;
  RosType type;
  type.ros1 = encoding == "ros1msg";
  type.name = short_name(std::string(name));
  std::string current = type.name, line;
  type.types[current];
  std::istringstream lines{std::string(definition)};
  while (std::getline(lines, line)) {
    if (line.starts_with("====")) continue;
    if (line.starts_with("MSG: ")) {
      current = short_name(std::string(trimmed(std::string_view(line).substr(5), " \t\r")));
      type.types[current];
      continue;
    }
    RosField field;
    if (parse_field(line, current.substr(0, current.find('/')), field))
      type.types[current].push_back(field);
  }
  types_[id] = std::move(type);
}

void RosRows::add_channel(std::uint16_t id, std::uint16_t schema, std::string_view topic,
                          std::string_view encoding) {
  const auto type = types_.find(schema);
  if (type == types_.end() || encoding != (type->second.ros1 ? "ros1" : "cdr")) return;
  channels_[id] = {std::string(topic), &type->second};
}

std::string RosRows::topics() const {
  std::vector<std::string> all;
  for (const auto& [id, channel] : channels_)
    if (std::count(all.begin(), all.end(), channel.topic) == 0) all.push_back(channel.topic);
  return fmt::format("{}", fmt::join(all, ", "));
}

bool RosRows::is_chosen(const std::vector<RosValue>& values) const {
  return std::all_of(options_.rows.begin(), options_.rows.end(), [&](const auto& wanted) {
    return std::any_of(values.begin(), values.end(), [&](const RosValue& value) {
      return value.is_text && value.column == wanted.first && value.text == wanted.second;
    });
  });
}

void RosRows::set_columns(const std::vector<RosValue>& values) {
  first_ = values;
  for (const RosValue& value : values)
    if (!value.is_text || options_.any_cells) columns_.emplace_back(value.column);
}

bool RosRows::read(std::uint16_t id, std::uint64_t log_time, std::string_view message) {
  const auto found = channels_.find(id);
  if (found == channels_.end()) return false;
  const Channel& channel = found->second;
  if (!options_.topic.empty() && channel.topic != options_.topic) return false;
  if (topic_.empty()) topic_ = channel.topic;
  if (channel.topic != topic_)
    throw InputError(
        fmt::format("{}: messages of several topics: {}; the column map says which: topic: {}",
                    file_, topics(), topic_));
  const std::string where = fmt::format("{}: row {}", file_, met_ + 1);
  row_.clear();
  row_.push_back({"%time", static_cast<double>(log_time), {}, false, false});
  MessageReader(*channel.type, message, where, row_).read();
  if (!is_chosen(row_)) return false;
  if (columns_.empty()) set_columns(row_);
  for (std::size_t i = 0; i < std::max(first_.size(), row_.size()); ++i) {
    const bool same = i < first_.size() && i < row_.size() && first_[i].column == row_[i].column;
    if (same && !(row_[i].is_text && row_[i].in_array && row_[i].text != first_[i].text)) continue;
    const std::string is =
        i < row_.size() ? row_[i].column + (same ? " '" + row_[i].text + "'" : "") : "nothing";
    const std::string was = i < first_.size()
                                ? first_[i].column + (same ? " '" + first_[i].text + "'" : "")
                                : "nothing";
    throw InputError(
        fmt::format("{}: {} where the first message of {} has {}; messages of several senders? "
                    "the column map chooses by a text: rows: {{COLUMN: TEXT}}",
                    where, is, topic_, was));
  }
  ++met_;
  return true;
}

void RosRows::append_to(TableBlock& block) {
  ++rows_;
  int column = 0;
  for (const RosValue& value : row_) {
    if (value.is_text && !options_.any_cells) continue;
    block.numbers.push_back(value.number);
    if (value.is_text)
      block.refused.try_emplace(
          column, fmt::format("{}: row {}: column '{}': '{}' is no finite number", file_, rows_,
                              value.column, value.text));
    ++column;
  }
  ++block.rows;
}

}  // namespace counterpoint
