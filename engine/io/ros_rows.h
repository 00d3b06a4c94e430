// ROS messages in MCAP files, as rosbag2 writes them, as rows of a table: schemas ros2msg and
// ros1msg, encodings CDR and ros1. Columns are named as by `rostopic echo -p`: field.header.stamp
// [ns], field.position0, field.transforms0.transform.rotation.w; %time is the time of recording
// [ns].
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "counterpoint/engine/io/table_format.h"

namespace counterpoint {

/// One value in a message.
struct RosValue {
  std::string column;
  double number = 0.0;
  std::string text;  ///< for strings, whose number is NaN
  bool is_text = false;
  bool in_array = false;
};

/// One field of a message.
struct RosField {
  std::string type, name;
  bool is_array = false;
  int fixed_size = -1;  ///< length of a fixed-size array; -1: the message has it
};

/// The message type of a topic, with the fields of all nested types.
struct RosType {
  std::string name;  ///< pkg/Type
  std::map<std::string, std::vector<RosField>> types;
  bool ros1 = false;
};

/// The rows of one topic.
class RosRows {
 public:
  RosRows(std::string file, const TableOptions& options)
      : file_(std::move(file)), options_(options) {}

  void add_schema(std::uint16_t id, std::string_view name, std::string_view encoding,
                  std::string_view definition);
  void add_channel(std::uint16_t id, std::uint16_t schema, std::string_view topic,
                   std::string_view encoding);
  /// Reads a message; false if it is not a row of this table. @throws InputError for a message of a
  /// second topic where none is chosen, of a different shape than the first, or damaged.
  bool read(std::uint16_t channel, std::uint64_t log_time, std::string_view message);
  /// The columns, which follow from the first row.
  const std::vector<Column>& columns() const { return columns_; }
  /// Appends the message read last.
  void append_to(TableBlock& block);
  /// Prepares for reading the messages again from the first one.
  void start_over() { met_ = 0; }
  /// Returns the topics found so far: "/tf, /joint_states".
  std::string topics() const;

 private:
  void set_columns(const std::vector<RosValue>& values);
  bool is_chosen(const std::vector<RosValue>& values) const;

  struct Channel {
    std::string topic;
    const RosType* type = nullptr;
  };
  std::string file_;
  TableOptions options_;
  std::map<std::uint16_t, RosType> types_;
  std::map<std::uint16_t, Channel> channels_;
  std::string topic_;  ///< the topic that is read
  std::vector<Column> columns_;
  std::vector<RosValue> first_, row_;
  long met_ = 0, rows_ = 0;  ///< rows read so far, rows appended so far
};

}  // namespace counterpoint
