// Numbers and parameters of C3D files (c3d.org): records GROUP:NAME of texts or numbers.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace counterpoint {

/// Number format of a C3D file, named after the processor.
enum class C3dProcessor : unsigned char {
  kIntel = 84,  ///< little-endian, IEEE 754 floats
  kDec = 85,    ///< little-endian, VAX F floats
  kMips = 86,   ///< big-endian, IEEE 754 floats
};

/// Return the number at a position; the caller must check that enough bytes follow it.
std::uint16_t c3d_word(C3dProcessor processor, std::string_view bytes, std::size_t position);
double c3d_real(C3dProcessor processor, std::string_view bytes, std::size_t position);

/// The parameter section. Names are upper case: "POINT:RATE".
class C3dParameters {
 public:
  /// `bytes`: the file up to its data. The section begins at `start`, where at least four bytes
  /// must follow. @throws InputError naming file and byte where a record is invalid or exceeds the
  /// bytes.
  C3dParameters(std::string bytes, std::size_t start, C3dProcessor processor, std::string file);

  bool has(const std::string& name) const { return records_.count(name) > 0; }
  /// Returns all numbers of a parameter, integers with their sign; empty if it is missing. Lists of
  /// more than 255 go on in NAME2, NAME3 ...
  std::vector<double> numbers(const std::string& name) const;
  /// Returns the first number; nothing if it is missing or not finite.
  std::optional<double> number(const std::string& name) const;
  /// Returns all texts of a parameter without blanks at their ends; lists go on in NAME2, NAME3 ...
  std::vector<std::string> texts(const std::string& name) const;

 private:
  struct Record {
    int type = 0;           ///< -1: text, else the bytes per number
    std::size_t width = 0;  ///< first dimension: letters per text
    std::size_t count = 0;  ///< total number of letters or numbers
    std::size_t position = 0;
  };
  [[noreturn]] void fail(std::size_t position, const std::string& what) const;
  void read(std::size_t position);
  Record record(std::size_t position) const;

  std::string bytes_, file_;
  C3dProcessor processor_;
  std::map<std::string, Record> records_;
};

}  // namespace counterpoint
