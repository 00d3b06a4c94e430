// Messages of ROS in MCAP files, as rosbag2 writes them, as rows of a table: schemas ros2msg and
// ros1msg, messages CDR and ros1. A column has the name that `rostopic echo -p` gives it:
// field.header.stamp [ns], field.position0, field.transforms0.transform.rotation.w; %time is when
// the message was recorded [ns].
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
  std::string text;  ///< of strings, whose number is NaN
  bool is_text = false;
  bool in_array = false;
};

/// One field of a message.
struct RosField {
  std::string type, name;
  bool is_array = false;
  int fixed_size = -1;  ///< of an array; -1: its length is in the message
};

/// What a topic's messages consist of.
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
  /// Reads a message; false: it is no row of this table. @throws InputError for messages of a
  /// second topic where none is chosen, of a shape that the first did not have, and damaged ones.
  bool read(std::uint16_t channel, std::uint64_t log_time, std::string_view message);
  /// Of the first row.
  const std::vector<Column>& columns() const { return columns_; }
  /// The message read last.
  void append_to(TableBlock& block);
  /// Messages are read once more, from the first.
  void start_over() { met_ = 0; }
  /// The topics met so far: "/tf, /joint_states".
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
  std::string topic_;  ///< that is read
  std::vector<Column> columns_;
  std::vector<RosValue> first_, row_;
  long met_ = 0, rows_ = 0;  ///< read so far, appended so far
};

}  // namespace counterpoint
