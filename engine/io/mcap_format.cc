// Tables as MCAP (mcap.dev/spec): one channel, one message per row (CDR; schema ros2msg, one field
// per column), no chunks, compression or index; the channel's metadata holds the exact column
// names. Files without such a channel, such as ROS recordings, are read with ros_rows.h.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "counterpoint/engine/io/bytes.h"
#include "counterpoint/engine/io/ros_rows.h"
#include "counterpoint/engine/io/table_format.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

constexpr std::string_view kMcapMagic = "\x89MCAP0\r\n";
constexpr std::string_view kCdrLittleEndian{"\0\1\0\0", 4};
constexpr std::size_t kMessageHead = 2 + 4 + 8 + 8;  // channel, sequence, two times
constexpr std::size_t kRecordHead = 1 + 8;           // kind, length
constexpr std::uint64_t kMaxRecord = 256'000'000;    // bytes

enum Record : unsigned char {
  kHeader = 1,
  kFooter = 2,
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kChunk = 6,
  kDataEnd = 15,
};

using Map = std::map<std::string, std::string>;

void append_string(std::string& out, std::string_view text) {
  append_number(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

void append_map(std::string& out, const Map& map) {
  std::string content;
  for (const auto& [key, value] : map) {
    append_string(content, key);
    append_string(content, value);
  }
  append_string(out, content);
}

void append_record(std::string& out, Record kind, std::string_view content) {
  out += static_cast<char>(kind);
  append_number(out, static_cast<std::uint64_t>(content.size()));
  out += content;
}

/// Returns a unique name that ros2msg accepts: letters, digits, single underscores.
std::string field_name(const std::string& column, std::set<std::string>& used) {
  std::string name;
  for (const char c : column) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      name += c;
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  if (name.empty() || (name[0] >= '0' && name[0] <= '9')) name = "c" + name;
  if (name.back() == '_') name.pop_back();
  std::string unique = name;
  for (int i = 2; !used.insert(unique).second; ++i) unique = fmt::format("{}_{}", name, i);
  return unique;
}

class McapSink final : public TableSink {
 public:
  McapSink(const std::filesystem::path& file, const std::vector<Column>& columns)
      : file_(file.string()), columns_(columns), stream_(file, std::ios::binary | std::ios::trunc) {
    if (!stream_)
      throw InputError(fmt::format(
          "{}: cannot be created; expected a path in an existing, writable folder", file_));
    buffer_ = kMcapMagic;
    std::string content;
    append_string(content, "");
    append_string(content, "counterpoint");
    append_record(buffer_, kHeader, content);
    append_schema();
    append_channel();
    for (std::size_t i = 0, slot = 0; i < columns.size(); ++i) {
      if (columns[i].type == CellType::kInteger) continue;
      if (columns[i].name == "time") time_slot_ = slot;
      ++slot;
    }
    put();
  }

  void write(const TableBlock& block) override {
    const double* number = block.numbers.data();
    const std::uint64_t* integer = block.integers.data();
    for (int row = 0; row < block.rows; ++row) {
      buffer_ += static_cast<char>(kMessage);
      append_number(buffer_, static_cast<std::uint64_t>(kMessageHead + kCdrLittleEndian.size() +
                                                        8 * columns_.size()));
      append_number(buffer_, std::uint16_t{1});
      append_number(buffer_, sequence_);
      const std::uint64_t time = nanoseconds(number);
      append_number(buffer_, time);
      append_number(buffer_, time);
      buffer_ += kCdrLittleEndian;
      for (const Column& column : columns_)
        column.type == CellType::kInteger ? append_number(buffer_, *integer++)
                                          : append_number(buffer_, *number++);
      ++sequence_;
    }
    put();
  }

  void finish() override {
    append_record(buffer_, kDataEnd, std::string(4, '\0'));
    append_record(buffer_, kFooter, std::string(20, '\0'));
    buffer_ += kMcapMagic;
    put();
  }

 private:
  void append_schema() {
    std::string fields;
    std::set<std::string> used;
    for (const Column& column : columns_)
      fields += fmt::format("{} {}\n", column.type == CellType::kInteger ? "uint64" : "float64",
                            field_name(column.name, used));
    std::string content;
    append_number(content, std::uint16_t{1});
    append_string(content, "counterpoint/msg/Row");
    append_string(content, "ros2msg");
    append_string(content, fields);
    append_record(buffer_, kSchema, content);
  }

  void append_channel() {
    Map metadata;
    std::vector<std::string> all, integers = names_of(columns_, true);
    for (const Column& column : columns_) {
      all.push_back(column.name);
      if (column.type == CellType::kLabel)
        metadata["labels:" + column.name] = csv_header(column.labels);
    }
    metadata["columns"] = csv_header(all);
    if (!integers.empty()) metadata["integer_columns"] = csv_header(integers);
    std::string content;
    append_number(content, std::uint16_t{1});
    append_number(content, std::uint16_t{1});
    append_string(content, "/counterpoint");
    append_string(content, "cdr");
    append_map(content, metadata);
    append_record(buffer_, kChannel, content);
  }

  /// Returns a message's time stamp, in whole nanoseconds >= 0; the row has the exact time.
  std::uint64_t nanoseconds(const double* numbers) const {
    const double time = time_slot_ ? numbers[*time_slot_] : static_cast<double>(sequence_);
    return time > 0.0 && time < 1e10 ? static_cast<std::uint64_t>(std::llround(time * 1e9)) : 0;
  }

  void put() {
    stream_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    stream_.flush();
    buffer_.clear();
    if (!stream_)
      throw std::runtime_error(fmt::format("{}: cannot be written (disk full?)", file_));
  }

  std::string file_;
  std::vector<Column> columns_;
  std::ofstream stream_;
  std::string buffer_;
  std::optional<std::size_t> time_slot_;
  std::uint32_t sequence_ = 0;
};

/// Reads the fields of a record one after the other.
class Fields {
 public:
  Fields(std::string_view bytes, const std::string& file) : bytes_(bytes), file_(file) {}
  template <class Number>
  Number number() {
    return number_at<Number>(take(sizeof(Number)), 0);
  }
  std::string_view string() { return take(number<std::uint32_t>()); }
  std::string_view bytes(std::size_t count) { return take(count); }
  std::string_view rest() { return take(bytes_.size()); }
  bool empty() const { return bytes_.empty(); }

 private:
  std::string_view take(std::size_t count) {
    if (count > bytes_.size())
      throw InputError(fmt::format("{}: damaged: a record is shorter than what it holds", file_));
    const std::string_view part = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return part;
  }
  std::string_view bytes_;
  const std::string& file_;
};

class McapSource final : public TableSource {
 public:
  McapSource(const std::filesystem::path& file, const TableOptions& options)
      : file_(file.string()), stream_(file, std::ios::binary), ros_(file_, options) {
    stream_.ignore(static_cast<std::streamsize>(kMcapMagic.size()));
    while (columns_.empty() && read_record()) {
    }
    if (columns_.empty())
      throw InputError(fmt::format(
          "{}: no channel with the columns of a table; expected an MCAP file as counterpoint "
          "writes it (channel metadata 'columns', encoding cdr) or as rosbag2 does (schemas "
          "ros2msg){}",
          file_,
          ros_.topics().empty() ? "" : "; no row is chosen from its topics " + ros_.topics()));
  }

  bool read(TableBlock& block) override {
    const int rows = rows_of_block(columns_.size());
    block_ = &block;
    flush_waiting();
    while (block.rows < rows && read_record()) {
    }
    block_ = nullptr;
    return block.rows > 0;
  }

 private:
  /// Handles the next record; false at the end of the file or data, or where a run stopped writing.
  bool read_record() {
    if (ended_) return false;
    std::string head(kRecordHead, '\0');
    if (!fill(head)) return false;
    const auto kind = static_cast<unsigned char>(head[0]);
    const auto size = number_at<std::uint64_t>(head, 1);
    if (kind == kDataEnd || kind == kFooter) return !(ended_ = true);
    if (size > kMaxRecord)
      throw InputError(fmt::format("{}: damaged: a record of {} bytes", file_, size));
    // The size may be wrong in a damaged file: allocates memory only as bytes arrive.
    for (record_.clear(); record_.size() < size;) {
      const std::size_t old = record_.size();
      record_.resize(std::min<std::uint64_t>(size, old + (1 << 22)));
      if (!fill(record_, old)) return false;
    }
    if (kind == kChunk)
      read_chunk();
    else
      handle(kind, record_);
    return true;
  }

  bool fill(std::string& bytes, std::size_t from = 0) {
    const std::size_t count = bytes.size() - from;
    stream_.read(bytes.data() + from, static_cast<std::streamsize>(count));
    if (static_cast<std::size_t>(stream_.gcount()) == count) return true;
    return !(ended_ = true);
  }

  void read_chunk() {
    Fields chunk(record_, file_);
    chunk.number<std::uint64_t>();
    chunk.number<std::uint64_t>();
    chunk.number<std::uint64_t>();
    chunk.number<std::uint32_t>();
    const std::string_view compression = chunk.string();
    if (!compression.empty())
      throw InputError(fmt::format(
          "{}: compressed with {}; expected an MCAP file without compression (mcap compress "
          "--compression none)",
          file_, compression));
    chunk.number<std::uint64_t>();
    Fields records(chunk.rest(), file_);
    while (!records.empty()) {
      const auto kind = records.number<unsigned char>();
      const auto size = records.number<std::uint64_t>();
      if (size > kMaxRecord)
        throw InputError(fmt::format("{}: damaged: a record of {} bytes", file_, size));
      handle(kind, records.bytes(size));
    }
  }

  void handle(unsigned char kind, std::string_view content) {
    if (kind == kSchema) read_schema(Fields(content, file_));
    if (kind == kChannel) read_channel(Fields(content, file_));
    if (kind == kMessage) read_message(content);
  }

  void read_schema(Fields fields) {
    const auto id = fields.number<std::uint16_t>();
    const std::string_view name = fields.string(), encoding = fields.string();
    ros_.add_schema(id, name, encoding, fields.string());
  }

  void read_channel(Fields fields) {
    const auto id = fields.number<std::uint16_t>();
    const auto schema = fields.number<std::uint16_t>();
    const std::string_view topic = fields.string();
    const std::string_view encoding = fields.string();
    Map metadata;
    Fields pairs(fields.string(), file_);
    while (!pairs.empty()) {
      std::string key(pairs.string());
      metadata[std::move(key)] = pairs.string();
    }
    if (metadata.count("columns") == 0) ros_.add_channel(id, schema, topic, encoding);
    if (!columns_.empty() || encoding != "cdr" || metadata.count("columns") == 0) return;
    own_ = true;
    channel_ = id;
    std::set<std::string> integers;
    if (metadata.count("integer_columns") > 0)
      for (std::string& name : parse_csv_header(metadata["integer_columns"], file_))
        integers.insert(std::move(name));
    for (const std::string& name : parse_csv_header(metadata["columns"], file_)) {
      Column column(name, integers.count(name) > 0 ? CellType::kInteger : CellType::kNumber);
      const auto labels = metadata.find("labels:" + name);
      if (labels != metadata.end() && column.type == CellType::kNumber) {
        column.type = CellType::kLabel;
        column.labels = parse_csv_header(labels->second, file_);
      }
      columns_.push_back(std::move(column));
    }
  }

  void read_message(std::string_view content) {
    Fields fields(content, file_);
    const auto id = fields.number<std::uint16_t>();
    if (own_) {
      if (id == channel_) read_own(content);
      return;
    }
    fields.number<std::uint32_t>();
    const auto log_time = fields.number<std::uint64_t>();
    fields.number<std::uint64_t>();
    if (!ros_.read(id, log_time, fields.rest())) return;
    if (columns_.empty()) columns_ = ros_.columns();
    if (block_)
      ros_.append_to(*block_);
    else
      waiting_.emplace_back(content);
  }

  void read_own(std::string_view content) {
    const std::size_t head = kMessageHead + kCdrLittleEndian.size();
    if (content.size() != head + 8 * columns_.size() ||
        content.substr(kMessageHead, kCdrLittleEndian.size()) != kCdrLittleEndian)
      throw InputError(
          fmt::format("{}: damaged: message {} does not hold the {} columns of its channel", file_,
                      messages_ + 1, columns_.size()));
    if (!block_) {  // the chunk holds both the channel and the first rows
      waiting_.emplace_back(content);
      return;
    }
    ++messages_;
    append(content.substr(head));
  }

  void flush_waiting() {
    if (!waiting_.empty()) ros_.start_over();
    for (const std::string& content : std::exchange(waiting_, {})) read_message(content);
  }

  void append(std::string_view row) {
    for (std::size_t i = 0; i < columns_.size(); ++i)
      columns_[i].type == CellType::kInteger
          ? block_->integers.push_back(number_at<std::uint64_t>(row, 8 * i))
          : block_->numbers.push_back(number_at<double>(row, 8 * i));
    ++block_->rows;
  }

  std::string file_;
  std::ifstream stream_;
  std::string record_;
  std::vector<std::string> waiting_;
  RosRows ros_;
  TableBlock* block_ = nullptr;
  std::uint16_t channel_ = 0;
  long messages_ = 0;
  bool ended_ = false, own_ = false;  ///< own_: written by us, not by ROS
};

}  // namespace

std::unique_ptr<TableSource> open_mcap(const std::filesystem::path& file,
                                       const TableOptions& options) {
  return std::make_unique<McapSource>(file, options);
}

std::unique_ptr<TableSink> create_mcap(const std::filesystem::path& file,
                                       const std::vector<Column>& columns) {
  return std::make_unique<McapSink>(file, columns);
}

}  // namespace counterpoint
