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
  const std::map<std::filesystem::path, std::shared_ptr<const Table>>& tables() const {
    return tables_;
  }

 private:
  std::filesystem::path folder_;
  std::map<std::filesystem::path, std::shared_ptr<const Table>> tables_;
};

}  // namespace counterpoint::optimization
