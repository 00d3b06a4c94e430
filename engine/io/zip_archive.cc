#include "counterpoint/engine/io/zip_archive.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <stdexcept>

#include "counterpoint/engine/io/bytes.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint {
namespace {

constexpr std::uint32_t kLocal = 0x04034b50, kCentral = 0x02014b50, kEnd = 0x06054b50;
constexpr std::uint32_t kEnd64 = 0x06064b50, kLocator64 = 0x07064b50;
constexpr std::size_t kLocalSize = 30, kCentralSize = 46, kEndSize = 22, kEnd64Size = 56,
                      kLocatorSize = 20;
constexpr std::size_t kCrcInLocal = 14;
constexpr std::uint16_t kVersion = 45;            // supports 64-bit sizes
constexpr std::uint16_t kDate = 0x21;             // 1980-01-01: equal content gives equal bytes
constexpr std::uint32_t kIn64 = 0xffffffff;       // marks a size in the extra field
constexpr std::uint64_t kMaxDirectory = 1 << 20;  // bytes; enough for a few arrays

std::uint32_t crc(std::uint32_t so_far, std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t count = std::min<std::size_t>(bytes.size(), 1 << 30);
    so_far = static_cast<std::uint32_t>(
        crc32(so_far, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(count)));
    bytes.remove_prefix(count);
  }
  return so_far;
}

/// Returns the fields from the version on that local headers and directory entries share.
std::string header(std::uint32_t crc_of, std::uint64_t name_size, std::uint16_t extra_size) {
  std::string out;
  append_number(out, kVersion);
  append_number(out, std::uint16_t{0});
  append_number(out, std::uint16_t{0});  // stored
  append_number(out, std::uint16_t{0});
  append_number(out, kDate);
  append_number(out, crc_of);
  append_number(out, kIn64);
  append_number(out, kIn64);
  append_number(out, static_cast<std::uint16_t>(name_size));
  append_number(out, extra_size);
  return out;
}

std::string sizes(std::uint64_t size) {
  std::string out;
  append_number(out, size);
  append_number(out, size);
  return out;
}

/// Reads the bytes of an entry, stored or deflated.
class FileEntry final : public ZipEntry {
 public:
  FileEntry(std::ifstream stream, std::string where, std::uint64_t packed, bool deflated)
      : stream_(std::move(stream)), where_(std::move(where)), left_(packed), deflated_(deflated) {
    if (deflated_ && inflateInit2(&inflater_, -MAX_WBITS) != Z_OK)
      throw std::runtime_error("zlib failed");
  }
  ~FileEntry() override {
    if (deflated_) inflateEnd(&inflater_);
  }
  FileEntry(const FileEntry&) = delete;
  FileEntry& operator=(const FileEntry&) = delete;

  void expect(std::uint64_t size, std::uint32_t checksum) {
    size_ = size;
    checksum_ = checksum;
    checked_ = true;
  }

  std::size_t read(char* bytes, std::size_t count) override {
    const std::size_t got = deflated_ ? inflate_some(bytes, count) : stored(bytes, count);
    crc_ = crc(crc_, {bytes, got});
    read_ += got;
    if (checked_ && read_ == size_ && crc_ != checksum_)
      throw InputError(fmt::format("{}: damaged: its checksum is another", where_));
    return got;
  }

 private:
  std::size_t stored(char* bytes, std::size_t count) {
    stream_.read(bytes, static_cast<std::streamsize>(std::min<std::uint64_t>(count, left_)));
    const auto got = static_cast<std::size_t>(stream_.gcount());
    left_ -= got;
    return got;
  }

  std::size_t inflate_some(char* bytes, std::size_t count) {
    std::size_t done = 0;
    while (done < count && !ended_) {
      if (inflater_.avail_in == 0) {
        inflater_.avail_in = static_cast<uInt>(stored(buffer_, sizeof buffer_));
        inflater_.next_in = reinterpret_cast<Bytef*>(buffer_);
        if (inflater_.avail_in == 0) break;
      }
      const std::size_t room = std::min<std::size_t>(count - done, 1 << 30);
      inflater_.next_out = reinterpret_cast<Bytef*>(bytes + done);
      inflater_.avail_out = static_cast<uInt>(room);
      const int status = inflate(&inflater_, Z_NO_FLUSH);
      done += room - inflater_.avail_out;
      ended_ = status == Z_STREAM_END;
      if (status != Z_OK && !ended_) throw InputError(fmt::format("{}: damaged", where_));
    }
    return done;
  }

