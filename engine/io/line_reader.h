// Reads the lines of a text file of any length.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/spatial.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

class LineReader {
 public:
  /// `kind`: format name for messages, "CSV". @throws InputError if the file cannot be opened.
  LineReader(const std::filesystem::path& file, std::string kind)
      : name_(file.string()), kind_(std::move(kind)), stream_(file, std::ios::binary) {
    if (!stream_ || std::filesystem::is_directory(file))
      throw InputError(fmt::format("{}: {}", name_, why_unreadable(file)));
  }

  /// Reads the next line, without its end (LF); false: there is none. The line is valid until the
  /// next call. @throws InputError for a line longer than limits::kMaxTableLine.
  bool next(std::string_view& line) {
    for (std::size_t searched = begin_;;) {
      const std::size_t end = buffer_.find('\n', searched);
      if (end != std::string::npos || (ended_ && begin_ < buffer_.size())) {
        const std::size_t stop = std::min(end, buffer_.size());
        line = std::string_view(buffer_).substr(begin_, stop - begin_);
        begin_ = std::min(stop + 1, buffer_.size());
        ++number_;
        return true;
      }
      if (ended_) return false;
      buffer_.erase(0, begin_);
      begin_ = 0;
      searched = buffer_.size();
      if (searched > limits::kMaxTableLine)
        throw InputError(fmt::format("{}:{}: a line of more than {} MB; is it a {} file?", name_,
                                     number_ + 1, limits::kMaxTableLine / 1'000'000, kind_));
      fill();
    }
  }
  int number() const { return number_; }

 private:
  void fill() {
    const std::size_t old = buffer_.size();
    buffer_.resize(old + (1 << 18));
    stream_.read(buffer_.data() + old, 1 << 18);
    buffer_.resize(old + static_cast<std::size_t>(stream_.gcount()));
    ended_ = !stream_;
    if (stream_.bad()) throw InputError(fmt::format("{}: the file cannot be read", name_));
  }

  std::string name_, kind_;
  std::ifstream stream_;
  std::string buffer_;
  std::size_t begin_ = 0;
  int number_ = 0;  ///< number of the last line read
  bool ended_ = false;
};

}  // namespace counterpoint
