#include "arrays.h"

#include <algorithm>
#include <cmath>

namespace counterpoint::python {
namespace {

std::string text_of(const Shape1& shape) {
  std::string text = "(";
  for (size_t i = 0; i < shape.size(); ++i)
    text += (i == 0 ? "" : ", ") + (shape[i] < 0 ? std::string("n") : std::to_string(shape[i]));
  return text + (shape.size() == 1 ? ",)" : ")");
}

Shape1 shape_of(const py::array& array) { return {array.shape(), array.shape() + array.ndim()}; }

/// @throws py::value_error unless R is a rotation matrix to 1e-6 (numbers printed with few digits).
Matrix3 checked_rotation(const Matrix3& R, const char* name) {
  if ((R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff() < 1e-6 &&
      R.determinant() > 0.0)
    return R;
  throw py::value_error(std::string(name) + ": expected a rotation matrix (orthonormal, det +1)");
}

}  // namespace

std::string shape_text(const py::array& array) { return text_of(shape_of(array)); }

void check_shape(const py::array& array, const Shape1& shape, const char* name) {
  const bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size()) &&
                    std::equal(shape.begin(), shape.end(), array.shape(),
                               [](auto want, auto have) { return want < 0 || want == have; });
  if (!fits)
    throw py::value_error(std::string(name) + ": expected shape " + text_of(shape) + ", found " +
                          shape_text(array));
}

ConstMap vector(const Array& array, Eigen::Index size, const char* name) {
  check_shape(array, {size}, name);
  return {array.data(), size};
}

ConstRowMap matrix(const Array& array, Eigen::Index rows, Eigen::Index columns, const char* name) {
  check_shape(array, {rows, columns}, name);
  return {array.data(), array.shape(0), array.shape(1)};
}

Vector3 vector3(const Array& array, const char* name) { return vector(array, 3, name); }

VectorX vector_or(const py::object& given, const VectorX& otherwise, const char* name) {
  return given.is_none() ? otherwise : VectorX(vector(Array(given), otherwise.size(), name));
}

py::array view(const double* data, const Shape1& shape, const Shape1& strides, py::handle owner,
               bool writable) {
  Shape1 bytes(strides);
  for (py::ssize_t& stride : bytes) stride *= static_cast<py::ssize_t>(sizeof(double));
  py::array array(py::dtype::of<double>(), shape, bytes, data, owner);
  if (!writable)
    py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

py::array view(const VectorX& x, py::handle owner, bool writable) {
  return view(x.data(), {x.size()}, {1}, owner, writable);
}

py::array view(const MatrixX& m, py::handle owner, bool writable) {
  return view(m.data(), {m.rows(), m.cols()}, {1, m.rows()}, owner, writable);
}

py::array view_columns(const MatrixX& m, py::handle owner) {
  return view(m.data(), {m.cols(), m.rows()}, {m.rows(), 1}, owner);
}

py::array view(const std::vector<double>& x, py::handle owner) {
  return view(x.data(), {static_cast<py::ssize_t>(x.size())}, {1}, owner);
}

py::array copy(const VectorX& x) { return py::array_t<double>(x.size(), x.data()); }

py::array copy(const Matrix3& m) {
  py::array_t<double> out({3, 3});
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out.mutable_at(i, j) = m(i, j);
  return out;
}

py::array copy_matrix(const MatrixX& m, bool columns_are_rows) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  if (columns_are_rows) {
    py::array_t<double> out({m.cols(), m.rows()});
    Eigen::Map<RowMajor>(out.mutable_data(), m.cols(), m.rows()) = m.transpose();
    return out;
  }
  py::array_t<double> out({m.rows(), m.cols()});
  Eigen::Map<RowMajor>(out.mutable_data(), m.rows(), m.cols()) = m;
  return out;
}

py::array_t<double> output(const py::object& given, const Shape1& shape, const char* name) {
  if (given.is_none()) return py::array_t<double>(shape);
  constexpr int kRowByRow = py::array::c_style;
  if (!py::isinstance<py::array_t<double>>(given))
    throw py::value_error(std::string(name) + ": expected a NumPy array of float64");
  auto array = py::reinterpret_borrow<py::array_t<double>>(given);
  check_shape(array, shape, name);
  if (!array.writeable() || (array.flags() & kRowByRow) != kRowByRow)
    throw py::value_error(std::string(name) + ": expected a writable C-contiguous array");
  return array;
}

Pose pose_from(py::handle object, const char* name) {
  if (object.is_none()) return {};
  if (py::isinstance<Pose>(object)) return object.cast<Pose>();
  const Array array(py::reinterpret_borrow<py::object>(object));
  if (array.ndim() == 1) return {Matrix3::Identity(), vector3(array, name)};
  if (array.shape(0) == 3 && array.ndim() == 2 && array.shape(1) == 3)
    return {checked_rotation(matrix(array, 3, 3, name), name), Vector3::Zero()};
  check_shape(array, {4, 4}, name);
  const auto X = matrix(array, 4, 4, name);
  return {checked_rotation(X.topLeftCorner<3, 3>(), name), X.topRightCorner<3, 1>()};
}

}  // namespace counterpoint::python
