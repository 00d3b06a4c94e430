// Zip archives (APPNOTE.TXT of PKWARE) as far as .npz files need them: stored or deflated entries,
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

/// Writes entries one after the other without compression; their lengths need not be known in
/// advance.
class ZipWriter {
 public:
  /// @throws InputError when the file cannot be created.
  explicit ZipWriter(const std::filesystem::path& file);
  /// Begins an entry with the bytes `head`; end_entry may replace them by others of the same
  /// length.
  void begin_entry(const std::string& name, const std::string& head);
  void append(std::string_view bytes);
  void end_entry(const std::string& head);
  /// Writes the directory. This and the functions above throw std::runtime_error when the disk is
  /// full.
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
  std::uint32_t body_crc_ = 0;  ///< checksum of the current entry, without its head
  std::uint64_t body_size_ = 0;
};

/// The bytes of one entry, from first to last.
class ZipEntry {
 public:
  virtual ~ZipEntry() = default;
  /// Reads up to `count` bytes and returns their number, less at the end. @throws InputError where
  /// the data are damaged.
  virtual std::size_t read(char* bytes, std::size_t count) = 0;
};

class ZipReader {
 public:
  /// @throws InputError when the file is not an archive, or is damaged.
  explicit ZipReader(const std::filesystem::path& file);
  /// Returns an entry; null if there is none of this name.
  std::unique_ptr<ZipEntry> open(const std::string& name) const;
  /// Returns true if writing was interrupted: the last entry then extends to the end of the file.
  bool cut_short() const { return cut_short_; }

 private:
  struct Place {
    std::uint64_t offset = 0;  ///< offset of the local header
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
