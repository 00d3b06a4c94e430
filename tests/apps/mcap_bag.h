// Writes .mcap files as rosbag2 does, byte by byte (mcap.dev/spec), with messages in CDR.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>

namespace counterpoint::test {

/// Fields of one message in call order, each aligned to its size as CDR requires.
class RosMessage {
 public:
  template <class Number, class Given>
  RosMessage& number(Given given) {
    const auto x = static_cast<Number>(given);
    bytes_.resize((bytes_.size() + sizeof x - 1) / sizeof x * sizeof x, '\0');
    append(&x, sizeof x);
    return *this;
  }
  RosMessage& string(const std::string& text) {
    number<std::uint32_t>(text.size() + 1);
    append(text.c_str(), text.size() + 1);
    return *this;
  }
  std::string file() const { return std::string("\0\1\0\0", 4) + bytes_; }

 private:
  void append(const void* data, std::size_t size) {
    bytes_.append(static_cast<const char*>(data), size);
  }
  std::string bytes_;
};

/// Schemas, channels and messages in one chunk without compression.
class McapBag {
 public:
  void schema(std::uint16_t id, const std::string& name, const std::string& definition) {
    record(3, number(id) + text(name) + text("ros2msg") + text(definition));
  }
  void channel(std::uint16_t id, std::uint16_t schema, const std::string& topic) {
    record(4, number(id) + number(schema) + text(topic) + text("cdr") + number(std::uint32_t{0}));
  }
  void message(std::uint16_t channel, long nanoseconds, const RosMessage& message) {
    const auto time = number(static_cast<std::uint64_t>(nanoseconds));
    record(5, number(channel) + number(std::uint32_t{0}) + time + time + message.file());
  }
  void append(const McapBag& other) { records_ += other.records_; }

  std::string file() const {
    const std::string magic("\x89MCAP0\r\n", 8);
    const std::string chunk =
        std::string(3 * 8 + 4, '\0') + text("") + number(std::uint64_t{records_.size()}) + records_;
    return magic + wrapped(1, text("ros2") + text("test")) + wrapped(6, chunk) +
           wrapped(15, std::string(4, '\0')) + wrapped(2, std::string(20, '\0')) + magic;
  }

 private:
  template <class Number>
  static std::string number(Number x) {
    std::string out(sizeof x, '\0');
    std::memcpy(out.data(), &x, sizeof x);
    return out;
  }
  static std::string text(const std::string& text) {
    return number(static_cast<std::uint32_t>(text.size())) + text;
  }
  static std::string wrapped(char kind, const std::string& content) {
    return kind + number(std::uint64_t{content.size()}) + content;
  }
  void record(char kind, const std::string& content) { records_ += wrapped(kind, content); }

  std::string records_;
};

}  // namespace counterpoint::test
