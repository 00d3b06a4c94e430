// Skeletons of motion capture and animation in BVH format (Biovision hierarchical data): a tree of
// joints with their offsets, then one line of channel values a frame. The columns are the places
// and orientations of the joints that forward kinematics gives (Meredith and Maddock, "Motion
// Capture File Formats Explained", 2001).
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "counterpoint/engine/io/line_reader.h"
#include "counterpoint/engine/io/table_format.h"

namespace counterpoint {
namespace {

/// A channel sets the position along an axis (0 to 2), or turns about one (3 to 5).
constexpr std::array<std::string_view, 6> kChannels = {"Xposition", "Yposition", "Zposition",
                                                       "Xrotation", "Yrotation", "Zrotation"};
constexpr std::size_t kMaxJoints = kMaxColumns / 7;  ///< a joint has seven columns

struct BvhJoint {
  std::string name;
  int parent = -1;
  bool is_end = false;  ///< an End Site: a place without axes of its own
  bool has_offset = false, has_channels = false;
  Vector3 offset = Vector3::Zero();
  std::vector<int> channels;
  int line = 0, ends = 0;  ///< ends: number of its End Sites
};

class BvhSource final : public TableSource {
 public:
  BvhSource(const std::filesystem::path& file, bool any_unit)
      : file_(file.string()), lines_(file, "BVH") {
    if (!any_unit)
      throw InputError(
          fmt::format("{}: the unit of length is not in BVH files; only `retarget` reads them, "
                      "whose problem has the keys 'unit' and 'axes'",
                      file_));
    read_skeleton();
    read_clock();
    columns_.emplace_back("time");
    for (const BvhJoint& joint : joints_) {
      for (const char* row : {".x", ".y", ".z"}) columns_.emplace_back(joint.name + row);
      if (joint.is_end) continue;
      for (const char* row : {".qw", ".qx", ".qy", ".qz"}) columns_.emplace_back(joint.name + row);
    }
    position_.resize(joints_.size());
    orientation_.resize(joints_.size());
  }

  bool read(TableBlock& block) override {
    const int rows = rows_of_block(columns_.size());
    for (; block.rows < rows && read_ < count_; ++block.rows, ++read_) {
      if (!next_line()) fail(fmt::format("the file ends after {} of {} frames", read_, count_), 1);
      append_frame(block);
      block.lines.push_back(lines_.number());
    }
    if (read_ == count_ && next_line())
      fail(fmt::format("a line after the last of {} frames ('Frames:')", count_));
    return block.rows > 0;
  }

 private:
  [[noreturn]] void fail(const std::string& what, int lines_on = 0) const {
    throw InputError(fmt::format("{}:{}: {}", file_, lines_.number() + lines_on, what));
  }

  /// The first letters of a text, for messages.
  static std::string_view shown(std::string_view text) { return text.substr(0, 80); }

  /// Splits the next line that is not blank into its words; false: there is none.
  bool next_line() {
    words_.clear();
    while (words_.empty() && lines_.next(line_)) {
      line_ = trimmed(line_, kBlank);
      for (std::string_view rest = line_; !rest.empty();) {
        const std::size_t end = std::min(rest.find_first_of(kBlank), rest.size());
        words_.push_back(rest.substr(0, end));
        rest = trimmed(rest.substr(end), kBlank);
      }
    }
    return !words_.empty();
  }

  void need_line(const char* what) {
    if (!next_line()) fail(fmt::format("the file ends; expected {}", what), 1);
  }

  double number(std::string_view text, const char* what) const {
    const std::optional<double> x = parse_number(text);
    if (!x || !(std::abs(*x) <= limits::kMaxLength))
      fail(fmt::format("{} '{}'; expected a number of at most {:g}", what, shown(text),
                       limits::kMaxLength));
    return *x;
  }

