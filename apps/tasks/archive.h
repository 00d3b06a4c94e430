// Values as bytes, for the results of tasks and the messages between ranks, through cereal. A plain
// structure lists its members once: template <class A> void serialize(A& a) { a(first, second); }
#pragma once

#include <cereal/archives/portable_binary.hpp>
#include <cereal/types/optional.hpp>
#include <cereal/types/string.hpp>
#include <cereal/types/utility.hpp>
#include <cereal/types/vector.hpp>
#include <new>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "counterpoint/model/spatial.h"

namespace cereal {

template <class Archive>
void save(Archive& archive, const counterpoint::VectorX& vector) {
  archive(std::vector<double>(vector.begin(), vector.end()));
}

template <class Archive>
void load(Archive& archive, counterpoint::VectorX& vector) {
  std::vector<double> numbers;
  archive(numbers);
  vector = Eigen::Map<const counterpoint::VectorX>(numbers.data(),
                                                   static_cast<Eigen::Index>(numbers.size()));
}

}  // namespace cereal

namespace counterpoint::apps::tasks {

/// A structure of numbers as it is in memory, for processes on machines of one kind.
template <class Numbers>
auto as_in_memory(Numbers& numbers) {
  static_assert(std::is_trivially_copyable_v<Numbers>);
  return cereal::binary_data(&numbers, sizeof numbers);
}

template <class... Values>
std::string to_bytes(const Values&... values) {
  std::ostringstream stream;
  cereal::PortableBinaryOutputArchive archive(stream);
  archive(values...);
  return std::move(stream).str();
}

/// Reads values in the order in which to_bytes wrote them. @throws InputError if the bytes end too
/// early.
template <class... Values>
void read_bytes(const std::string& bytes, Values&... values) {
  const auto fail = [] { throw InputError("the result of a task is cut short"); };
  try {
    std::istringstream stream(bytes);
    cereal::PortableBinaryInputArchive archive(stream);
    archive(values...);
  } catch (const cereal::Exception&) {
    fail();
  } catch (const std::length_error&) {  // a damaged size
    fail();
  } catch (const std::bad_alloc&) {
    fail();
  }
}

template <class Value>
Value from_bytes(const std::string& bytes) {
  Value value;
  read_bytes(bytes, value);
  return value;
}

}  // namespace counterpoint::apps::tasks
