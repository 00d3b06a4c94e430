#include "recordings/motion_follow.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <thread>

#include "command_line/interrupt.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "recordings/motion_tables.h"

namespace counterpoint::apps {
namespace {

using estimation::MotionEstimate;
using estimation::Recording;

/// Interval between two attempts to read more of a growing file.
constexpr std::chrono::milliseconds kLook(5);

/// A temporary file of this process, removed at the end.
class Scratch {
 public:
  Scratch()
      : file_((std::filesystem::temp_directory_path() /
               fmt::format("counterpoint_follow_{}.csv", ::getpid()))
                  .string()) {}
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
  }
  const std::string& file() const { return file_; }

  void write(const std::string& text) const {
    std::ofstream out(file_, std::ios::trunc);
    out << text;
    if (!out.flush()) throw std::runtime_error(file_ + ": cannot be written");
  }
  std::vector<std::string> lines() const {
    std::ifstream in(file_);
    std::vector<std::string> out;
    for (std::string line; std::getline(in, line);) out.push_back(line);
    return out;
  }

 private:
  std::string file_;
};

/// Reads whole lines from an input that may still grow.
class LineSource {
 public:
  LineSource(const std::string& file, double idle) : file_(file), idle_(idle) {
    if (file == "-") return;
    in_.open(file);
    if (!in_) throw InputError(file + ": cannot be read");
  }

  /// Reads the next line; returns false at the end of the input or after Ctrl-C.
  bool next(std::string& line) {
    line.clear();
    if (file_ == "-") return !Interrupt::wanted() && std::getline(std::cin, line).good();
    const auto start = std::chrono::steady_clock::now();
    while (!Interrupt::wanted()) {
      std::string part;
      std::getline(in_, part);
      line += part;
      if (!in_.eof()) return true;
      in_.clear();
      const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - start;
      if (waited.count() > idle_) return !line.empty();
      std::this_thread::sleep_for(kLook);
    }
    return false;
  }

 private:
  std::string file_;
  double idle_;
  std::ifstream in_;
};

/// A CSV table that grows: each append() takes a table of the new rows and drops its header.
class GrowingTable {
 public:
  explicit GrowingTable(const std::string& file) : file_(file) {
    if (file.empty()) return;
    out_.open(file, std::ios::trunc);
    if (!out_) throw InputError(file + ": cannot be written");
  }
  bool wanted() const { return !file_.empty(); }

  /// Appends the lines of `rows` except the last `held`.
  void append(const Scratch& rows, std::size_t held) {
    const std::vector<std::string> lines = rows.lines();
    for (std::size_t i = begun_ ? 1 : 0; i + held < lines.size(); ++i) out_ << lines[i] << '\n';
    begun_ = true;
    if (!out_.flush()) throw std::runtime_error(file_ + ": cannot be written");
  }

 private:
  std::string file_;
  std::ofstream out_;
  bool begun_ = false;
};

/// Returns the rows from `row` on.
MotionEstimate from_row(const MotionEstimate& all, std::size_t row) {
  MotionEstimate out;
  const auto first = static_cast<Eigen::Index>(row), count = all.q.cols() - first;
  out.time.assign(all.time.begin() + first, all.time.end());
  out.q = all.q.rightCols(count);
  out.v = all.v.rightCols(count);
  out.force = all.force.rightCols(count);
  return out;
}

MotionEstimate joined(const MotionEstimate& a, const MotionEstimate& b) {
  if (a.time.empty()) return b;
  MotionEstimate out = b;
  out.time = a.time;
  out.time.insert(out.time.end(), b.time.begin(), b.time.end());
  const auto beside = [](const MatrixX& left, const MatrixX& right) {
    MatrixX both(left.rows(), left.cols() + right.cols());
    both << left, right;
    return both;
  };
  out.q = beside(a.q, b.q);
  out.v = beside(a.v, b.v);
  out.force = beside(a.force, b.force);
  return out;
}

/// The three output tables of a run.
class Tables {
 public:
  Tables(const FollowedFiles& files, const Scene& scene, const estimation::ColumnMap& map)
      : scene_(scene),
        map_(map),
        output_(files.output),
        contacts_(files.contacts),
        forces_(files.forces) {}

  void write(const MotionEstimate& rows, bool last) {
    if (rows.time.empty() && !last) return;
    if (output_.wanted()) write_motion(rows, last);
    if (rows.time.empty()) return;
    Recording none;
    none.file = rows.file;
    none.time = rows.time;
    const auto components = 3 * static_cast<Eigen::Index>(map_.contact_forces.size());
    none.contact_force = MatrixX::Constant(components, rows.q.cols(), std::nan(""));
    const std::vector<Recording> recordings{none};
    const std::vector<MotionEstimate> estimates{rows};
    const ExplainedMotions motions{scene_, map_, recordings, estimates};
    if (contacts_.wanted()) {
      write_contact_table(scratch_.file(), motions);
      contacts_.append(scratch_, 0);
    }
    if (forces_.wanted()) {
      write_force_table(scratch_.file(), motions);
      forces_.append(scratch_, 0);
    }
  }