  void read_skeleton() {
    need_line("HIERARCHY");
    if (line_ != "HIERARCHY") fail(fmt::format("'{}'; expected HIERARCHY", shown(line_)));
    std::vector<int> open;  // the joints around the current line, from the root
    for (need_line("ROOT"); line_ != "MOTION"; need_line("MOTION")) {
      const std::string_view key = words_[0];
      if (key == "ROOT" || key == "JOINT" || key == "End") {
        begin_joint(open);
      } else if (open.empty()) {
        fail(fmt::format("'{}' outside of a joint; expected ROOT or MOTION", shown(key)));
      } else if (key == "OFFSET") {
        read_offset(joint(open.back()));
      } else if (key == "CHANNELS") {
        read_channels(joint(open.back()));
      } else if (line_ == "}") {
        end_joint(joint(open.back()));
        open.pop_back();
      } else {
        fail(fmt::format("'{}'; expected OFFSET, CHANNELS, JOINT, End Site or }}", shown(key)));
      }
    }
    if (!open.empty()) fail(fmt::format("MOTION; expected }} of '{}'", joint(open.back()).name));
    if (joints_.empty()) fail("MOTION; expected ROOT before it");
    if (values_ == 0) fail("MOTION; expected joints that have channels");
  }

  BvhJoint& joint(int index) { return joints_[static_cast<std::size_t>(index)]; }

  /// Begins a joint at the line with its name and, there or in the next line, a brace.
  void begin_joint(std::vector<int>& open) {
    if ((words_[0] == "ROOT") != open.empty())
      fail(fmt::format("{}; expected ROOT outside of all joints, JOINT and End Site within one",
                       words_[0]));
    BvhJoint next;
    next.is_end = words_[0] == "End";
    next.line = lines_.number();
    next.parent = open.empty() ? -1 : open.back();
    std::string_view name = trimmed(line_.substr(words_[0].size()), kBlank);
    const bool brace = name.ends_with('{');
    if (brace) name = trimmed(name.substr(0, name.size() - 1), kBlank);
    if (name.empty() || (next.is_end && name != "Site"))
      fail(fmt::format("'{}'; expected {}", shown(line_),
                       next.is_end ? "End Site" : "the joint's name after it"));
    next.name = next.is_end ? name_of_end(joint(next.parent)) : std::string(name);
    if (next.parent >= 0) check_parent(joint(next.parent));
    if (!names_.insert(next.name).second)
      fail(fmt::format("a second '{}'; expected another name", next.name));
    if (joints_.size() == kMaxJoints) fail(fmt::format("more than {} joints", kMaxJoints));
    open.push_back(static_cast<int>(joints_.size()));
    joints_.push_back(std::move(next));
    if (brace) return;
    need_line("{");
    if (line_ != "{") fail(fmt::format("'{}'; expected {{", shown(line_)));
  }

  /// Returns JOINT.end, or JOINT.end_2 and so on for further ones of the joint.
  static std::string name_of_end(BvhJoint& of) {
    ++of.ends;
    return of.ends == 1 ? of.name + ".end" : fmt::format("{}.end_{}", of.name, of.ends);
  }

  void check_parent(const BvhJoint& parent) const {
    if (parent.is_end) fail("a joint within an End Site");
    if (!parent.has_offset || !parent.has_channels)
      fail(fmt::format("expected OFFSET and CHANNELS of '{}' before the joints within it",
                       parent.name));
  }

  void read_offset(BvhJoint& at) {
    if (at.has_offset) fail(fmt::format("a second OFFSET of '{}'", at.name));
    if (words_.size() != 4)
      fail(fmt::format("'{}'; expected OFFSET and three numbers", shown(line_)));
    for (int i = 0; i < 3; ++i)
      at.offset[i] = number(words_[static_cast<std::size_t>(i) + 1], "OFFSET");
    at.has_offset = true;
  }

  void read_channels(BvhJoint& at) {
    if (at.is_end || at.has_channels)
      fail(at.is_end ? "CHANNELS of an End Site, which has none"
                     : fmt::format("second CHANNELS of '{}'", at.name));
    const std::optional<double> count =
        words_.size() > 1 ? parse_number(words_[1]) : std::optional<double>();
    if (!count || *count != static_cast<double>(words_.size() - 2))
      fail(fmt::format("'{}'; expected CHANNELS, their number and so many names", shown(line_)));
    for (std::size_t i = 2; i < words_.size(); ++i) {
      const auto known = std::find(kChannels.begin(), kChannels.end(), words_[i]);
      if (known == kChannels.end())
        fail(fmt::format("channel '{}'; expected one of {}", shown(words_[i]),
                         fmt::join(kChannels, ", ")));
      const auto channel = static_cast<int>(known - kChannels.begin());
      if (std::count(at.channels.begin(), at.channels.end(), channel) > 0)
        fail(fmt::format("a second channel {} of '{}'", words_[i], at.name));
      at.channels.push_back(channel);
    }
    at.has_channels = true;
    values_ += at.channels.size();
  }

