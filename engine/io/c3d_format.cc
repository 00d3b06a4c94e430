// Motion capture in C3D format (c3d.org): a header, parameters, then one frame after the other,
// each with its points and the samples of its analog channels. Rotations (group ROTATION) are not
// read.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "counterpoint/engine/io/c3d_parameters.h"
#include "counterpoint/engine/io/marker_columns.h"
#include "counterpoint/engine/io/table_format.h"
#include "counterpoint/model/spatial.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

// Block size [bytes]: the header has one block, other parts start at a block.
constexpr std::size_t kC3dBlock = 512;
constexpr double kEmpty = std::numeric_limits<double>::quiet_NaN();
/// Parameters that list points which are outputs of a model in their own units, not positions.
constexpr const char* kModelOutputs[] = {"POINT:ANGLES", "POINT:FORCES",  "POINT:MOMENTS",
                                         "POINT:POWERS", "POINT:SCALARS", "POINT:REACTIONS"};

/// Number of the first frame, and number of frames; a count in a header may exceed the file.
struct C3dFrames {
  double first = 0.0, count = 0.0;
};

/// Calibration: the value of an analog sample x is (x - offset) scale.
struct AnalogChannel {
  double offset = 0.0, scale = 1.0;
};

class C3dSource final : public TableSource {
 public:
  explicit C3dSource(const std::filesystem::path& file)
      : file_(file.string()), stream_(file, std::ios::binary) {
    std::error_code error;
    size_ = std::filesystem::file_size(file, error);
    if (error || !stream_) throw InputError(fmt::format("{}: {}", file_, why_unreadable(file)));
    const std::string header = bytes(0, kC3dBlock, "the header");
    const auto parameter_block = static_cast<unsigned char>(header[0]);
    if (header[1] != 0x50 || parameter_block == 0)
      throw InputError(
          fmt::format("{}: no C3D file, though its name ends like that of one", file_));
    const std::size_t start = (parameter_block - 1u) * kC3dBlock;
    read_processor(bytes(start, 4, "the parameters")[3], start + 3);
    data_ = word(header, 16) * kC3dBlock - kC3dBlock;
    if (word(header, 16) == 0 || data_ <= start)
      fail(16, fmt::format("the data begin at block {}; expected a block after the parameters, "
                           "which begin at block {}",
                           word(header, 16), static_cast<int>(parameter_block)));
    const C3dParameters parameters(bytes(0, data_, "header and parameters"), start, processor_,
                                   file_);
    read_layout(header, parameters);
    read_rate(header, parameters);
    frames_ = find_frames(header, parameters);
    columns_ = {"frame", "time"};
    name_points(parameters);
    name_channels(parameters);
  }

  bool read(TableBlock& block) override {
    const double left = frames_.count - read_;
    const double wanted = rows_of_block(std::max(columns_.size(), frame_bytes_ / 8));
    const auto rows = static_cast<std::size_t>(std::min(left, wanted));
    const auto begin = data_ + static_cast<std::uint64_t>(read_) * frame_bytes_;
    const std::string frames = bytes(begin, rows * frame_bytes_, "frames");
    for (std::size_t row = 0; row < rows; ++row, read_ += 1.0) {
      block.numbers.push_back(frames_.first + read_);
      block.numbers.push_back(read_ / rate_);
      const std::string_view frame =
          std::string_view(frames).substr(row * frame_bytes_, frame_bytes_);
      for (std::size_t i = 0; i < units_.size(); ++i) append_point(frame, i, block);
      for (std::size_t i = 0; i < channels_.size(); ++i) append_channel(frame, i, block);
    }
    block.rows = static_cast<int>(rows);
    return rows > 0;
  }

 private:
  [[noreturn]] void fail(std::uint64_t position, const std::string& what) const {
    throw InputError(fmt::format("{}: byte {}: {}", file_, position, what));
  }

  std::string bytes(std::uint64_t begin, std::size_t count, const char* what) {
    if (begin + count > size_)
      fail(begin,
           fmt::format("expected {} of {} bytes; the file ends at byte {}", what, count, size_));
    std::string all(count, '\0');
    stream_.seekg(static_cast<std::streamoff>(begin));
    stream_.read(all.data(), static_cast<std::streamsize>(count));
    if (!stream_) fail(begin, fmt::format("{} bytes cannot be read", count));
    return all;
  }

  void read_processor(char byte, std::size_t position) {
    const auto kind = static_cast<unsigned char>(byte);
    if (kind < 84 || kind > 86)
      fail(position, fmt::format("processor type {}; expected 84 (Intel), 85 (DEC) or 86 (MIPS)",
                                 static_cast<int>(kind)));
    processor_ = static_cast<C3dProcessor>(kind);
  }

  std::uint16_t word(std::string_view from, std::size_t position) const {
    return c3d_word(processor_, from, position);
  }

