// Servo targets and wrenches on links as columns of a CSV file (docs/reference/trajectory-format.md).
//
//   J.target, J.target_velocity    of the servo of joint J
//   L.fx L.fy L.fz L.tx L.ty L.tz  on link L, about its origin, in world axes. Of a link that hangs
//                                  on a planar, spherical or floating joint: L.wrench.fx ..., since
//                                  L.fx ... are the applied forces of that joint
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/io/table.h"
#include "counterpoint/engine/state.h"

namespace counterpoint {

/// Which of these columns there are: none or all servos, and links. One moment is a vector of as
/// many values as names().
struct InputColumns {
  bool targets = false;
  std::vector<int> links;  ///< indices into Model::frames, rising

  bool empty() const { return !targets && links.empty(); }
  std::vector<std::string> names(const Model& model) const;
  /// Sets targets and wrenches of `input`: of servos if there are columns, wrenches in any case.
  void set(const Model& model, const VectorRef& values, Input& input) const;
  /// The reverse. input.wrenches must be as `set` leaves them; the model's targets where it has
  /// none.
  VectorX values(const Model& model, const Input& input) const;
};

/// Is it the name of such a column? Links fixed to the world have none.
bool is_input_column(const Model& model, const std::string& name);

/// The columns of a table. A link is in if one of its six is there.
InputColumns find_input_columns(const Table& table, const Model& model);

/// As many rows as names, `steps` columns, of the first `steps` rows of the table. What is not in
/// the table is the model's target, or zero. @throws InputError where a cell is empty, but in the
/// last row of the table, where that means the same.
MatrixX read_input_columns(const InputColumns& columns, const Table& table, const Model& model,
                           int steps);

}  // namespace counterpoint