  void end_joint(const BvhJoint& at) const {
    if (!at.has_offset || (!at.is_end && !at.has_channels))
      fail(fmt::format("}} of '{}' (line {}); expected {} before it", at.name, at.line,
                       at.has_offset ? "CHANNELS" : "OFFSET"));
  }

  /// Returns the text of the next line after `key`.
  std::string_view value_of(const char* key) {
    need_line(key);
    if (!line_.starts_with(key)) fail(fmt::format("'{}'; expected {} ...", shown(line_), key));
    return trimmed(line_.substr(std::string_view(key).size()), kBlank);
  }

  void read_clock() {
    const std::string_view count = value_of("Frames:");
    const double frames = number(count, "Frames:");
    if (!(frames >= 1.0) || frames != std::floor(frames))
      fail(fmt::format("Frames: '{}'; expected a whole number from 1 on", shown(count)));
    count_ = static_cast<long>(frames);
    frame_time_ = number(value_of("Frame Time:"), "Frame Time:");
    if (!(frame_time_ > 0.0)) fail("Frame Time: expected a time above 0 [s]");
  }

  void append_frame(TableBlock& block) {
    if (words_.size() != values_)
      fail(fmt::format("{} values; the channels of all joints are {}", words_.size(), values_));
    block.numbers.push_back(static_cast<double>(read_) * frame_time_);
    std::size_t next = 0;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      place(i, next);
      for (int k = 0; k < 3; ++k) block.numbers.push_back(position_[i][k]);
      const Quaternion& q = orientation_[i];
      if (!joints_[i].is_end)
        block.numbers.insert(block.numbers.end(), {q.w(), q.x(), q.y(), q.z()});
    }
  }

  /// Finds place and orientation of a joint from those of its parent and the values of its
  /// channels, which begin at `next`. A position replaces that coordinate of the offset; rotations
  /// [degrees] follow one another about axes that turn with the joint.
  void place(std::size_t i, std::size_t& next) {
    const BvhJoint& at = joints_[i];
    Vector3 offset = at.offset;
    Quaternion turn = Quaternion::Identity();
    for (const int channel : at.channels) {
      const double x = number(words_[next++], "channel value");
      if (channel < 3)
        offset[channel] = x;
      else
        turn = turn * Quaternion(Eigen::AngleAxisd(x * std::numbers::pi / 180.0,
                                                   Vector3::Unit(channel - 3)));
    }
    check_place(at, offset);
    if (at.parent < 0) {
      position_[i] = offset;
      orientation_[i] = turn.normalized();
      return;
    }
    const auto parent = static_cast<std::size_t>(at.parent);
    position_[i] = position_[parent] + orientation_[parent] * offset;
    orientation_[i] = (orientation_[parent] * turn).normalized();
  }

  /// Refuses positions that count from the offset, as some programs write them.
  void check_place(const BvhJoint& at, const Vector3& offset) const {
    if (at.parent >= 0 && offset.isZero(0.0) && !at.offset.isZero(0.0))
      fail(
          fmt::format("position 0 0 0 of '{}', though its OFFSET is not; expected positions that "
                      "contain the offset: leave them out of the export",
                      at.name));
  }

  static constexpr std::string_view kBlank = " \t\r";

  std::string file_;
  LineReader lines_;
  std::string_view line_;                ///< current line without blanks at its ends
  std::vector<std::string_view> words_;  ///< its words, valid until the next line
  std::vector<BvhJoint> joints_;         ///< parents before their children, as in the file
  std::set<std::string> names_;
  std::size_t values_ = 0;  ///< channels of all joints
  long count_ = 0, read_ = 0;
  double frame_time_ = 0.0;        ///< [s]
  std::vector<Vector3> position_;  ///< places in the current frame, in the file's unit
  std::vector<Quaternion> orientation_;
};

}  // namespace

std::unique_ptr<TableSource> open_bvh(const std::filesystem::path& file,
                                      const TableOptions& options) {
  return std::make_unique<BvhSource>(file, options.any_unit);
}

}  // namespace counterpoint
