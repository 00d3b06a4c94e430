// The table of contact forces that `inverse --contacts` and `simulate --contacts` write.
#pragma once

#include <string>

#include "counterpoint/engine/step.h"
#include "counterpoint/engine/tables.h"

namespace counterpoint::apps {

/// One row per contact and step: time [s], the two geometries, point [m], normal, gap [m], force on
/// geometry_b [N], slip; columns as in docs/reference/trajectory-format.md.
class ContactTable {
 public:
  /// @throws InputError if the file cannot be written.
  ContactTable(const std::string& file, const Model& model);
  /// Adds the contacts of the step that began at `time` [s].
  void add_step(double time, const Inverse& forces);
  void finish() { writer_.finish(); }

 private:
  TableWriter writer_;
};

}  // namespace counterpoint::apps