  /// Reads the number of points and samples in a frame, and their types.
  void read_layout(const std::string& header, const C3dParameters& parameters) {
    units_.resize(word(header, 2));
    const std::size_t samples = word(header, 4);  // samples of all channels in a frame
    scale_ = c3d_real(processor_, header, 12);
    if (const auto scale = parameters.number("POINT:SCALE")) scale_ = *scale;
    if (!std::isfinite(scale_) || scale_ == 0.0)
      fail(12, fmt::format("a scale of {}; expected a positive one of integers, or a negative one "
                           "where points are reals",
                           scale_));
    value_bytes_ = scale_ < 0.0 ? 4 : 2;
    frame_bytes_ = (4 * units_.size() + samples) * value_bytes_;
    if (frame_bytes_ == 0) fail(2, "neither points nor analog samples (rotations are not read)");
    check_count(parameters, "POINT:USED", units_.size(), 2);
    if (samples == 0) return;
    const double used =
        unsigned_number(parameters, "ANALOG:USED")
            .value_or(static_cast<double>(samples) / std::max<double>(1.0, word(header, 18)));
    if (used < 1.0 || used != std::floor(used) ||
        std::fmod(static_cast<double>(samples), used) != 0.0)
      fail(4, fmt::format("{} analog samples a frame; expected as many of each of the {} channels "
                          "(ANALOG:USED)",
                          samples, used));
    channels_.resize(static_cast<std::size_t>(used));
    samples_ = samples / channels_.size();
  }

  /// Returns a parameter that is an unsigned 16-bit integer.
  static std::optional<double> unsigned_number(const C3dParameters& parameters, const char* name) {
    const std::optional<double> x = parameters.number(name);
    return x && *x < 0.0 ? *x + 65536.0 : x;
  }

  void check_count(const C3dParameters& parameters, const char* name, std::size_t count,
                   std::uint64_t position) const {
    const std::optional<double> used = unsigned_number(parameters, name);
    if (used && *used != static_cast<double>(count))
      fail(position, fmt::format("the header says {}, {} says {}; expected the same: save the file "
                                 "anew with the program that made it",
                                 count, name, *used));
  }

  void read_rate(const std::string& header, const C3dParameters& parameters) {
    rate_ = parameters.number("POINT:RATE").value_or(0.0);
    if (rate_ <= 0.0) rate_ = c3d_real(processor_, header, 20);
    if (!(rate_ > 0.0 && rate_ < 1e9) || 1.0 / rate_ > 1e9)
      fail(20, fmt::format("{} frames a second (POINT:RATE); expected a positive rate", rate_));
  }

  /// Finds the frames of the file. The header counts only to 65535, and several parameters may
  /// extend it: returns the largest count that one of them gives and the file can hold.
  C3dFrames find_frames(const std::string& header, const C3dParameters& parameters) const {
    const auto whole = (size_ - data_) / frame_bytes_;
    const auto held = static_cast<double>(whole);
    const double first = word(header, 6), last = word(header, 8);
    std::vector<C3dFrames> said{{first, last - first + 1.0}};
    const std::optional<double> begin = trial_field(parameters, "TRIAL:ACTUAL_START_FIELD");
    const std::optional<double> end = trial_field(parameters, "TRIAL:ACTUAL_END_FIELD");
    if (begin && end) said.push_back({*begin, *end - *begin + 1.0});
    for (const char* name : {"POINT:LONG_FRAMES", "POINT:FRAMES"})
      said.push_back({first, std::floor(parameters.number(name).value_or(0.0))});
    if (last == 65535.0) extend(said, held);
    C3dFrames best;
    for (const C3dFrames& frames : said)
      if (frames.count <= held && frames.count > best.count) best = frames;
    if (best.count >= 1.0) return best;
    if (!(said[0].count >= 1.0)) fail(6, fmt::format("frames {} to {}", first, last));
    fail(data_, fmt::format("expected frames {} to {} of {} bytes each; the file ends at byte {}, "
                            "after {}",
                            first, last, frame_bytes_, size_, held));
  }

  /// Replaces the count of a header at its limit by that of the parameters, or else of the whole
  /// file.
  void extend(std::vector<C3dFrames>& said, double held) const {
    const double count = said[0].count;
    if (std::any_of(said.begin(), said.end(), [&](const auto& s) { return s.count > count; }))
      said[0].count = 0.0;
    else if ((held - count) * static_cast<double>(frame_bytes_) >= kC3dBlock)  // more than padding
      said[0].count = held;
  }

  /// Returns a frame number stored as two 16-bit words, the lower one first.
  static std::optional<double> trial_field(const C3dParameters& parameters, const char* name) {
    const std::vector<double> words = parameters.numbers(name);
    if (words.size() < 2) return std::nullopt;
    const auto positive = [](double x) { return x < 0.0 ? x + 65536.0 : x; };
    return positive(words[0]) + 65536.0 * positive(words[1]);
  }

