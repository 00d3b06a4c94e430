// Finished tasks on disk: a folder of journals, one per process, to which records are only
// appended.
//
// A journal consists of a header (8 bytes that identify the format, the fingerprint, the number of
// tasks) and records: length of the result [bytes], CRC-32 of number and result, number of the
// task, the result. A record that was cut off by a crash or a full disk fails its check; it and all
// later ones are ignored, and their tasks count as not done.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "task_list.h"

namespace counterpoint::apps::tasks {

/// Writes one journal. Several threads may call add().
class JournalWriter {
 public:
  /// Creates the folder; the file is created with the first task. @throws InputError if the folder
  /// cannot be created.
  JournalWriter(std::filesystem::path folder, const TaskList& list);
  ~JournalWriter();
  JournalWriter(const JournalWriter&) = delete;
  JournalWriter& operator=(const JournalWriter&) = delete;

  /// Adds a finished task, which then survives the death of this process, and after sync() that of
  /// the machine. @throws std::runtime_error with the system's reason if the disk is full or
  /// similar; then nothing of the task is kept.
  void add(std::int64_t number, const std::string& result);
  /// Forces new records to disk if the last time was at least a second ago; `now`: in any case.
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
  std::int64_t size_ = 0;  ///< size of complete records [bytes]
  bool dirty_ = false;
  double synced_ = 0.0;  ///< time of the last sync [s]
};

/// Reads all journals of a list of tasks in a folder.
class JournalReader {
 public:
  /// Reads the existing journals; a missing folder counts as empty. @throws InputError if a journal
  /// has another fingerprint or number of tasks.
  JournalReader(const std::filesystem::path& folder, const TaskList& list);

  /// Done flags by task number.
  std::vector<bool> done() const;
  std::int64_t num_done() const { return static_cast<std::int64_t>(places_.size()); }
  /// Calls take(number, result) for every finished task, in order of numbers.
  void for_each(const std::function<void(std::int64_t, std::string&&)>& take) const;

 private:
  struct Place {
    std::int64_t number;
    std::int64_t offset;  ///< start of the result in its file [bytes]
    std::uint32_t file, length;
  };
  void read(std::uint32_t file, const TaskList& list);

  std::vector<std::filesystem::path> files_;
  std::int64_t count_;
  std::vector<Place> places_;  ///< one of each finished task, in order of numbers
};

}  // namespace counterpoint::apps::tasks
