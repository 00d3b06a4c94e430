// Independent, numbered tasks, for studies and for searches from many starts. The caller runs a
// list of them where it likes: in one thread, on all cores, or on several machines.
#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint {

namespace tasks {

/// Result of a task, as bytes (BytesWriter) that can travel between processes and be stored in
/// files.
struct Outcome {
  std::string bytes;
  /// False if the task was stopped early (Ctrl-C). It then counts as not done, and is not stored.
  bool finished = true;
};

/// A pure function of the task number: the same number gives the same bits in every thread, process
/// and machine. It may keep a workspace. An exception ends the run.
using Task = std::function<Outcome(std::int64_t number)>;

/// Tasks 0 ... count - 1. A task is defined by its number alone until it begins: there is no list
/// of tasks.
struct TaskList {
  std::string name;  ///< plural noun for the tasks, "rollouts": in progress bars and file names
  std::int64_t count = 0;
  /// Called once in each working thread, concurrently.
  std::function<Task()> make_task;
  /// Number of tasks that this process has done, including fractions of running ones, for progress
  /// bars. Empty: whole tasks are counted.
  std::function<double()> work = {};
  /// Hash of everything that the results depend on; stored results with another one are rejected.
  std::uint64_t fingerprint = 0;
};

/// Results by number; empty for tasks that were not done, partial for a task that was stopped. Code
/// that consists of task lists takes a ListRunner and need not know where they run: in this thread
/// (run_here), on all cores, or on several machines.
using ListResults = std::vector<std::optional<std::string>>;
using ListRunner = std::function<ListResults(const TaskList&)>;

/// Runs the tasks in this thread, in order of number, until one is stopped.
inline ListResults run_here(const TaskList& list) {
  ListResults results(static_cast<std::size_t>(list.count));
  const Task task = list.make_task();
  for (std::int64_t i = 0; i < list.count; ++i) {
    Outcome outcome = task(i);
    if (!outcome.bytes.empty()) results[static_cast<std::size_t>(i)] = std::move(outcome.bytes);
    if (!outcome.finished) break;
  }
  return results;
}

// Results of tasks as bytes, in the order in which they are written, for processes on machines of
// the same byte order and type sizes.

class BytesWriter {
 public:
  template <class T>
  BytesWriter& put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  BytesWriter& text(std::string_view value) {
    put(static_cast<std::uint64_t>(value.size()));
    bytes_.append(value);
    return *this;
  }
  BytesWriter& numbers(const double* values, std::size_t count) {
    return text({reinterpret_cast<const char*>(values), count * sizeof(double)});
  }
  BytesWriter& numbers(const VectorX& values) {
    return numbers(values.data(), static_cast<std::size_t>(values.size()));
  }
  BytesWriter& numbers(const std::vector<double>& v) { return numbers(v.data(), v.size()); }
  /// Writes the number of items, and each item by put_one(writer, item).
  template <class Items, class PutOne>
  BytesWriter& list(const Items& items, PutOne put_one) {
    put(static_cast<std::uint64_t>(items.size()));
    for (const auto& item : items) put_one(*this, item);
    return *this;
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Reads what BytesWriter wrote. Every function @throws InputError if the bytes end too early.
class BytesReader {
 public:
  explicit BytesReader(std::string_view bytes) : bytes_(bytes) {}
  template <class T>
  T get() {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    T value{};
    std::memcpy(&value, next(sizeof value), sizeof value);
    return value;
  }
  std::string_view text() {
    const auto size = static_cast<std::size_t>(get<std::uint64_t>());
    return {next(size), size};
  }
  std::vector<double> numbers() {
    const std::string_view part = text();
    std::vector<double> values(part.size() / sizeof(double));
    if (!values.empty()) std::memcpy(values.data(), part.data(), values.size() * sizeof(double));
    return values;
  }
  VectorX vector() {
    const std::vector<double> values = numbers();
    return Eigen::Map<const VectorX>(values.data(), static_cast<Eigen::Index>(values.size()));
  }
  std::string string() { return std::string(text()); }
  /// Reads a list of BytesWriter::list, each item by get_one(reader).
  template <class GetOne>
  auto list(GetOne get_one) {
    std::vector<decltype(get_one(*this))> items;
    for (auto count = get<std::uint64_t>(); count > 0; --count) items.push_back(get_one(*this));
    return items;
  }
  bool empty() const { return bytes_.empty(); }

 private:
  const char* next(std::size_t size) {
    if (bytes_.size() < size) throw InputError("the result of a task is cut short");
    const char* at = bytes_.data();
    bytes_.remove_prefix(size);
    return at;
  }
  std::string_view bytes_;
};

}  // namespace tasks

}  // namespace counterpoint