  void name_points(const C3dParameters& parameters) {
    UniqueNames names;
    std::set<std::string> outputs;
    for (const char* kind : kModelOutputs)
      for (std::string& label : parameters.texts(kind)) outputs.insert(std::move(label));
    const std::vector<std::string> labels = parameters.texts("POINT:LABELS");
    const std::vector<std::string> units = parameters.texts("POINT:UNITS");
    for (std::size_t i = 0; i < units_.size(); ++i) {
      const std::string label = i < labels.size() ? labels[i] : "";
      units_[i] = outputs.count(label) > 0 ? 0.0 : per_metre(units, i);
      const std::string name = names.take(label.empty() ? fmt::format("marker{}", i + 1) : label);
      for (const char* axis : {".x", ".y", ".z"}) columns_.emplace_back(name + axis);
    }
  }

  /// Returns the units per metre of a point. A single unit applies to all points, as does the first
  /// one to points without their own.
  double per_metre(const std::vector<std::string>& units, std::size_t point) const {
    const std::string unit = units.empty() ? "" : point < units.size() ? units[point] : units[0];
    if (const std::optional<double> number = units_per_metre(unit)) return *number;
    throw InputError(
        fmt::format("{}: POINT:UNITS '{}' of point {}; expected mm, cm or m: correct it "
                    "with the program that made the file",
                    file_, unit, point + 1));
  }

  void name_channels(const C3dParameters& parameters) {
    const std::vector<std::string> labels = parameters.texts("ANALOG:LABELS");
    const std::vector<double> scales = parameters.numbers("ANALOG:SCALE");
    const std::vector<double> offsets = parameters.numbers("ANALOG:OFFSET");
    const std::vector<std::string> format = parameters.texts("ANALOG:FORMAT");
    unsigned_ = !format.empty() && format[0] == "UNSIGNED";
    const double all = parameters.number("ANALOG:GEN_SCALE").value_or(1.0);
    UniqueNames names;
    for (const Column& column : columns_) names.take(column.name);
    const UniqueNames others = names;
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      std::string name = i < labels.size() ? labels[i] : "";
      if (name.empty()) name = fmt::format("channel{}", i + 1);
      if (others.has(name)) name = fmt::format("analog.{}", name);
      columns_.emplace_back(names.take(name));
      channels_[i].scale = all * (i < scales.size() ? scales[i] : 1.0);
      if (i < offsets.size()) channels_[i].offset = offsets[i];
      if (unsigned_ && channels_[i].offset < 0.0) channels_[i].offset += 65536.0;
    }
  }

  /// Returns the value at an index among the values of a frame.
  double value(std::string_view frame, std::size_t index) const {
    const std::size_t position = index * value_bytes_;
    if (value_bytes_ == 4) return c3d_real(processor_, frame, position);
    return static_cast<std::int16_t>(word(frame, position));
  }

  /// Appends a point; empty if it was not seen: its fourth value is negative, or all coordinates
  /// are exactly zero.
  void append_point(std::string_view frame, std::size_t point, TableBlock& block) const {
    const bool is_position = units_[point] > 0.0;
    const double scale = value_bytes_ == 4 ? 1.0 : scale_;
    double x[3];
    bool seen = !(value(frame, 4 * point + 3) < 0.0), zero = is_position;
    for (std::size_t i = 0; i < 3; ++i) {
      x[i] = value(frame, 4 * point + i) * scale;
      if (is_position) x[i] /= units_[point];
      seen = seen && std::isfinite(x[i]);
      zero = zero && x[i] == 0.0;
    }
    for (const double coordinate : x) block.numbers.push_back(seen && !zero ? coordinate : kEmpty);
  }

  /// Appends the mean of a channel over the frame's samples.
  void append_channel(std::string_view frame, std::size_t channel, TableBlock& block) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < samples_; ++i) {
      double x = value(frame, 4 * units_.size() + i * channels_.size() + channel);
      if (unsigned_ && value_bytes_ == 2 && x < 0.0) x += 65536.0;
      sum += x;
    }
    const auto [offset, scale] = channels_[channel];
    const double mean = (sum / static_cast<double>(samples_) - offset) * scale;
    block.numbers.push_back(std::isfinite(mean) ? mean : kEmpty);
  }

  std::string file_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, data_ = 0;  ///< size of the file; start of the frames [bytes]
  C3dProcessor processor_ = C3dProcessor::kIntel;
  double scale_ = 0.0, rate_ = 0.0;  ///< scale of points; frames per second [Hz]
  /// samples_: samples of a channel per frame.
  std::size_t value_bytes_ = 0, frame_bytes_ = 0, samples_ = 0;
  bool unsigned_ = false;  ///< integer samples are unsigned
  C3dFrames frames_;
  double read_ = 0.0;  ///< frames read so far
  /// Units per metre of each point; 0 if it is not a position.
  std::vector<double> units_;
  std::vector<AnalogChannel> channels_;
};

}  // namespace

std::unique_ptr<TableSource> open_c3d(const std::filesystem::path& file, const TableOptions&) {
  return std::make_unique<C3dSource>(file);
}

}  // namespace counterpoint
