// Finished tasks on disk: a folder of journals, one written by each process, only ever appended to.
//
// A journal is a header (8 bytes that name the format, the fingerprint, the number of tasks) and
// records: length of the result [bytes], CRC-32 of what follows, number of the task, the result.
// A record that was cut off by a death or a full disk fails its check; it and what follows it are
// not looked at, and the task counts as not done.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "task_list.h"

namespace counterpoint::apps::tasks {

/// Writes one journal. add() may be called by several threads.
class JournalWriter {
 public:
  /// Makes the folder; the file comes with the first task. @throws InputError if it cannot be made.
  JournalWriter(std::filesystem::path folder, const TaskList& list);
  ~JournalWriter();
  JournalWriter(const JournalWriter&) = delete;
  JournalWriter& operator=(const JournalWriter&) = delete;

  /// After it the task survives the death of this process; after sync() that of the machine.
  /// @throws std::runtime_error, naming the system's reason, where the disk is full or the like:
  /// nothing of the task is then kept.
  void add(std::int64_t number, const std::string& result);
  /// Has the system write to the disk itself what was added a second ago or more; `now`: all.
  void sync(bool now = false);

 private:
  void open();
  [[noreturn]] void fail(const char* what);

  std::filesystem::path folder_, file_;
  std::string name_;
  std::uint64_t fingerprint_;
  std::int64_t count_;
  std::mutex mutex_;
  int descriptor_ = -1;
  std::int64_t size_ = 0;  ///< [bytes], of whole records
  bool dirty_ = false;
  double synced_ = 0.0;  ///< when [s]
};

/// All journals of a list of tasks in a folder, by the number of the task.
class JournalReader {
 public:
  /// Reads what there is; no folder is an empty one. @throws InputError where a journal is of
  /// another fingerprint or number of tasks.
  JournalReader(const std::filesystem::path& folder, const TaskList& list);

  /// By number; what lies in memory for it is one bit a task.
  const std::vector<bool>& done() const { return done_; }
  std::int64_t num_done() const { return num_done_; }
  /// Calls take(number, result) for every task that is done, in order of number.
  void for_each(const std::function<void(std::int64_t, std::string&&)>& take) const;

 private:
  struct Place {
    std::int64_t number;
    std::int64_t offset;  ///< of the record [bytes]
    int file;
    std::uint32_t length;
  };
  void read(const std::filesystem::path& file, const TaskList& list,
            const std::function<void(const Place&)>& take) const;

  std::vector<std::filesystem::path> files_;
  TaskList list_;
  std::vector<bool> done_;
  std::int64_t num_done_ = 0;
};

}  // namespace counterpoint::apps::tasks
