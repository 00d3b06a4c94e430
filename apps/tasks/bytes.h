// Results of tasks as bytes, in the order in which they are written; for processes on machines of
// one kind.
#pragma once

#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace counterpoint::apps::tasks {

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
  /// How many, and each as put_one(writer, item) has it.
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

/// Every function @throws InputError where the bytes end before what is asked for.
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
  /// What BytesWriter::list wrote, each by get_one(reader).
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

}  // namespace counterpoint::apps::tasks
