// Numbers and parameters of C3D files (c3d.org): records GROUP:NAME of texts or numbers.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace counterpoint {

/// The machine whose numbers a C3D file holds.
enum class C3dProcessor : unsigned char {
  kIntel = 84,  ///< lowest byte first
  kDec = 85,    ///< lowest byte first; VAX F floats
  kMips = 86,   ///< highest byte first
};

/// Numbers at a position of some bytes; the caller checked that there are as many.
std::uint16_t c3d_word(C3dProcessor processor, std::string_view bytes, std::size_t position);
double c3d_real(C3dProcessor processor, std::string_view bytes, std::size_t position);

/// The parameter section. Names are looked up in capitals: "POINT:RATE".
class C3dParameters {
 public:
  /// `bytes` are the file's up to its data; the section begins at `start`, where they have at least
  /// four. @throws InputError naming file and byte where a record is none or goes beyond their end.
  C3dParameters(std::string bytes, std::size_t start, C3dProcessor processor, std::string file);

  bool has(const std::string& name) const { return records_.count(name) > 0; }
  /// All its numbers, those of integers with their sign; none where it is missing. Lists of more
  /// than 255 go on in NAME2, NAME3 ...
  std::vector<double> numbers(const std::string& name) const;
  /// The first; nothing where it is missing or not finite.
  std::optional<double> number(const std::string& name) const;
  /// All its texts, without blanks at their ends; lists go on as those of numbers do.
  std::vector<std::string> texts(const std::string& name) const;

 private:
  struct Record {
    int type = 0;           ///< -1: text, else the bytes of a number
    std::size_t width = 0;  ///< the first dimension: letters of a text
    std::size_t count = 0;  ///< letters or numbers altogether
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