 private:
  /// Writes the motion. The last row waits for the next one, which determines its time step.
  void write_motion(const MotionEstimate& rows, bool last) {
    waiting_ = rows.time.empty() ? waiting_ : joined(waiting_, rows);
    if (waiting_.time.empty() || (!last && waiting_.time.size() < 3)) return;
    write_motion_table(scratch_.file(), scene_.model, waiting_);
    output_.append(scratch_, last ? 0 : 1);
    waiting_ = from_row(waiting_, waiting_.time.size() - 1);
  }

  const Scene& scene_;
  const estimation::ColumnMap& map_;
  Scratch scratch_;
  GrowingTable output_, contacts_, forces_;
  MotionEstimate waiting_;
};

/// Reads rows through the column map. Each row is parsed together with the one before it, since a
/// recording must have two rows.
class RowReader {
 public:
  RowReader(const FollowedFiles& files, const Scene& scene, const estimation::ColumnMap& map)
      : name_(files.recording == "-" ? "standard input" : files.recording),
        scene_(scene),
        map_(map),
        source_(files.recording, files.idle) {
    if (!map.table.names.empty()) return;  // the map names the columns: there is no header
    if (!source_.next(header_)) throw InputError(name_ + ": a header line is expected");
    header_ += '\n';
    ++line_;
  }

  /// Reads the next row; returns false at the end.
  bool next(double& time, VectorX& q, VectorX& force) {
    if (second_) {
      second_ = false;
      return read(1, time, q, force);
    }
    std::string line;
    do {
      if (!source_.next(line)) return false;
      ++line_;
    } while (line.find_first_not_of(" \t\r") == std::string::npos);
    if (current_.empty()) {  // the first row is read together with the second
      before_ = line;
      if (!source_.next(current_)) return false;
      ++line_;
      return second_ = read(0, time, q, force);
    }
    before_.swap(current_);
    current_ = line;
    return read(1, time, q, force);
  }

 private:
  bool read(Eigen::Index row, double& time, VectorX& q, VectorX& force) {
    scratch_.write(header_ + before_ + '\n' + current_ + '\n');
    try {
      const Recording both =
          estimation::read_recordings(scratch_.file(), map_, scene_.model, scene_.q, scene_.v)
              .front();
      time = map_.rate ? static_cast<double>(rows_) / *map_.rate
                       : both.time[static_cast<std::size_t>(row)];
      q = both.q.col(row);
      force = both.applied_force.col(row);
      ++rows_;
      return true;
    } catch (const InputError& error) {
      std::string what = error.what();
      for (std::size_t at = what.find(scratch_.file()); at != std::string::npos;
           at = what.find(scratch_.file()))
        what.replace(at, scratch_.file().size(), fmt::format("{} near line {}", name_, line_));
      throw InputError(what);
    }
  }

  std::string name_;
  const Scene& scene_;
  const estimation::ColumnMap& map_;
  LineSource source_;
  Scratch scratch_;
  std::string header_, before_, current_;
  bool second_ = false;  ///< the second row was parsed with the first and comes next
  long line_ = 0, rows_ = 0;
};

}  // namespace

FollowedMetrics follow_motion(const FollowedFiles& files, const Scene& scene,
                              const estimation::ColumnMap& map,
                              const estimation::FollowOptions& options) {
  const Interrupt interrupt;
  RowReader reader(files, scene, map);
  Tables tables(files, scene, map);
  estimation::MotionFollower follower(scene, map, options);
  const VectorX weights =
      optimization::unactuated_weights(scene.model, optimization::motors_of(scene.model));
  FollowedMetrics metrics;
  long inner = 0;
  const auto take = [&](const MotionEstimate& rows, bool last) {
    tables.write(rows, last);
    metrics.told += static_cast<long>(rows.time.size());
    for (Eigen::Index t = 0; t < rows.force.cols(); ++t) {
      if (!rows.force.col(t).allFinite()) continue;
      const double largest = rows.force.col(t).cwiseProduct(weights).cwiseAbs().maxCoeff();
      metrics.unexplained_mean += largest;
      metrics.unexplained_max = std::max(metrics.unexplained_max, largest);
      ++inner;
    }
  };
  double time = 0.0;
  VectorX q, force;
  const auto push = [&] {
    ++metrics.rows;
    take(follower.push(time, q, force), false);
  };
  while (reader.next(time, q, force)) push();
  metrics.stopped = Interrupt::wanted();
  Interrupt::end();  // computing the last rows takes time: let signals end the program again
  take(follower.finish(), true);
  metrics.errors = follower.errors();
  if (inner > 0) metrics.unexplained_mean /= static_cast<double>(inner);
  return metrics;
}

}  // namespace counterpoint::apps
