// Maps columns of numbers to the inputs of steps: "elbow.u", "elbow.target", "hand.fx", as in CSV
// files.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/trajectory.h"
#include "handles.h"

namespace counterpoint::python {

class InputMap {
 public:
  /// Without names the columns are the applied forces (nv), in their order. @throws py::key_error.
  InputMap(const ModelHandle& model, const std::vector<std::string>& names);

  /// Number of columns.
  int size() const { return size_; }
  /// The columns that a trajectory needs in addition to the applied forces.
  const InputColumns& columns() const { return columns_; }

  /// Scratch memory of a thread.
  struct Values {
    VectorX known;  ///< in the order of columns_.names()
  };
  Values start(const Model& model) const { return {columns_.values(model, Input())}; }
  /// Sets the forces, targets and wrenches that have columns; other forces and targets stay, other
  /// wrenches do not.
  void apply(const Model& model, const double* row, Values& values, Input& input) const;

 private:
  struct Place {
    bool force;
    int index;
  };
  int size_ = 0;
  bool plain_ = false;  ///< the row is the applied force itself
  InputColumns columns_;
  std::vector<Place> places_;
};

/// Inputs of the steps of several motions: inputs[motion, step, column].
class InputTable {
 public:
  /// @param inputs None, (steps, nu) for all motions, or (motions, steps, nu)
  /// @param steps expected number of steps, or -1 to take that of `inputs`
  InputTable(const py::object& inputs, int motions, py::ssize_t steps, const InputMap& map);
  py::ssize_t steps() const { return steps_; }
  /// Returns a row, or nullptr if no inputs were given.
  const double* row(int motion, py::ssize_t step) const {
    return data_ == nullptr ? nullptr : data_ + (motion * motion_stride_ + step) * size_;
  }

 private:
  Array array_;  ///< keeps the data alive
  const double* data_ = nullptr;
  py::ssize_t motion_stride_ = 0, steps_ = 0, size_ = 0;
};

}  // namespace counterpoint::python