  std::ifstream stream_;
  std::string where_;
  std::uint64_t left_, read_ = 0, size_ = 0;
  std::uint32_t crc_ = 0, checksum_ = 0;
  bool deflated_, ended_ = false, checked_ = false;
  z_stream inflater_{};
  char buffer_[1 << 14] = {};
};

}  // namespace

ZipWriter::ZipWriter(const std::filesystem::path& file)
    : file_(file.string()), stream_(file, std::ios::binary | std::ios::trunc) {
  if (!stream_)
    throw InputError(fmt::format(
        "{}: cannot be created; expected a path in an existing, writable folder", file_));
}

void ZipWriter::put(std::string_view bytes) {
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream_.flush();
  position_ += bytes.size();
  if (!stream_) throw std::runtime_error(fmt::format("{}: cannot be written (disk full?)", file_));
}

void ZipWriter::begin_entry(const std::string& name, const std::string& head) {
  entries_.push_back({name, 0, head.size(), position_});
  std::string local;
  append_number(local, kLocal);
  local += header(0, name.size(), 20) + name;
  append_number(local, std::uint16_t{1});
  append_number(local, std::uint16_t{16});
  local += sizes(0) + head;
  put(local);
  body_crc_ = 0;
  body_size_ = 0;
}

void ZipWriter::append(std::string_view bytes) {
  body_crc_ = crc(body_crc_, bytes);
  body_size_ += bytes.size();
  put(bytes);
}

void ZipWriter::end_entry(const std::string& head) {
  Entry& entry = entries_.back();
  entry.size = head.size() + body_size_;
  entry.crc = static_cast<std::uint32_t>(
      crc32_combine(crc(0, head), body_crc_, static_cast<z_off_t>(body_size_)));
  std::string checksum;
  append_number(checksum, entry.crc);
  const auto overwrite = [&](std::uint64_t at, std::string_view bytes) {
    stream_.seekp(static_cast<std::streamoff>(at));
    stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  };
  const std::uint64_t extra = entry.offset + kLocalSize + entry.name.size() + 4;
  overwrite(entry.offset + kCrcInLocal, checksum);
  overwrite(extra, sizes(entry.size));
  overwrite(extra + 16, head);
  stream_.seekp(static_cast<std::streamoff>(position_));
  put("");
}

void ZipWriter::finish() {
  const std::uint64_t directory = position_;
  std::string out;
  for (const Entry& entry : entries_) {
    append_number(out, kCentral);
    append_number(out, kVersion);
    out += header(entry.crc, entry.name.size(), 28);
    out += std::string(2 + 2 + 2 + 4, '\0');
    append_number(out, kIn64);
    out += entry.name;
    append_number(out, std::uint16_t{1});
    append_number(out, std::uint16_t{24});
    out += sizes(entry.size);
    append_number(out, entry.offset);
  }
  const std::uint64_t size = out.size();
  const auto count = static_cast<std::uint64_t>(entries_.size());
  append_number(out, kEnd64);
  append_number(out, static_cast<std::uint64_t>(kEnd64Size - 12));
  append_number(out, kVersion);
  append_number(out, kVersion);
  append_number(out, std::uint64_t{0});  // disks
  for (const std::uint64_t x : {count, count, size, directory}) append_number(out, x);
  append_number(out, kLocator64);
  append_number(out, std::uint32_t{0});
  append_number(out, directory + size);
  append_number(out, std::uint32_t{1});
  append_number(out, kEnd);
  append_number(out, std::uint32_t{0});
  append_number(out, static_cast<std::uint16_t>(count));
  append_number(out, static_cast<std::uint16_t>(count));
  append_number(out, kIn64);
  append_number(out, kIn64);
  append_number(out, std::uint16_t{0});
  put(out);
}

ZipReader::ZipReader(const std::filesystem::path& file)
    : file_(file), size_(std::filesystem::file_size(file)) {
  if (!read_directory()) scan();
}

std::string ZipReader::bytes_at(std::uint64_t offset, std::size_t count) const {
  std::string bytes(count, '\0');
  std::ifstream stream(file_, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(offset));
  stream.read(bytes.data(), static_cast<std::streamsize>(count));
  if (offset > size_ || static_cast<std::size_t>(stream.gcount()) != count)
    throw InputError(fmt::format("{}: damaged, or cut short", file_.string()));
  return bytes;
}

