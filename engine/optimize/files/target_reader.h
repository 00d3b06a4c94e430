// Targets of terms from the columns of a table. Internal header.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "counterpoint/engine/optimize/reference.h"
#include "counterpoint/engine/tables.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::optimization {

/// Reads start, rate and loop of a replay; the start is the first of these times by default.
Playback read_playback(const YamlValue& in, const std::vector<double>& time);

/// Returns the column `time`. @throws InputError at `in` unless it rises from row to row.
std::vector<double> rising_time(const YamlValue& in, const Table& table);

/// Normalizes the quaternions w x y z in rows first ... first + 3, one a column; NaN stays.
/// @throws InputError at `in` if one has not nearly the length 1.
void normalize_quaternions(const YamlValue& in, const Table& table, Eigen::Index first,
                           MatrixX& values);

/// Reads the targets of a problem file; each table is read once.
class TargetReader {
 public:
  /// folder: paths in the file are relative to it.
  explicit TargetReader(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// True for a target {file: ...}.
  static bool is_from_file(const YamlValue& target) { return target.has("file"); }
  /// Reads the reference of a term, whose quantity and weight are known. start (nq): values of
  /// configurations without a column. link: rotation from the axes of the term's link to those of
  /// its body.
  std::shared_ptr<const Reference> read(const YamlValue& target, const Model& model,
                                        const Term& term, const VectorX& start,
                                        const Matrix3& link);
  /// Reads in which frames a column of flags, {file, column, is, start}, has the value `is`: one
  /// entry per frame, from the last row at or before its time.
  std::vector<char> flags(const YamlValue& in, const Problem& problem);
  /// Reads configurations of a model from a table, with the map `columns` of `in`, if it has one.
  Samples configurations(const YamlValue& in, const std::filesystem::path& file,
                         const Model& model);
  const std::map<std::filesystem::path, std::shared_ptr<const Table>>& tables() const {
    return tables_;
  }

 private:
  const Table& table(const std::filesystem::path& file);

  std::filesystem::path folder_;
  std::map<std::filesystem::path, std::shared_ptr<const Table>> tables_;
};

}  // namespace counterpoint::optimization
