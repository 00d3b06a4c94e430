// Zip archives (APPNOTE.TXT of PKWARE) as far as .npz files need them: entries stored or deflated,
// also beyond 4 GB.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace counterpoint {

/// Writes entries without compression, one after the other, of lengths that need not be known at
/// the beginning.
class ZipWriter {
 public:
  /// @throws InputError when the file cannot be created.
  explicit ZipWriter(const std::filesystem::path& file);
  /// `head`: the first bytes; end_entry may replace them by others, as many.
  void begin_entry(const std::string& name, const std::string& head);
  void append(std::string_view bytes);
  void end_entry(const std::string& head);
  /// Writes the directory. All @throw std::runtime_error when the disk is full.
  void finish();

 private:
  struct Entry {
    std::string name;
    std::uint32_t crc = 0;
    std::uint64_t size = 0, offset = 0;
  };
  void put(std::string_view bytes);

  std::string file_;
  std::ofstream stream_;
  std::uint64_t position_ = 0;
  std::vector<Entry> entries_;
  std::uint32_t body_crc_ = 0;  ///< of the entry that is written, without its head
  std::uint64_t body_size_ = 0;
};

/// The bytes of one entry, from first to last.
class ZipEntry {
 public:
  virtual ~ZipEntry() = default;
  /// Up to `count` bytes; fewer at the end. @throws InputError where they are damaged.
  virtual std::size_t read(char* bytes, std::size_t count) = 0;
};

class ZipReader {
 public:
  /// @throws InputError when it is no archive, or damaged.
  explicit ZipReader(const std::filesystem::path& file);
  /// Null: there is no such entry.
  std::unique_ptr<ZipEntry> open(const std::string& name) const;
  /// Was writing it stopped before the end? The last entry then ends with the file.
  bool cut_short() const { return cut_short_; }

 private:
  struct Place {
    std::uint64_t offset = 0;  ///< of its local header
    std::uint64_t packed = 0, size = 0;
    std::uint32_t crc = 0;
    bool deflated = false, checked = true;
  };
  bool read_directory();
  void scan();
  std::string bytes_at(std::uint64_t offset, std::size_t count) const;

  std::filesystem::path file_;
  std::uint64_t size_ = 0;
  std::map<std::string, Place> places_;
  bool cut_short_ = false;
};

}  // namespace counterpoint