bool ZipReader::read_directory() {
  const std::size_t tail =
      static_cast<std::size_t>(std::min<std::uint64_t>(size_, kEndSize + 0xffff));
  const std::string end = bytes_at(size_ - tail, tail);
  const std::size_t at = end.rfind("PK\x05\x06");
  if (at == std::string::npos || at + kEndSize > end.size()) return false;
  std::uint64_t size = number_at<std::uint32_t>(end, at + 12),
                offset = number_at<std::uint32_t>(end, at + 16);
  if ((size == kIn64 || offset == kIn64) && at >= kLocatorSize &&
      number_at<std::uint32_t>(end, at - kLocatorSize) == kLocator64) {
    const std::string end64 =
        bytes_at(number_at<std::uint64_t>(end, at - kLocatorSize + 8), kEnd64Size);
    size = number_at<std::uint64_t>(end64, 40);
    offset = number_at<std::uint64_t>(end64, 48);
  }
  if (size > kMaxDirectory)
    throw InputError(
        fmt::format("{}: a directory of {} bytes; expected a few arrays", file_.string(), size));
  const std::string directory = bytes_at(offset, static_cast<std::size_t>(size));
  for (std::size_t p = 0; p + kCentralSize <= directory.size();) {
    if (number_at<std::uint32_t>(directory, p) != kCentral) break;
    const std::size_t name = number_at<std::uint16_t>(directory, p + 28);
    const std::size_t extra = number_at<std::uint16_t>(directory, p + 30);
    const std::size_t comment = number_at<std::uint16_t>(directory, p + 32);
    if (p + kCentralSize + name + extra > directory.size()) break;
    Place place;
    const auto method = number_at<std::uint16_t>(directory, p + 10);
    place.deflated = method == 8;
    place.crc = number_at<std::uint32_t>(directory, p + 16);
    place.packed = number_at<std::uint32_t>(directory, p + 20);
    place.size = number_at<std::uint32_t>(directory, p + 24);
    place.offset = number_at<std::uint32_t>(directory, p + 42);
    // The extra field holds those of the three values that do not fit, in this order.
    for (std::size_t x = p + kCentralSize + name, last = x + extra; x + 4 <= last;) {
      const auto length = number_at<std::uint16_t>(directory, x + 2);
      if (x + 4 + length > last) break;
      std::size_t next = x + 4;
      for (std::uint64_t* value : {&place.size, &place.packed, &place.offset}) {
        if (number_at<std::uint16_t>(directory, x) != 1 || *value != kIn64 ||
            next + 8 > x + 4 + length)
          continue;
        *value = number_at<std::uint64_t>(directory, next);
        next += 8;
      }
      x += 4 + length;
    }
    const std::string key = directory.substr(p + kCentralSize, name);
    if (method != 0 && method != 8)
      throw InputError(fmt::format("{}: '{}' is packed by method {}; expected none, or deflate",
                                   file_.string(), key, method));
    places_[key] = place;
    p += kCentralSize + name + extra + comment;
  }
  return true;
}

/// Finds the entries of an archive whose ZipWriter did not finish.
void ZipReader::scan() {
  cut_short_ = true;
  for (std::uint64_t at = 0; at + kLocalSize <= size_;) {
    const std::string local = bytes_at(at, kLocalSize);
    if (number_at<std::uint32_t>(local, 0) != kLocal) break;
    const std::size_t name = number_at<std::uint16_t>(local, 26),
                      extra = number_at<std::uint16_t>(local, 28);
    const std::uint64_t data = at + kLocalSize + name + extra;
    if (extra != 20 || data > size_) break;
    const std::string rest = bytes_at(at + kLocalSize, name + extra);
    Place place;
    place.offset = at;
    place.packed = place.size = number_at<std::uint64_t>(rest, name + 4);
    place.crc = number_at<std::uint32_t>(local, kCrcInLocal);
    place.checked = place.size > 0;
    if (place.size == 0) place.packed = place.size = size_ - data;
    places_[rest.substr(0, name)] = place;
    if (place.size > size_ - data) break;
    at = data + place.size;
  }
  if (places_.empty())
    throw InputError(fmt::format("{}: damaged: no directory of the archive", file_.string()));
}

std::unique_ptr<ZipEntry> ZipReader::open(const std::string& name) const {
  const auto found = places_.find(name);
  if (found == places_.end()) return nullptr;
  const Place& place = found->second;
  const std::string local = bytes_at(place.offset, kLocalSize);
  if (number_at<std::uint32_t>(local, 0) != kLocal)
    throw InputError(
        fmt::format("{}: damaged: '{}' is not where its directory says", file_.string(), name));
  const std::uint64_t data = place.offset + kLocalSize + number_at<std::uint16_t>(local, 26) +
                             number_at<std::uint16_t>(local, 28);
  std::ifstream stream(file_, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(data));
  auto entry =
      std::make_unique<FileEntry>(std::move(stream), fmt::format("{}: '{}'", file_.string(), name),
                                  place.packed, place.deflated);
  if (place.checked) entry->expect(place.size, place.crc);
  return entry;
}

}  // namespace counterpoint
