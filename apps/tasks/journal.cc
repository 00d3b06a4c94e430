#include "journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "counterpoint/engine/clocks.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::apps::tasks {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kFormat = 0x32304b5341545043;  // "CPTASK02"
constexpr double kSyncInterval = 1.0;                  // [s]
constexpr const char* kEnding = ".journal";

struct FileHeader {
  std::uint64_t format, fingerprint;
  std::int64_t count;
};
struct RecordHeader {
  std::uint32_t length, check;
  std::int64_t number;
};

std::uint32_t check_of(std::int64_t number, const char* result, std::size_t length) {
  uLong check = crc32(0, reinterpret_cast<const Bytef*>(&number), sizeof number);
  return static_cast<std::uint32_t>(crc32_z(check, reinterpret_cast<const Bytef*>(result), length));
}

std::string host() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

}  // namespace

JournalWriter::JournalWriter(fs::path folder, const TaskList& list)
    : folder_(std::move(folder)),
      name_(list.name),
      fingerprint_(list.fingerprint),
      count_(list.count),
      synced_(wall_seconds()) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (!error && access(folder_.c_str(), W_OK) == 0) return;
  throw InputError(fmt::format(
      "{}: finished tasks cannot be kept here ({}); expected a folder that can be written",
      folder_.string(), error ? error.message() : std::strerror(errno)));
}

JournalWriter::~JournalWriter() {
  if (descriptor_ < 0) return;
  fsync(descriptor_);
  close(descriptor_);
}

void JournalWriter::fail(const char* what) {
  throw std::runtime_error(fmt::format(
      "{}: {}: {}. What was finished before is safe there: make room, then run the same "
      "command again, and it goes on",
      (file_.empty() ? folder_ : file_).string(), what, std::strerror(errno)));
}

void JournalWriter::open() {
  // Processes of all machines write into one folder; each uses the first free name that contains
  // its host and process id.
  const std::string stem = fmt::format("{}.{}.{}", name_, host(), getpid());
  for (int i = 0; descriptor_ < 0; ++i) {
    const fs::path file = folder_ / fmt::format("{}.{}{}", stem, i, kEnding);
    descriptor_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (descriptor_ < 0 && errno != EEXIST) fail("a journal cannot be made");
    file_ = file;
  }
  const FileHeader header{kFormat, fingerprint_, count_};
  if (write(descriptor_, &header, sizeof header) != sizeof header) {
    const int reason = errno;
    unlink(file_.c_str());
    close(descriptor_);
    descriptor_ = -1;
    errno = reason;
    fail("cannot be written");
  }
  size_ = sizeof header;
}

void JournalWriter::add(std::int64_t number, const std::string& result) {
  const RecordHeader header{static_cast<std::uint32_t>(result.size()),
                            check_of(number, result.data(), result.size()), number};
  const std::string record =
      std::string(reinterpret_cast<const char*>(&header), sizeof header) + result;
  const std::lock_guard lock(mutex_);
  if (descriptor_ < 0) open();
  // An incomplete write does not report its reason; the next write does.
  for (std::size_t written = 0; written < record.size();) {
    const ssize_t more = write(descriptor_, record.data() + written, record.size() - written);
    if (more <= 0) {
      const int reason = errno;
      // Removes the incomplete record; a reader would stop there anyway.
      if (ftruncate(descriptor_, size_) != 0 || lseek(descriptor_, size_, SEEK_SET) < 0)
        close(descriptor_);
      errno = reason;
      fail("cannot be written");
    }
    written += static_cast<std::size_t>(more);
  }
  size_ += static_cast<std::int64_t>(record.size());
  dirty_ = true;
}

void JournalWriter::sync(bool now) {
  const double time = wall_seconds();
  int descriptor = -1;
  {
    const std::lock_guard lock(mutex_);
    if (!dirty_ || (!now && time < synced_ + kSyncInterval)) return;
    dirty_ = false;
    descriptor = descriptor_;
    synced_ = time;
  }
  // Without the lock, so that tasks continue during the write to disk.
  if (fdatasync(descriptor) != 0) fail("cannot be written to the disk");
}

JournalReader::JournalReader(const fs::path& folder, const TaskList& list) : count_(list.count) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind(list.name + ".", 0) == 0 && entry.path().extension() == kEnding)
      files_.push_back(entry.path());
  }
  std::sort(files_.begin(), files_.end());
  for (std::uint32_t file = 0; file < files_.size(); ++file) read(file, list);
  std::stable_sort(places_.begin(), places_.end(),
                   [](const Place& a, const Place& b) { return a.number < b.number; });
  // Two concurrent runs may have done a task twice; the results are bitwise equal, so one is kept.
  places_.erase(std::unique(places_.begin(), places_.end(),
                            [](const Place& a, const Place& b) { return a.number == b.number; }),
                places_.end());
}

std::vector<bool> JournalReader::done() const {
  std::vector<bool> done(static_cast<std::size_t>(count_), false);
  for (const Place& place : places_) done[static_cast<std::size_t>(place.number)] = true;
  return done;
}

void JournalReader::read(std::uint32_t number, const TaskList& list) {
  const fs::path& file = files_[number];
  std::ifstream stream(file, std::ios::binary);
  FileHeader header{};
  // A process may have died before it completed the header.
  if (!stream.read(reinterpret_cast<char*>(&header), sizeof header)) return;
  if (header.format != kFormat)
    throw InputError(fmt::format("{}: is no journal of tasks; remove it", file.string()));
  if (header.fingerprint != list.fingerprint || header.count != list.count)
    throw InputError(fmt::format(
        "{}: finished tasks of something else ({} tasks; here {}): the scene, the study, an option "
        "or the version has changed. Remove the folder {}, or give another",
        file.string(), header.count, list.count, file.parent_path().string()));
  std::string result;
  std::int64_t offset = sizeof header;
  const auto size = static_cast<std::int64_t>(fs::file_size(file));
  for (RecordHeader record{}; stream.read(reinterpret_cast<char*>(&record), sizeof record);) {
    offset += static_cast<std::int64_t>(sizeof record);
    const auto length = static_cast<std::int64_t>(record.length);
    if (offset + length > size) return;
    result.resize(record.length);
    if (!stream.read(result.data(), length)) return;
    if (record.number < 0 || record.number >= list.count ||
        check_of(record.number, result.data(), result.size()) != record.check)
      return;
    places_.push_back({record.number, offset, number, record.length});
    offset += length;
  }
}

void JournalReader::for_each(const std::function<void(std::int64_t, std::string&&)>& take) const {
  std::vector<std::ifstream> streams(files_.size());
  for (const Place& place : places_) {
    std::ifstream& stream = streams[place.file];
    if (!stream.is_open()) stream.open(files_[place.file], std::ios::binary);
    if (stream.tellg() != place.offset) stream.seekg(place.offset);
    std::string result(place.length, '\0');
    if (!stream.read(result.data(), static_cast<std::streamsize>(place.length)))
      throw std::runtime_error(
          fmt::format("{}: cannot be read again", files_[place.file].string()));
    take(place.number, std::move(result));
  }
}

}  // namespace counterpoint::apps::tasks
