#include "tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace counterpoint::apps {
namespace {

void print(const PeerRow& row) {
  const std::string time =
      std::isfinite(row.seconds)
          ? fmt::format("{:10.3f} us   ours / this {:5.2f}", 1e6 * row.seconds, row.ratio)
          : std::string(32, ' ');
  const std::string iterations =
      std::isfinite(row.iterations) ? fmt::format("{:6.2f} iterations   ", row.iterations) : "";
  fmt::print("{:26} nv {:4} {:10} {:17} {}   {}{} {:.2g} {}\n", row.scene, row.nv, row.quantity,
             row.engine, time, iterations, row.quality, row.error, row.remark);
  std::fflush(stdout);
}

}  // namespace

std::ofstream open_metrics(const std::filesystem::path& file, std::ios::openmode mode) {
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path());
  std::ofstream out(file, mode);
  if (!out) throw std::runtime_error(file.string() + ": cannot be written");
  return out;
}

void PeerTable::add(const PeerRow& row) {
  print(row);
  rows_.push_back(row);
  if (csv_.empty()) return;
  const bool first = rows_.size() == 1;
  std::string remark = row.remark;
  std::replace(remark.begin(), remark.end(), ',', ';');
  std::ofstream out = open_metrics(csv_, first ? std::ios::trunc : std::ios::app);
  if (first)
    out << "table,scene,nv,quantity,engine,microseconds,ours_over_this,quality,error,iterations,"
           "remark\n";
  out << fmt::format("{},{},{},{},{},{:.6g},{:.4g},{},{:.3g},{:.4g},{}\n", row.table, row.scene,
                     row.nv, row.quantity, row.engine, 1e6 * row.seconds, row.ratio, row.quality,
                     row.error, row.iterations, remark);
  if (!out.flush()) throw std::runtime_error(csv_.string() + ": cannot be written");
}

}  // namespace counterpoint::apps
