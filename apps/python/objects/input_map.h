// Columns of numbers as what acts in steps: "elbow.u", "elbow.target", "hand.fx", as in CSV files.
#pragma once

#include <string>
#include <vector>

#include "counterpoint/engine/motion_files.h"
#include "handles.h"

namespace counterpoint::python {

class InputMap {
 public:
  /// No names: the applied forces, nv of them, in their order. @throws py::key_error.
  InputMap(const ModelHandle& model, const std::vector<std::string>& names);

  /// How many numbers a step takes.
  int size() const { return size_; }
  /// The columns that a trajectory needs beside the applied forces.
  const InputColumns& columns() const { return columns_; }

  /// Scratch of a thread.
  struct Values {
    VectorX known;  ///< by columns_.names()
  };
  Values start(const Model& model) const { return {columns_.values(model, Input())}; }
  /// Sets forces, targets and wrenches that there are columns for; others stay, but wrenches.
  void apply(const Model& model, const double* row, Values& values, Input& input) const;

 private:
  struct Place {
    bool force;
    int index;
  };
  int size_ = 0;
  bool plain_ = false;  ///< the row is the applied force
  InputColumns columns_;
  std::vector<Place> places_;
};

/// What acts in the steps of some motions: inputs[motion, step, column].
class InputTable {
 public:
  /// inputs: None, (steps, nu) for all, or (motions, steps, nu). steps: as many, or -1: as the
  /// inputs say.
  InputTable(const py::object& inputs, int motions, py::ssize_t steps, const InputMap& map);
  py::ssize_t steps() const { return steps_; }
  /// nullptr: nothing is given.
  const double* row(int motion, py::ssize_t step) const {
    return data_ == nullptr ? nullptr : data_ + (motion * motion_stride_ + step) * size_;
  }

 private:
  Array array_;  ///< keeps the numbers alive
  const double* data_ = nullptr;
  py::ssize_t motion_stride_ = 0, steps_ = 0, size_ = 0;
};

}  // namespace counterpoint::python
